"""Bounds of winding numbers hold, and what they decide is what the exact sum over all triangles decides."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry.winding import COARSE, rough_winding_number, winding_number, winds_around
from clench.kernels.trees.bvh import build_tree
from kernels.kernel_solids import ball, star, torus

SOLIDS = {"ball": ball(3), "torus": torus(1.0, 0.4), "star": star(5, 1.0)}
scales = st.sampled_from([1e-3, 1e-2, 1.0, 30.0, 1e3])
seeds = st.integers(0, 2**31)
kinds = st.sampled_from([*SOLIDS, "soup", "slivers", "cup"])


def open_mesh(kind, rng):
    """Return vertices and triangles of a mesh with holes, turned triangles, triangles without area, and copies."""
    if kind in SOLIDS:
        mesh = SOLIDS[kind]
        vertices, triangles = mesh.vertices, mesh.triangles
        triangles = triangles[rng.random(len(triangles)) > rng.choice([0.0, 0.05, 0.5])]
    elif kind == "cup":
        vertices, triangles = ball(4).vertices, ball(4).triangles
        triangles = triangles[vertices[triangles][:, :, 2].max(axis=1) < rng.uniform(-0.5, 0.9)]
    else:
        vertices = rng.normal(size=(3 * rng.integers(1, 400), 3))
        triangles = np.arange(len(vertices)).reshape(-1, 3)
        middles = vertices[triangles[:, :1]]
        size = np.array([1e-9, 1.0, 1e-3]) if kind == "slivers" else np.array([0.2, 0.2, 0.2])
        vertices = (middles + size * (vertices[triangles] - middles)).reshape(-1, 3)
    triangles = triangles.copy()
    turned = rng.random(len(triangles)) < rng.choice([0.0, 0.02, 0.5])
    triangles[turned] = triangles[turned][:, ::-1]
    flat = rng.random(len(triangles)) < rng.choice([0.0, 0.05])
    triangles[flat, 1] = triangles[flat, 0]
    if rng.random() < 0.3:
        first = rng.integers(0, len(vertices), len(vertices) // 3)
        vertices, triangles = np.vstack([vertices, vertices[first]]), np.vstack([triangles, triangles[: len(first)]])
    return vertices, triangles


def placed(vertices, rng, scale):
    """Turn and move a mesh, at times far from the origin."""
    T = Rotation.random(random_state=int(rng.integers(2**31)))
    return (T.apply(np.array(vertices)) + rng.normal(size=3) * rng.choice([0.0, 1.0, 1e3])) * scale


def points_about(tree, rng):
    """Return points in and around the box of a mesh, and points on its surface and beside it."""
    low, high = tree.low[0], tree.high[0]
    size = high - low
    spread = rng.uniform(low - 0.1 * size, high + 0.1 * size, (20, 3))
    corners = tree.vertices[tree.triangles[rng.integers(0, len(tree.triangles), 12)]]
    weights = rng.dirichlet([1.0, 1.0, 1.0], 12)
    weights[:3], weights[3:6] = [1.0, 0.0, 0.0], [0.5, 0.5, 0.0]
    on = np.einsum("ik,ikj->ij", weights, corners)
    beside = on + rng.normal(size=on.shape) * size.max() * 10.0 ** rng.uniform(-16, -1, (12, 1))
    return np.vstack([spread, on, beside])


@settings(max_examples=150, deadline=None)
@given(kinds, seeds, scales)
def test_bounds_hold_and_decide_like_the_sum(kind, seed, scale):
    rng = np.random.default_rng(seed)
    vertices, triangles = open_mesh(kind, rng)
    if len(triangles) == 0:
        return
    tree = build_tree(placed(vertices, rng, scale), triangles, is_open=True)
    assert len(tree.moments) == len(tree.low)
    for p in points_about(tree, rng):
        exact = winding_number(tree, p)
        for allowed in (np.inf, COARSE, 1e-3, 1e-5, 0.0):
            number, error = rough_winding_number(tree, p, allowed)
            assert abs(number - exact) <= error
        assert winds_around(tree, p) == (abs(exact) > 0.5)


@settings(max_examples=60, deadline=None)
@given(kinds, seeds, scales)
def test_points_at_the_threshold_are_decided_by_the_sum(kind, seed, scale):
    rng = np.random.default_rng(seed)
    vertices, triangles = open_mesh(kind, rng)
    if len(triangles) == 0:
        return
    tree = build_tree(placed(vertices, rng, scale), triangles, is_open=True)
    points = points_about(tree, rng)
    inside = np.array([abs(winding_number(tree, p)) > 0.5 for p in points])
    if inside.all() or not inside.any():
        return
    a, b = points[inside][0], points[~inside][0]
    for _ in range(200):
        middle = 0.5 * (a + b)
        assert winds_around(tree, middle) == (abs(winding_number(tree, middle)) > 0.5)
        a, b = (middle, b) if winds_around(tree, middle) else (a, middle)
        if (middle == a).all() and (middle == b).all():
            break


def test_bounds_alone_decide_where_the_number_is_not_near_one_half():
    vertices, triangles = ball(5).vertices, ball(5).triangles
    cup = triangles[vertices[triangles][:, :, 2].max(axis=1) < 0.6]
    tree = build_tree(vertices, cup, is_open=True)
    for p, inside in (((0.0, 0.1, -0.2), True), ((0.9, 0.9, -0.9), False)):
        number, error = rough_winding_number(tree, p, COARSE)
        assert (abs(number) - error > 0.5) if inside else (abs(number) + error < 0.5)
        assert winds_around(tree, p) == inside


def test_the_bound_is_as_tight_as_its_proof():
    # Two small plates, one behind the other: for them, the first term that the moments leave out is as large as can be.
    square = 4e-3 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    plates = np.vstack([square + np.array([0.0, 0.0, z]) for z in (-0.04, 0.04)])
    tree = build_tree(plates, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], is_open=True)
    p = np.array([2e-3, 2e-3, -1.0])
    number, error = rough_winding_number(tree, p, np.inf)
    off = abs(number - winding_number(tree, p))
    assert off > 1e-8
    assert off <= error < 1.1 * off


def test_less_is_allowed_and_less_is_wrong():
    vertices, triangles = SOLIDS["star"].vertices, SOLIDS["star"].triangles
    tree = build_tree(vertices, triangles[5:], is_open=True)
    errors = [rough_winding_number(tree, (0.1, 0.0, 0.2), allowed)[1] for allowed in (1e-1, 1e-2, 1e-3, 1e-4, 0.0)]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-10
    assert errors[0] > 10.0 * errors[-2]


@pytest.mark.parametrize("is_open", [False, True])
@pytest.mark.parametrize("scale", [1e-150, 1e-40, 1e-20, 1e20, 1e40])
def test_extreme_sizes_are_decided_as_by_the_sum(scale, is_open):
    mesh = SOLIDS["torus"]
    tree = build_tree(mesh.vertices * scale, mesh.triangles[50:], is_open=is_open)
    for p in np.random.default_rng(3).uniform(-1.5, 1.5, (50, 3)) * scale:
        assert winds_around(tree, p) == (abs(winding_number(tree, p)) > 0.5)


def test_a_point_that_is_no_number_is_not_inside():
    tree = build_tree(SOLIDS["ball"].vertices, SOLIDS["ball"].triangles[3:], is_open=True)
    for value in (np.nan, np.inf, -np.inf):
        assert not winds_around(tree, (value, 0.0, 0.0))
