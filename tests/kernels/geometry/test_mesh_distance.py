"""Closest points equal brute force; inside is right on open, nested and awkward meshes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry import mesh_distance as distance
from clench.kernels.geometry.mesh_distance import (
    closest_on_triangle,
    closest_point,
    is_inside,
    signed_distance,
)
from clench.kernels.geometry.winding import winding_number
from clench.kernels.trees.bvh import build_tree
from clench.models.mesh import TriangleMesh
from kernels.kernel_solids import ball, box, hull, moved, star, torus

finite = st.floats(-2.0, 2.0)
points = st.tuples(finite, finite, finite)


def tree_of(mesh):
    return build_tree(mesh.vertices, mesh.triangles)


@settings(max_examples=300, deadline=None)
@given(points, points, points, points)
def test_no_point_of_a_triangle_is_closer(p, a, b, c):
    q = np.array(closest_on_triangle(p, a, b, c))
    p, corners = np.array(p), np.array([a, b, c])
    if np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) < 1e-6:
        return
    # The closest point of a convex set: no corner lies farther towards p.
    assert ((corners - q) @ (p - q)).max() <= 1e-9
    weights = np.linalg.lstsq(np.vstack([corners.T, np.ones(3)]), np.append(q, 1.0), rcond=None)[0]
    assert weights.min() >= -1e-9
    assert np.abs(weights @ corners - q).max() <= 1e-9


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**31), points, st.sampled_from([1e-6, 1.0, 1e3]))
def test_closest_point_is_that_of_all_triangles(seed, p, scale):
    mesh = moved(star(seed, 1.0), np.eye(4), scale)
    tree = tree_of(mesh)
    p = np.array(p) * scale
    squared, triangle, *q = closest_point(tree, p, np.inf)
    every = np.array([closest_on_triangle(tuple(p), *map(tuple, t)) for t in tree.vertices[tree.triangles]])
    assert squared == pytest.approx(((every - p) ** 2).sum(axis=1).min(), rel=1e-14)
    np.testing.assert_array_equal(q, every[triangle])
    length = np.sqrt(squared)
    assert closest_point(tree, p, length * (1 + 1e-9) + 1e-300)[1] >= 0 or length == 0.0
    assert closest_point(tree, p, length * (1 - 1e-9)) == (np.inf, -1, 0.0, 0.0, 0.0)


@settings(max_examples=100, deadline=None)
@given(points, st.booleans())
def test_signed_distance_of_a_box(p, closed):
    mesh = tree_of(box(2.0, 1.0, 3.0))
    beyond = np.abs(p) - [1.0, 0.5, 1.5]
    expected = np.linalg.norm(np.maximum(beyond, 0.0)) + min(beyond.max(), 0.0)
    if abs(expected) > 1e-12:
        assert signed_distance(mesh, np.array(p), closed) == pytest.approx(expected, abs=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), points)
def test_rays_and_solid_angle_agree(seed, p):
    for mesh in (star(seed, 1.0), hull(seed, 1.0), torus(1.0, 0.5)):
        tree = tree_of(mesh)
        if closest_point(tree, p, np.inf)[0] > 1e-18:
            number = winding_number(tree, p)
            assert number == pytest.approx(round(number), abs=1e-6)
            assert is_inside(tree, p, True) == (round(number) == 1) == is_inside(tree, p, False)


@pytest.mark.parametrize("ray", [0, 1, 2])
def test_rays_through_vertices_and_edges_do_not_mislead(ray):
    mesh = box(2.0, 1.0, 3.0)
    tree = tree_of(mesh)
    a, b, _ = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    for target in np.vstack([mesh.vertices, 0.5 * (a + b), 0.75 * a + 0.25 * b]):
        for back in (0.1, 0.3, 4.0):
            p = target - back * distance._RAYS[ray]
            depth = (np.array([1.0, 0.5, 1.5]) - np.abs(p)).min()
            if abs(depth) > 1e-9:
                assert is_inside(tree, p, True) == (depth > 0.0)


def test_two_bodies_and_a_hollow_one():
    one, other = ball(3, 1.0), moved(ball(3, 1.0), np.eye(4) + np.eye(4, k=3) * 1.0)
    both = tree_of(TriangleMesh.joined([one, other]))
    for x, inside in ((-0.9, True), (0.5, True), (1.9, True), (2.1, False), (-1.1, False)):
        assert is_inside(both, (x, 0.01, 0.02), True) is inside
    shell = tree_of(TriangleMesh.joined([one, TriangleMesh(one.vertices * 0.5, one.triangles[:, ::-1])]))
    for x, inside in ((0.0, False), (0.4, False), (0.6, True), (0.9, True), (1.1, False)):
        assert is_inside(shell, (x, 0.01, 0.02), True) is inside
        assert is_inside(shell, (x, 0.01, 0.02), False) is inside


def test_open_and_inward_meshes_by_winding_number():
    mesh = box(2.0, 2.0, 2.0)
    lid = (mesh.vertices[mesh.triangles][:, :, 0] > 0.9).all(axis=1)
    cup = tree_of(TriangleMesh(mesh.vertices, mesh.triangles[~lid]))
    assert winding_number(cup, (0.0, 0.0, 0.0)) == pytest.approx(5.0 / 6.0, abs=1e-12)
    assert is_inside(cup, (0.0, 0.0, 0.0), False)
    assert not is_inside(cup, (1.5, 0.0, 0.0), False)
    assert is_inside(tree_of(TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])), (0.1, 0.2, 0.3), False)


def test_distance_does_not_depend_on_the_frame():
    mesh, p = star(3, 1.0), np.array([0.3, 0.4, 0.1])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=1).as_matrix(), [5.0, -3.0, 2.0]
    expected = signed_distance(tree_of(mesh), p, True)
    assert signed_distance(tree_of(moved(mesh, T)), T[:3, :3] @ p + T[:3, 3], True) == pytest.approx(
        expected, abs=1e-14
    )


def test_mesh_without_triangles_is_infinitely_far():
    empty = build_tree(np.empty((0, 3)), np.empty((0, 3), dtype=int))
    assert signed_distance(empty, (0.0, 0.0, 0.0), True) == np.inf
    assert closest_point(empty, (0.0, 0.0, 0.0), np.inf) == (np.inf, -1, 0.0, 0.0, 0.0)
