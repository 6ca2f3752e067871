"""Hulls of parts: they hold all points, and their tables find the corner that lies farthest along any direction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.hulls import enclosing_hulls as hulls_module
from clench.kernels.hulls.enclosing_hulls import FEW, HullPart, pack_hulls
from kernels.kernel_entries import entry

lowest_corner = entry(hulls_module.lowest_corner)


def cloud(kind, count, rng):
    """Return points: in a ball, on a sphere, on a grid of a box, nearly flat, flat, on a line, or at one place."""
    points = rng.normal(size=(count, 3))
    if kind == "sphere":
        return points / np.linalg.norm(points, axis=1)[:, None]
    if kind == "grid":
        return np.round(points * 2.0) / 2.0
    if kind in ("flat", "nearly flat"):
        points[:, 2] *= 0.0 if kind == "flat" else 1e-14
    if kind == "line":
        points[:, 1:] = 0.0
    if kind == "place":
        points[:] = points[0]
    return points


KINDS = ["ball", "sphere", "grid", "flat", "nearly flat", "line", "place"]


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=12)
@given(seed=st.integers(0, 10**6), count=st.sampled_from([1, 3, FEW, FEW + 1, 60, 1540]), size=st.integers(-6, 3))
def test_the_lowest_corner_is_as_low_as_any_point_along_any_direction(kind, seed, count, size):
    rng = np.random.default_rng(seed)
    points = cloud(kind, count, rng) * 10.0**size
    radius = float(rng.choice([0.0, 0.1])) * 10.0**size
    other = rng.normal(size=(4, 3))
    hulls = pack_hulls([[HullPart(other, 0.0)], [], [HullPart(points, radius), HullPart(other, 0.0)]])
    assert list(hulls.body) == [0, 1, 1, 3]
    corners = hulls.points[hulls.first[1] : hulls.first[2]]
    assert {tuple(p) for p in corners} <= {tuple(p) for p in points}
    # Along axes and diagonals, where cones meet, and along others.
    special = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T
    for n in np.vstack([special[(special != 0.0).any(axis=1)], rng.normal(size=(200, 3))]):
        n = n / np.linalg.norm(n)
        low, k = lowest_corner(hulls, 1, *n)
        assert low == pytest.approx(hulls.points[k] @ n, abs=1e-14 * 10.0**size)
        least = (points @ n).min()
        assert low >= least - 1e-14 * 10.0**size
        assert low - hulls.radius[1] <= least - radius
        assert hulls.radius[1] - radius <= 1e-9 * 10.0**size
    assert (hulls.table[1] >= 0) == (len(corners) > FEW)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10**6), kind=st.sampled_from(KINDS))
def test_the_box_around_a_hull_holds_its_corners(seed, kind):
    rng = np.random.default_rng(seed)
    hulls = pack_hulls([[HullPart(cloud(kind, 30, rng), 0.0)]])
    box = hulls.box[0]
    inside = np.abs((hulls.points - box[:, 3]) @ box[:, :3])
    assert np.allclose(box[:, :3].T @ box[:, :3], np.eye(3), atol=1e-12)
    assert (inside <= box[:, 4] + 1e-12).all()
    assert (box[:, 4] <= inside.max(axis=0) + 1e-9).all()


def test_a_body_with_a_part_that_is_too_large_has_no_hulls(monkeypatch):
    rng = np.random.default_rng(1)
    small, large = cloud("sphere", 30, rng), cloud("sphere", 50, rng)
    bodies = [[(small, 0.0)], [(small, 0.0), (large, 0.0)], [(small, 0.0), (small, 0.1)]]
    for limit in ("MOST_POINTS", "MOST_CORNERS"):
        monkeypatch.setattr(hulls_module, limit, 40)
        hulls = pack_hulls([[HullPart(p, r) for p, r in body] for body in bodies])
        assert list(hulls.body) == [0, 1, 1, 3]
        assert len(hulls.points) == 90
        monkeypatch.undo()
