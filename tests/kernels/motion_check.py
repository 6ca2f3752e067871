"""Whether a corner moves as said: finite differences of its height, and bounds wherever it goes."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

_STEP = 1e-4
#: Where heights are taken for `check_motion`, from the place it looks at.
STEPS = (-_STEP, 0.0, _STEP)


def check_motion(motion: Callable[[float], Sequence[float]], s: float, heights: Sequence[float]) -> list[float]:
    """Assert that speed and acceleration are differences of the heights, and their bounds hold; return the bounds.

    Args:
        motion: of a place on the path: speed, acceleration, and the bounds of both. heights: at `s` plus `STEPS`.
    """
    before, now, after = heights
    slope, curvature, lever, bound = motion(s)
    assert slope == pytest.approx((after - before) / (2.0 * _STEP), abs=1e-7)
    assert curvature == pytest.approx((after - 2.0 * now + before) / _STEP**2, abs=1e-5)
    for turn in np.linspace(-2.0, 2.0, 9):
        there = motion(s + turn)
        assert abs(there[0]) <= lever + 1e-15
        assert abs(there[1]) <= bound + 1e-15
        assert there[2:] == pytest.approx((lever, bound), rel=1e-12)
    return [lever, bound]
