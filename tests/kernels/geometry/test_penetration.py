"""Depth equals what geometry says: corners, ridges, faces, nesting, touching."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry.mesh_distance import signed_distance
from clench.kernels.geometry.penetration import CROSSINGS, penetration
from clench.kernels.trees.bvh import STACK_SIZE, build_tree, feature_owners
from clench.models.mesh import TriangleMesh
from kernels.kernel_solids import ball, bounding_volumes, box, gap, moved, star


def depth_of(link, obj, T, *, closed=True, limit=np.inf):
    one, two = build_tree(link.vertices, link.triangles), build_tree(obj.vertices, obj.triangles)
    forth, back = np.ascontiguousarray(T[:3]), np.ascontiguousarray(np.linalg.inv(T)[:3])
    scratch = np.empty(CROSSINGS), np.empty(STACK_SIZE, dtype=np.int32)
    depth, *place = penetration(
        one, feature_owners(one), closed, two, feature_owners(two), closed, forth, back, limit, scratch
    )
    return depth, np.array(place)


def shift(x, y=0.0, z=0.0):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


@pytest.mark.parametrize("closed", [True, False])
def test_corner_in_a_box(closed):
    turn = np.eye(4)
    turn[:3, :3] = Rotation.align_vectors([[-1, 0, 0]], [[1, 1, 1]])[0].as_matrix()
    turn[0, 3] = 1.0 + np.sqrt(3.0) / 2.0 - 0.05
    depth, place = depth_of(box(1, 1, 1), box(2, 2, 2), turn, closed=closed)
    assert depth == pytest.approx(0.05, abs=1e-12)
    np.testing.assert_allclose(place, [0.95, 0.0, 0.0], atol=1e-9)


def test_crossing_ridges_without_a_vertex_inside():
    bar = moved(
        box(1, 10, 1),
        np.vstack(
            [np.hstack([Rotation.from_euler("y", 45, degrees=True).as_matrix(), np.zeros((3, 1))]), [0, 0, 0, 1]]
        ),
    )
    across = np.eye(4)
    across[:3, :3] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    across[2, 3] = np.sqrt(2.0) - 0.01
    depth, place = depth_of(bar, bar, across)
    # The ridge of one lies 0.01 below that of the other; its distance to the faces there is 0.01 / sqrt 2.
    assert depth == pytest.approx(0.01 / np.sqrt(2.0), rel=1e-9)
    np.testing.assert_allclose(place[:2], 0.0, atol=1e-9)
    across[2, 3] = np.sqrt(2.0) + 1e-9
    assert depth_of(bar, bar, across)[0] == 0.0


@pytest.mark.parametrize("slide", [0.01, 0.3])
def test_boxes_of_one_cross_section_with_faces_in_common_planes(slide):
    depth, _ = depth_of(box(1, 1, 1), box(1, 1, 1), shift(1.0 - slide))
    assert depth == pytest.approx(min(slide, 1.0 / 3.0), rel=0.5)
    assert 0.0 < depth <= slide + 1e-12


def test_blade_in_a_thick_link_and_the_other_way_round():
    blade, thick = box(0.01, 4, 4), box(1, 2, 1)
    one, _ = depth_of(thick, blade, shift(0.0, 0.0, 2.3))
    other, place = depth_of(blade, thick, np.linalg.inv(shift(0.0, 0.0, 2.3)))
    assert one == pytest.approx(other, rel=1e-12)
    # The blade's rim is 0.2 inside the thick one, along z.
    assert one == pytest.approx(0.2, rel=1e-6)
    assert place[2] == pytest.approx(-0.3, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 1.95), st.integers(0, 2**31), st.sampled_from([1e-3, 1.0, 1e3]))
def test_overlapping_balls(distance, seed, scale):
    # Larger overlaps have their deepest point elsewhere once a centre lies inside the other ball.
    assume(distance > 1.05)
    direction = Rotation.random(random_state=seed).as_matrix()[0] * distance * scale
    depth, _ = depth_of(ball(3, scale), ball(3, scale), shift(*direction))
    assert depth == pytest.approx((2.0 - distance) * scale, abs=0.03 * scale)


def test_nested_balls():
    depth, place = depth_of(ball(2, 0.3), ball(3, 1.0), shift(0.1))
    assert depth == pytest.approx(1.0 - 0.3 + 0.1, abs=0.02)
    assert place[0] < -0.15


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.0, 2.5))
def test_depth_of_stars_against_sampling_and_an_independent_engine(seed, distance):
    one, two = star(seed, 1.0), star(seed + 1, 1.0)
    T = shift(distance)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    depth, place = depth_of(one, two, T)
    apart = gap(bounding_volumes(one), T, bounding_volumes(two), np.eye(4))
    trees = [build_tree(m.vertices, m.triangles) for m in (moved(one, T), two)]
    if apart > 1e-9:
        nested = (
            signed_distance(trees[0], two.vertices[0], True) < 0
            or signed_distance(trees[1], moved(one, T).vertices[0], True) < 0
        )
        assert (depth > 0.0) is nested
        return
    assert depth > 0.0
    depths = [-signed_distance(tree, place, True) for tree in trees]
    # The place lies on one surface, and as deep as said inside the other.
    assert max(depths) == pytest.approx(depth, abs=1e-12)
    assert min(map(abs, depths)) < 1e-12
    vertices = [(trees[1], moved(one, T).vertices), (trees[0], two.vertices)]
    assert depth >= max(-signed_distance(tree, v, True) for tree, points in vertices for v in points) - 1e-12


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_touching_is_no_depth(turn):
    T = shift(0.0, 0.0, 1.5)
    T[:3, :3] = Rotation.from_euler("z", turn).as_matrix()
    assert depth_of(box(1, 1, 1), box(2, 2, 2), T)[0] <= 1e-15
    T[2, 3] = 1.5 - 1e-6
    assert depth_of(box(1, 1, 1), box(2, 2, 2), T)[0] == pytest.approx(1e-6, rel=1e-6)


def test_depth_does_not_depend_on_the_frame():
    one, two = star(1, 1.0), star(2, 1.0)
    G = shift(3.0, -2.0, 1.0)
    G[:3, :3] = Rotation.random(random_state=9).as_matrix()
    here, place = depth_of(one, two, shift(1.2))
    there, moved_place = depth_of(one, moved(two, G), G @ shift(1.2))
    assert there == pytest.approx(here, abs=1e-13)
    np.testing.assert_allclose(moved_place, G[:3, :3] @ place + G[:3, 3], atol=1e-12)


def test_disjoint_and_empty_have_none():
    nothing = TriangleMesh(np.empty((0, 3)), np.empty((0, 3)))
    assert depth_of(box(1, 1, 1), box(1, 1, 1), shift(5.0))[0] == 0.0
    assert depth_of(nothing, box(1, 1, 1), shift(0.0))[0] == 0.0
    assert depth_of(box(1, 1, 1), nothing, shift(0.0))[0] == 0.0


@pytest.mark.parametrize("side", [0.1, 3.0])
def test_no_depth_is_larger_than_its_limit(side):
    deep, _ = depth_of(box(side, side, side), box(8, 8, 8), shift(0.3))
    for limit in (0.01, 0.5 * deep):
        depth, place = depth_of(box(side, side, side), box(8, 8, 8), shift(0.3), limit=limit)
        assert depth == limit
        solid = build_tree(box(8, 8, 8).vertices, box(8, 8, 8).triangles)
        assert signed_distance(solid, place, True) <= -limit
    assert depth_of(box(side, side, side), box(8, 8, 8), shift(0.3), limit=1.01 * deep)[0] == deep
