"""What lies wholly inside something else crosses no surface; one point of every connected part tells."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.closing.collision.containment import contained_link, link_within_link
from clench.closing.collision.packed_object import pack_object
from clench.closing.link_bodies import hand_bodies
from clench.core.pose import Pose
from clench.kernels.trees.bvh import build_tree
from clench.models.objects.grasp_object import GraspObject
from clench.models.parts import part_points
from clench.models.shapes import CollisionSource, Shape, ShapeKind

SPHERE = (0.002, 0.0, 0.0)


def thick():
    """Return a finger of one box, 60 x 30 x 30 mm."""
    return (
        HandBuilder().finger("index", [Shape(ShapeKind.BOX, (0.03, 0.015, 0.015), Pose([0.04, 0, 0]))], [0.07]).hand()
    )


@pytest.mark.parametrize(("place", "inside"), [([0.04, 0.004, 0.0], True), ([0.04, 0.004, 0.02], False)])
def test_a_ball_in_a_thick_link(place, inside):
    obj = GraspObject.from_shape(Shape(ShapeKind.SPHERE, SPHERE), pose=Pose(place), name="ball")
    hand = thick()
    found = contained_link(hand, np.zeros(1), pack_object(obj), obj.pose.matrix, CollisionSource.ENGINE, (1,))
    assert (found == 1) == inside


def test_a_link_in_a_large_ball():
    obj = GraspObject.load("sphere:r=0.3", pose=Pose([0.02, 0.01, 0.03]))
    hand = HandBuilder().finger("index", [along_x(0.007, 0.05)], [0.05]).hand()
    assert contained_link(hand, np.zeros(1), pack_object(obj), obj.pose.matrix, CollisionSource.ENGINE, (1,)) == 1


@pytest.mark.parametrize(
    ("place", "inside"),
    [([0.025, 0.0, 0.0], True), ([0.025, 0.04, 0.0], False), ([0.1, 0.0, 0.0], False)],
)
@pytest.mark.parametrize("parts", [1, 2])
def test_a_link_of_boxes_in_a_large_box(place, inside, parts):
    """Of two boxes, one far away, the one that lies inside tells."""
    near = Shape(ShapeKind.BOX, (0.02, 0.004, 0.004), Pose([0.025, 0.0, 0.0]))
    far = Shape(ShapeKind.BOX, (0.002, 0.004, 0.004), Pose([0.3, 0.0, 0.0]))
    hand = HandBuilder().finger("index", [(near, far)[:parts]], [0.05]).hand()
    obj = GraspObject.load("box:x=0.06,y=0.03,z=0.03", pose=Pose(place))
    found = contained_link(hand, np.zeros(1), pack_object(obj), obj.pose.matrix, CollisionSource.ENGINE, (1,))
    assert (found == 1) == inside


def test_a_ball_inside_a_link_between_the_planes_blocks_it():
    obj = GraspObject.from_shape(Shape(ShapeKind.SPHERE, SPHERE), pose=Pose([0.04, 0.006, 0.0]), name="ball")
    solution = clench.solve(thick(), obj, clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open"))
    assert solution.status == "blocked"
    assert solution.fingers["index"].status == "blocked"
    assert not solution.certified


def test_nothing_is_certified_with_a_link_inside_another():
    palm = Shape(ShapeKind.BOX, (0.1, 0.05, 0.05), Pose([0.05, 0, 0]))
    hand = HandBuilder(palm).finger("index", [along_x(0.002, 0.02), along_x(0.002, 0.02)], [0.03, 0.03]).hand()
    obj = GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    assert not solution.certified
    assert "lies inside" in solution.certificate["text"]


def test_a_point_of_every_part():
    box = Shape(ShapeKind.BOX, (1.0, 1.0, 1.0)).to_mesh(1e-3)
    vertices = np.vstack([box.vertices, box.vertices + 10.0, box.vertices + 20.0])
    triangles = np.vstack([box.triangles + 8 * k for k in range(3)])
    points = part_points(build_tree(vertices, triangles))
    assert sorted(np.round(points[:, 0] / 10.0)) == [0.0, 1.0, 2.0]
    assert part_points(build_tree(np.empty((0, 3)), np.empty((0, 3)))).shape == (0, 3)


@pytest.mark.parametrize("merged", [True, False])
def test_faces_at_the_same_places_are_one_part_whether_they_share_vertices_or_not(merged):
    box = Shape(ShapeKind.BOX, (1.0, 1.0, 1.0), Pose([3.0, 0.0, 0.0])).to_mesh(1e-3)
    vertices, triangles = box.vertices, box.triangles
    if not merged:
        vertices, triangles = vertices[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)
    (point,) = part_points(build_tree(vertices, triangles))
    assert point.tolist() == min(box.vertices.tolist())


@pytest.mark.parametrize(("away", "found"), [(0.0, True), (0.02, True), (0.2, False)])
def test_a_link_within_another_is_found_from_either_side(away, found):
    for first in (True, False):
        builder = HandBuilder()
        thick = ("thick", [along_x(0.04, 0.05)], [0.05])
        thin = ("thin", [along_x(0.004, 0.03)], [0.03])
        for name, shapes, lengths in (thick, thin) if first else (thin, thick):
            builder.finger(name, shapes, lengths, base=mount((0.0, away if name == "thin" else 0.0, 0.0)))
        hand = builder.hand()
        links = {name: hand.link_index(f"{name}_link_0") for name in ("thick", "thin")}
        across = hand_bodies(hand, CollisionSource.ENGINE).across
        pair = link_within_link(hand, np.zeros(2), CollisionSource.ENGINE, across)
        assert pair == ((links["thin"], links["thick"]) if found else None)
        assert link_within_link(hand, np.zeros(2), CollisionSource.ENGINE, np.zeros_like(across)) is None
