"""Depths, travel and retreat of a hand of blocks are what one works out by hand."""

import numpy as np
import pytest
from block_hands import block_hand

from clench.closing.collision.depths import hand_depths, retreat_distance, travel_to_touch
from clench.closing.collision.packed_object import pack_object
from clench.core.pose import Pose
from clench.models.hand.link_mesh import link_meshes
from clench.models.mesh import TriangleMesh, is_closed
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.shapes import Shape, ShapeKind

OPEN = np.zeros(1)


def packed_box(x, y, z, role=BodyRole.GRASPABLE):
    return pack_object(GraspObject("box", (Body("box", (Shape(ShapeKind.BOX, (x / 2, y / 2, z / 2)),), role=role),)))


def at(x=0.0, y=0.0, z=0.0):
    return Pose([x, y, z]).matrix


def test_links_without_shapes_have_no_mesh_and_meshes_are_kept():
    hand = block_hand()
    assert [mesh.link for mesh in link_meshes(hand)] == [0, 2]
    assert link_meshes(hand) is link_meshes(hand)
    assert link_meshes(block_hand()) is not link_meshes(hand)


def test_depth_of_each_link_and_its_place():
    # A cube of 20 mm whose bottom is 2 mm in the palm, clear of the finger.
    palm, finger = hand_depths(block_hand(), OPEN, packed_box(0.02, 0.02, 0.02), at(z=0.008))
    assert (palm.link, finger.link) == (0, 2)
    assert palm.depth == pytest.approx(0.002, abs=1e-12)
    # On the palm's surface or on the cube's bottom: either is 2 mm from the other surface.
    assert palm.place[2] == pytest.approx(-0.008, abs=1e-12) or palm.place[2] == pytest.approx(-0.01, abs=1e-12)
    assert np.abs(palm.place[:2]).max() <= 0.01 + 1e-12
    assert (finger.depth, finger.place) == (0.0, None)


def test_depth_at_another_posture_and_of_chosen_links():
    hand, box = block_hand(), packed_box(0.02, 0.02, 0.02)
    bent = np.array([np.pi / 2])
    # Bent outwards, the finger lies along x from 50 to 90 mm, its upper side at z = 5 mm.
    palm, finger = hand_depths(hand, bent, box, at(x=0.08, z=0.014))
    assert palm.depth == 0.0
    assert finger.depth == pytest.approx(0.001, abs=1e-12)
    assert hand_depths(hand, OPEN, box, at(x=0.08, z=0.014))[1].depth == 0.0
    (only,) = hand_depths(hand, bent, box, at(x=0.08, z=0.014), links=[2])
    assert only.link == 2


def test_touching_is_no_depth():
    assert all(d.place is None for d in hand_depths(block_hand(), OPEN, packed_box(0.02, 0.02, 0.02), at(z=0.01)))


def test_travel_is_that_of_the_first_link():
    hand, box = block_hand(), packed_box(0.02, 0.02, 0.02)
    up = np.array([0.0, 0.0, 1.0])
    assert travel_to_touch(hand, OPEN, box, at(z=0.5), up) == pytest.approx(0.49, abs=1e-13)
    assert travel_to_touch(hand, OPEN, box, at(x=0.05, z=0.5), up) == pytest.approx(0.45, abs=1e-13)
    assert travel_to_touch(hand, OPEN, box, at(x=0.5, z=0.5), up) == np.inf
    assert travel_to_touch(hand, OPEN, box, at(z=0.5), -up) == np.inf


@pytest.mark.parametrize(
    ("x", "z", "expected"), [(0.0, 0.008, 0.002), (0.0, 0.01, 0.0), (0.05, 0.02, 0.03), (0.3, 0.0, 0.0)]
)
def test_retreat_frees_the_hand(x, z, expected):
    hand, box = block_hand(), packed_box(0.02, 0.02, 0.02)
    retreat = retreat_distance(hand, OPEN, box, at(x=x, z=z))
    assert retreat == pytest.approx(expected, abs=1e-12)
    assert all(d.depth <= 1e-12 for d in hand_depths(hand, OPEN, box, at(x=x, z=z + retreat)))
    if expected > 0.0:
        assert any(d.depth > 0.0 for d in hand_depths(hand, OPEN, box, at(x=x, z=z + retreat - 1e-5)))


def test_retreat_from_deep_inside():
    # The palm swallowed by a large box: out past the finger's tip.
    retreat = retreat_distance(block_hand(), OPEN, packed_box(1.0, 1.0, 1.0), at())
    assert retreat == pytest.approx(0.54, abs=1e-12)


def test_round_links_are_as_deep_as_their_shape_to_the_stated_deviation():
    hand = block_hand(finger=Shape(ShapeKind.SPHERE, (0.01, 0.0, 0.0), Pose([0.0, 0.0, 0.05])))
    finger = hand_depths(hand, OPEN, packed_box(0.04, 0.04, 0.04), at(x=0.05, z=0.078))[1]
    assert 0.002 - 2e-5 <= finger.depth <= 0.002 + 1e-12


def test_closed_is_told_from_open_and_inward():
    box = Shape(ShapeKind.BOX, (1.0, 1.0, 1.0)).to_mesh()
    assert is_closed(box)
    assert is_closed(TriangleMesh(box.vertices[box.triangles], np.arange(36)))
    assert not is_closed(TriangleMesh(box.vertices, box.triangles[1:]))
    assert not is_closed(TriangleMesh(box.vertices, box.triangles[:, ::-1]))
    one_flipped = np.vstack([box.triangles[1:], box.triangles[:1, ::-1]])
    assert not is_closed(TriangleMesh(box.vertices, one_flipped))
    assert not is_closed(TriangleMesh(np.empty((0, 3)), np.empty((0, 3))))


@pytest.mark.parametrize("kind", [ShapeKind.BOX, ShapeKind.SPHERE])
@pytest.mark.parametrize("size", [1.0, 30.0])
def test_a_link_far_inside_is_as_deep_as_it_is_large(kind, size):
    """An exact depth in a sphere of metres looked at each of its triangles for each point of the link."""
    hand = block_hand()
    inside = pack_object(GraspObject("big", (Body("big", (Shape(kind, (size, size, size)),)),)))
    for found, mesh in zip(hand_depths(hand, OPEN, inside, at()), link_meshes(hand), strict=True):
        assert found.depth == 2.0 * mesh.radius
        assert found.at_least
        assert np.linalg.norm(found.place) < size - found.depth
    assert found.text == f"by at least {found.depth * 1e3:.2f} mm"
    across = hand_depths(hand, OPEN, inside, at(z=size + 0.003))
    assert not any(found.at_least for found in across)
