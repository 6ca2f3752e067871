"""The distance between two cores against the other engine, and the direction that goes with it."""

import fcl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clench.kernels.geometry.core_distance as closest
from clench.kernels.geometry.core_distance import separation
from kernels.kernel_entries import entry

crosses = entry(closest.crosses)

corner = st.tuples(*[st.integers(-8, 8).map(lambda k: k / 4.0)] * 3)
core = st.lists(corner, min_size=3, max_size=3)


def tree(points, corners):
    model = fcl.BVHModel()
    model.beginModel(1, 3)
    model.addSubModel(points, np.array([[0, min(1, corners - 1), min(2, corners - 1)]]))
    model.endModel()
    return fcl.CollisionObject(model)


def engine_distance(a, ka, b, kb):
    return fcl.distance(tree(a, ka), tree(b, kb), fcl.DistanceRequest(), fcl.DistanceResult())


@settings(deadline=None, max_examples=500)
@given(core, st.integers(1, 3), core, st.integers(1, 3))
def test_distance_and_direction(a, ka, b, kb):
    """Grid points on purpose: parallel edges, shared corners, triangles without area."""
    a, b = np.array(a, dtype=float), np.array(b, dtype=float)
    d, nx, ny, nz, _, _, x, y, z = separation(a, ka, b, kb)
    expected = engine_distance(a, ka, b, kb)
    if expected <= 1e-12:
        return  # cores that cross are not measured here, and those that just touch have no direction
    assert d == pytest.approx(expected, abs=1e-9)
    n = np.array([nx, ny, nz])
    assert np.linalg.norm(n) == pytest.approx(1.0)
    # A plane across that direction separates the cores by all of the distance, and the point lies on it.
    low, high = (a[:ka] @ n).min(), (b[:kb] @ n).max()
    assert low - high == pytest.approx(d, abs=1e-9)
    assert np.array([x, y, z]) @ n == pytest.approx(high, abs=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_random_triangles(scale):
    rng = np.random.default_rng(4)
    seen = 0
    for _ in range(300):
        a, b = scale * rng.normal(size=(3, 3)), scale * (rng.normal(size=(3, 3)) + np.array([2.0, 0.0, 0.0]))
        expected = engine_distance(a, 3, b, 3)
        if expected > 0.0:
            assert separation(a, 3, b, 3)[0] == pytest.approx(expected, rel=1e-9, abs=1e-12 * scale)
            seen += 1
    assert seen > 100


def test_corner_edge_and_face_are_told_apart():
    face = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    above = np.array([[0.2, 0.2, 0.1], [0.2, 0.3, 0.5], [0.3, 0.2, 0.5]])
    assert separation(above, 3, face, 3)[4:6] == (0, 2)
    assert separation(face, 3, above, 3)[4:6] == (2, 0)
    across = np.array([[0.5, -0.2, 0.1], [0.5, 0.2, 0.1], [0.5, 0.0, 1.0]])
    assert separation(across[:, [0, 2, 1]] * [1, -1, 1], 2, face, 3)[4:6] == (1, 1)


FACE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
LINE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])


def test_an_edge_crosses_a_face_that_it_goes_through():
    for x, y, through in ((0.2, 0.3, True), (0.7, 0.7, False), (-0.1, 0.3, False), (0.0, 0.5, True)):
        edge = np.array([[x, y, -0.5], [x + 0.01, y, 0.5], [9.0, 9.0, 9.0]])
        assert crosses(edge, 2, FACE, 3) == crosses(FACE, 3, edge, 2) == through
        assert not crosses(edge - np.array([0.0, 0.0, 1.0]), 2, FACE, 3)
    pierced = np.array([[0.2, 0.2, -0.5], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]])
    assert crosses(pierced, 3, FACE, 3)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.8])
def test_where_an_edge_goes_through_the_plane_of_a_face_tells(part):
    """It goes through there after some part of its length; the rest of it is above or below what is beside the face."""
    run = np.array([0.6, 0.9, -0.4])
    for x, y, through in ((0.3, 0.3, True), (0.6, 0.6, False), (-0.1, 0.5, False), (0.5, -0.1, False)):
        at = np.array([x, y, 0.0])
        edge = np.array([at - part * run, at + (1.0 - part) * run, at])
        assert crosses(edge, 2, FACE, 3) == crosses(FACE, 3, edge, 2) == through


def test_points_edges_and_triangles_without_area_have_no_face_to_go_through():
    edge = np.array([[0.5, 0.0, -0.5], [0.5, 0.0, 0.5], [0.0, 0.0, 0.0]])
    assert not crosses(edge, 2, LINE, 3)
    assert not crosses(LINE, 3, edge, 2)
    assert not crosses(edge, 2, LINE, 2)
    assert not crosses(edge, 1, LINE, 3)
    # In the plane of the face nothing goes through it.
    flat = np.array([[0.2, 0.2, 0.0], [0.9, 0.9, 0.0], [0.0, 0.0, 0.0]])
    assert not crosses(flat, 2, FACE, 3)


def test_edges_that_run_alike_are_apart_along_what_is_between_them():
    """Their cross product has no direction; a distance of 0 has none either."""
    above = LINE + np.array([0.3, 0.0, 0.25])
    d, nx, ny, nz, fa, fb, *_ = separation(above, 2, LINE, 2)
    assert (d, nx, ny, nz) == (0.25, 0.0, 0.0, 1.0)
    assert 1 in (fa, fb)
    assert separation(LINE, 2, LINE, 2)[:4] == (0.0, 0.0, 0.0, 1.0)
