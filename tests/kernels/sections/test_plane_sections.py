"""Circles around runs of segments hold the circle about each, and are small."""

import numpy as np
import pytest

from clench.kernels.closing.layout import RUN
from clench.kernels.sections import plane_sections
from clench.kernels.sections.plane_sections import make_sections
from kernels.kernel_entries import entry

put_circles = entry(plane_sections.put_circles)


@pytest.mark.parametrize("count", [0, 1, RUN - 1, RUN, RUN + 1, 5 * RUN + 3])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_circles_hold_their_segments(count, scale):
    rng = np.random.default_rng(count)
    sections = make_sections(2, 6 * RUN, 0)
    sections.segments[1, :count, :4] = scale * rng.normal(size=(count, 4))
    sections.counts[1, 0] = count
    sections.circles[:] = np.nan
    put_circles(sections, 1)
    assert np.isnan(sections.circles[0]).all()
    runs = -(-count // RUN)
    assert np.isnan(sections.circles[1, runs:]).all()
    for run in range(runs):
        x, z, radius = sections.circles[1, run]
        one = sections.segments[1, RUN * run : min(RUN * run + RUN, count), :4].reshape(-1, 2, 2)
        middle, half = one.mean(axis=1), 0.5 * np.hypot(*(one[:, 1] - one[:, 0]).T)
        needed = (np.hypot(*(middle - [x, z]).T) + half).max()
        assert needed <= radius <= needed * (1.0 + 1e-9)
        # The centre is the middle of a box around them.
        ends = one.reshape(-1, 2)
        assert needed <= 1.5 * np.hypot(*(ends.max(axis=0) - ends.min(axis=0)))
