"""The direction in which a hull of points reaches least far, against closed forms and the facets of other engines."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from clench.kernels.mechanics.weak_direction import nearer_facets


def weakest(points, starts):
    found, reach = np.empty_like(starts), np.empty(len(starts))
    nearer_facets(np.ascontiguousarray(points, dtype=float), starts, found, reach)
    return found, reach


def directions(count, size, seed=0):
    rows = np.random.default_rng(seed).normal(size=(count, size))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.parametrize("semi", [[1.0, 1.0], [0.2, 1.0, 3.0], [1e-3, 2e-3, 5e-3, 1e-2]])
def test_the_facets_of_a_cross_polytope(semi):
    """Every facet is as far away as every other: 1 / |1 / semi|; the signs are those of the start."""
    semi = np.array(semi)
    starts = directions(5, len(semi))
    found, reach = weakest(np.vstack([np.diag(semi), -np.diag(semi)]), starts)
    distance = 1.0 / np.linalg.norm(1.0 / semi)
    assert reach == pytest.approx(np.full(5, distance), rel=1e-9)
    np.testing.assert_allclose(np.abs(found), np.tile(distance / semi, (5, 1)), rtol=1e-9)


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_facet_of_random_points(size, seed):
    points = directions(14, size, seed) * np.random.default_rng(seed).uniform(0.5, 1.5, (14, 1))
    points = np.vstack([points, -0.4 * points[:6]])
    hull = ConvexHull(points)
    assert (hull.equations[:, -1] < 0.0).all()
    found, reach = weakest(points, directions(12, size, seed + 100))
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(reach, (found @ points.T).max(axis=1), atol=1e-12)
    # Each is a facet, and one of so many starts leads to the nearest.
    facets = hull.equations
    for n, r in zip(found, reach, strict=True):
        assert np.abs(facets[:, :-1] - n).max(axis=1).min() < 1e-6
        assert r >= -facets[:, -1].max() - 1e-9
    assert reach.min() == pytest.approx((-facets[:, -1]).min(), rel=1e-9)


def test_points_in_a_half_space_reach_nowhere_in_some_direction():
    points = np.array([[1.0, 0.0, 0.5], [1.0, 0.3, -0.5], [1.0, -0.3, 0.1], [2.0, 0.0, 0.0]])
    for start in (np.array([[-1.0, 0.0, 0.0]]), np.array([[-1.0, 0.1, 0.2]])):
        found, reach = weakest(points, start)
        assert reach[0] <= 0.0
        assert reach[0] == pytest.approx((points @ found[0]).max())
    # Without a point everything lies in every half space.
    assert weakest(np.empty((0, 3)), np.array([[0.0, 1.0, 0.0]]))[1] == -np.inf
