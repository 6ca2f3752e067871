"""The smallest gap between posed bodies."""

from __future__ import annotations

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.runtime.compiling import entry_kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.toi_work import body_gap, make_sweep_work, put_core

from .bodies import BodyArrays
from .core_distance import separation


@entry_kernel(allocates=True)
def smallest_gap(
    links: BodyArrays, which: Ints, poses: Floats, target: BodyArrays, T_palm_object: Floats
) -> tuple[float, int]:
    """Return the smallest gap between some bodies and the first one of another set, and which body has it.

    Args:
        links: the bodies. which: numbers of those that count, (W,). poses: of every body, (B, 3, 4).
        target: the other set. T_palm_object: its pose, (3, 4).

    Returns:
        the gap [m] and the body's number; infinite and -1 when there is nothing to measure. Bodies that cross each
        other are not noticed here (see `clench.kernels.geometry.core_distance.separation`).
    """
    work = make_sweep_work(0, 0)
    copy_pose(T_palm_object, work.resting)
    best, nearest = np.inf, -1
    for m in which:
        copy_pose(poses[m], work.moving)
        gap = body_gap(links, m, target, 0, -1, best, 1.0, work)
        if gap < best:
            best, nearest = gap, m
    return best, nearest


@entry_kernel(allocates=True)
def link_gap(links: BodyArrays, m: int, r: int, poses: Floats, bound: float, slack: float, out: Floats) -> float:
    """Return the gap of two links if it is below `bound`, else `bound`; where, and the direction to `m`, go to `out`.

    Args:
        links: every link in its frame. m, r: which. poses: `T_palm_link` of every link, (L, 3, 4).
        slack: see `body_gap`. out: (6,).
    """
    sweep = make_sweep_work(0, 0)
    copy_pose(poses[m], sweep.moving)
    copy_pose(poses[r], sweep.resting)
    gap = body_gap(links, m, links, r, -1, bound, slack, sweep)
    if gap < bound:
        i, k = sweep.pair[0], sweep.pair[1]
        put_core(links, i, sweep.moving, sweep.core)
        put_core(links, k, sweep.resting, sweep.fixed)
        _, nx, ny, nz, _, _, x, y, z = separation(sweep.core, links.corners[i], sweep.fixed, links.corners[k])
        w = links.radius[k]
        out[0], out[1], out[2], out[3], out[4], out[5] = x + w * nx, y + w * ny, z + w * nz, nx, ny, nz
    return gap
