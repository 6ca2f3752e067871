"""One pair of cores, one of which turns: events with closed forms, and pairs that planes at rest hardly keep apart."""

import numpy as np
import pytest

from clench.kernels.sweep_pairs import sweep_pair

TOUCH = 1e-11
BEST = 1.5
PIVOT = np.array([[1.0, 0.0, 0.0]])


def swept(core, fixed, w=0.0, best=BEST):
    """Sweep a core that turns from x towards z about the origin."""
    corners = [np.ascontiguousarray(np.resize(np.asarray(c, dtype=float), (3, 3))) for c in (core, fixed)]
    return sweep_pair(corners[0], len(core), corners[1], len(fixed), w, PIVOT, 1, TOUCH, best, False, np.zeros((6, 3)))


@pytest.mark.parametrize("gap", [5e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("away", [0.0, 1e-6, 3.7e-5, 1e-3])
@pytest.mark.parametrize("run", [(0.3, 1.0, 0.6), (0.6, 1.0, -0.3), (1.0, 0.5, 1.0)])
def test_an_edge_that_slides_along_another_and_off_it_is_free(gap, away, run):
    """A face turns in its own plane; the other edge goes through that plane just below its side, which rises there.

    The gap across the side is `D + away sin θ - (D - gap) cos θ`: it only grows, hardly at first.
    """
    height = 0.05
    face = [(-0.02, 0.0, height), (0.02, 0.0, height), (0.0, 0.0, height + 0.02)]
    middle = np.array([away, 0.0, height - gap])
    edge = [middle - 0.01 * np.array(run), middle + 0.01 * np.array(run)]
    assert swept(face, edge) == BEST


@pytest.mark.parametrize("away", [0.02, 1e-3, 1e-4])
@pytest.mark.parametrize("part", [0.5, 0.99, 1.01, 2.0])
def test_an_edge_that_comes_down_on_another_touches_or_passes(away, part):
    """As above, but the side comes down at first: `D - away sin θ - (D - gap) cos θ` is 0, or stays above."""
    height = 0.05
    face = [(-0.03, 0.0, height), (0.03, 0.0, height), (0.0, 0.0, height + 0.02)]
    gap = part * (height - np.sqrt(height**2 - away**2))
    middle = np.array([-away, 0.0, height - gap])
    edge = [middle - 0.01 * np.array((0.3, 1.0, 0.6)), middle + 0.01 * np.array((0.3, 1.0, 0.6))]
    found = swept(face, edge)
    radius = np.hypot(away, height - gap)
    if part > 1.0:
        assert found == BEST
    else:
        expected = np.arctan2(away, height - gap) - np.arccos(height / radius)
        left = height - away * np.sin(found) - (height - gap) * np.cos(found)
        assert found == pytest.approx(expected, rel=1e-3)
        assert 0.0 <= left <= 2.0 * TOUCH
