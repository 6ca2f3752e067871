"""Heights over a plane: their values at both ends of a window and a bound on their bend tell that none is below 0."""

import numpy as np
import pytest

from clench.kernels.toi import pair_planes
from kernels.kernel_entries import entry

stays_above, share_above = entry(pair_planes.stays_above), entry(pair_planes.share_above)
SHARES = np.linspace(0.0, 1.0, 2001)


@pytest.mark.parametrize("seed", range(20))
def test_heights_stay_above_as_far_as_the_lowest_curve_does(seed):
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(0.0, 1.0, 2)
    for bend in rng.uniform(0.0, 12.0, 20):
        lowest = ((1.0 - SHARES) * start + SHARES * end - 0.5 * bend * SHARES * (1.0 - SHARES)).min()
        if abs(lowest) > 1e-5:
            assert stays_above(start, end, bend) == (lowest > 0.0)


@pytest.mark.parametrize(("start", "end"), [(-1e-9, 1.0), (1.0, -1e-9)])
def test_a_height_below_at_an_end_is_below(start, end):
    assert not stays_above(start, end, 0.0)


@pytest.mark.parametrize(("h", "speed", "bend"), [(1.0, 0.0, 0.0), (0.5, -1.0, 0.0), (0.2, 0.3, 4.0), (0.2, -0.7, 4.0)])
def test_the_share_ends_where_the_lowest_curve_is_0(h, speed, bend):
    share = share_above(h, speed, bend)
    curve = h + speed * SHARES - 0.5 * bend * SHARES**2
    below = SHARES[curve < 0.0]
    assert share == pytest.approx(below[0] if len(below) else 1.0, abs=1e-3)
