"""Planes across the way of a mesh never rule out a meeting; whole motions of all corners and edges judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.toi import passing_planes
from clench.kernels.toi.passing_planes import COLUMNS, PLANES
from clench.kernels.trees.bvh import build_tree
from kernels.kernel_entries import entry
from kernels.kernel_solids import box, star, torus
from kernels.toi.test_toi_translation import first_event

forget, remember, passes_until, passes_triangle, top_of = (
    entry(getattr(passing_planes, name))
    for name in ("forget_passing", "remember_passing", "passes_until", "passes_triangle", "top_of")
)
SLACK = 1e-12


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_meeting_before_what_the_planes_tell(seed):
    """Limits that a plane calls safe are no later than the first event between the triangles of the two nodes."""
    rng = np.random.default_rng(seed)
    moving = star(seed, 0.05) if seed % 2 else torus(0.05, 0.02, major_sections=12, minor_sections=6)
    rest = star(seed + 1, 0.1)
    one, two = build_tree(moving.vertices, moving.triangles), build_tree(rest.vertices, rest.triangles)
    direction = unit(rng)
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    T[:3, 3] = -0.3 * direction + 0.05 * rng.normal(size=3)
    planes = np.empty((PLANES, COLUMNS))
    forget(planes)
    assert not passes_until(one, 0, two, 0, SLACK, 0.0, planes)
    for _ in range(PLANES + 2):
        n = unit(rng)
        remember((n[0], n[1], n[2]), one, np.ascontiguousarray(T[:3]), direction, planes)
    for _ in range(20):
        a, b, limit = rng.integers(len(one.low)), rng.integers(len(two.low)), rng.uniform(0.0, 0.5)
        if passes_until(one, a, two, b, SLACK, limit, planes):
            assert first_event(part(one, a), part(two, b), T, direction) >= limit - 1e-12
        triangle = two.vertices[two.triangles[rng.integers(len(two.triangles))]]
        if passes_triangle(one, a, tuple(map(tuple, triangle)), SLACK, limit, planes):
            assert first_event(part(one, a), Part(triangle, [[0, 1, 2]]), T, direction) >= limit - 1e-12


def test_a_plane_across_the_motion_tells_the_distance_of_two_faces():
    upper, lower = box(1.0, 1.0, 1.0), box(1.0, 1.0, 1.0)
    one, two = build_tree(upper.vertices, upper.triangles), build_tree(lower.vertices, lower.triangles)
    T, planes = np.eye(4)[:3].copy(), np.empty((PLANES, COLUMNS))
    T[2, 3] = 10.0
    forget(planes)
    remember((0.0, 0.0, 1.0), one, T, np.array([0.0, 0.0, -1.0]), planes)
    assert passes_until(one, 0, two, 0, SLACK, 9.0 - 1e-9, planes)
    assert not passes_until(one, 0, two, 0, SLACK, 9.0 + 1e-9, planes)


@pytest.mark.parametrize("count", [1, 3, 60])
def test_the_top_of_a_mesh_is_that_of_its_highest_corner(count):
    rng = np.random.default_rng(count)
    vertices = rng.normal(size=(3 * count, 3))
    tree = build_tree(vertices, np.arange(3 * count).reshape(-1, 3))
    for _ in range(20):
        n = unit(rng)
        assert top_of(tree, (n[0], n[1], n[2])) == pytest.approx((vertices @ n).max(), abs=1e-15)


def test_a_plane_along_the_motion_is_not_kept():
    planes, tree = np.empty((PLANES, COLUMNS)), build_tree(np.eye(3), [[0, 1, 2]])
    forget(planes)
    remember((1.0, 0.0, 0.0), tree, np.eye(4)[:3].copy(), np.array([0.0, 0.0, 1.0]), planes)
    assert not planes[:, -1].any()


class Part:
    def __init__(self, vertices, triangles):
        self.vertices, self.triangles = np.asarray(vertices), np.asarray(triangles)


def part(tree, node):
    """Return the triangles below a node as a mesh."""
    leaves = [n for n in range(node, tree.skip[node]) if tree.count[n]]
    rows = np.concatenate([np.arange(tree.first[n], tree.first[n] + tree.count[n]) for n in leaves])
    return Part(tree.vertices, tree.triangles[rows])
