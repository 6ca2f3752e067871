"""The smallest gap between posed bodies and a resting one."""

from __future__ import annotations

import numpy as np

from .bodies import BodyArrays
from .compiling import kernel
from .layout import Floats, Ints
from .sweeping import body_gap, make_sweep_work


@kernel
def smallest_gap(
    links: BodyArrays, wanted: Ints, poses: Floats, target: BodyArrays, T_palm_object: Floats
) -> tuple[float, int]:
    """Return the smallest gap between some bodies and the first one of another set, and which body has it.

    Args:
        links: the bodies. wanted: numbers of those that count, (W,). poses: of every body, (B, 3, 4).
        target: the other set. T_palm_object: its pose, (3, 4).

    Returns:
        the gap [m] and the body's number; infinite and -1 when there is nothing to measure. Bodies that cross each
        other are not noticed here (see `clench.kernels.closest.separation`).
    """
    work = make_sweep_work(np.empty((1, 3)), 0)
    work.resting[:] = T_palm_object
    best, nearest = np.inf, -1
    for m in wanted:
        work.moving[:] = poses[m]
        gap = body_gap(links, m, target, 0, best, work)
        if gap < best:
            best, nearest = gap, m
    return best, nearest
