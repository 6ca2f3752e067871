"""First contact of a moving body with a resting one, through their trees (METHOD.md section 5, exact width)."""

from __future__ import annotations

import math

from .bodies import BodyArrays
from .closest import separation
from .compiling import inner_kernel
from .core_motion import plane_offset
from .earliest import ball_entry, core_misses, measure_of, stays_above, walk_ball
from .layout import Floats
from .sweep_pairs import sweep_pair
from .sweeping import SweepWork, put_ball, put_item, split_pair

#: How coarsely the sweep of an element against a node's ball is settled, as a fraction of the ball's radius [-].
COARSE = 0.25


@inner_kernel
def earliest_meeting(
    moving: BodyArrays,
    a: int,
    resting: BodyArrays,
    b: int,
    chain: Floats,
    count: int,
    touch: float,
    limit: float,
    work: SweepWork,
) -> float:
    """Return a bound on when the balls of two items come within `touch`: a `turn_measure`, for several joints a travel.

    Args:
        limit: later ones are of no interest, in the same measure. The rest as in `sweep_body`.
    """
    reach = put_ball(moving, a, work.moving, work.core[0]) + put_ball(resting, b, work.resting, work.fixed[0]) + touch
    if count > 1:
        return float(walk_ball(work.core, work.fixed, reach, chain, count, limit, work.placed))
    square = reach * reach - (work.core[0, 1] - work.fixed[0, 1]) ** 2
    if square < 0.0:
        return math.inf
    # Mirrored where the joint turns from z to x.
    sense = 1.0 if chain[0, 0] > 0.0 else -1.0
    return ball_entry(work.core[0, 0], sense * work.core[0, 2], work.fixed[0, 0], sense * work.fixed[0, 2], square)


@inner_kernel
def keep_earliest(
    moving: BodyArrays,
    resting: BodyArrays,
    low: int,
    high: int,
    chain: Floats,
    count: int,
    touch: float,
    limit: float,
    work: SweepWork,
) -> int:
    """Order the pairs on the stack from `low` on, the earliest on top, without those that meet later than `limit`.

    Returns:
        the stack's new height.
    """
    stack, keys, kept = work.stack, work.keys, low
    for k in range(low, high):
        a, b = stack[k, 0], stack[k, 1]
        key = earliest_meeting(moving, a, resting, b, chain, count, touch, limit, work)
        if key >= limit and key > 0.0:
            continue
        n = kept
        while n > low and keys[n - 1] < key:
            keys[n], stack[n, 0], stack[n, 1] = keys[n - 1], stack[n - 1, 0], stack[n - 1, 1]
            n -= 1
        keys[n], stack[n, 0], stack[n, 1] = key, a, b
        kept += 1
    return kept


@inner_kernel
def part_misses(
    moving: BodyArrays,
    a: int,
    resting: BodyArrays,
    b: int,
    ka: int,
    kb: int,
    wa: float,
    wb: float,
    chain: Floats,
    count: int,
    touch: float,
    best: float,
    work: SweepWork,
) -> bool:
    """Say whether an element of one body is seen to miss the other item's ball before `best`.

    Args:
        a, b: at least one of them an element. ka, kb, wa, wb: their corners and radii, see `put_item`.
    """
    if count > 1:
        if a < 0 and b < 0:
            return False
        near = COARSE * ((wa if a >= 0 else 0.0) + (wb if b >= 0 else 0.0))
        return sweep_pair(work.core, ka, work.fixed, kb, wa + wb, chain, count, near, best, True, work.placed) >= best
    sense, turn = (1.0 if chain[0, 0] > 0.0 else -1.0), abs(chain[0, 0]) * best
    if a < 0:
        # Seen from the moving element, the other body turns backwards.
        reach = wa + put_ball(resting, b, work.resting, work.placed[0]) + touch
        return core_misses(work.placed[0], work.core, ka, reach, -sense, turn)
    return core_misses(work.core[0], work.fixed, kb, wa + wb + touch, sense, turn)


@inner_kernel
def lay_plane(ka: int, wa: float, kb: int, wb: float, work: SweepWork) -> None:
    """Write the plane half way between two elements that have just met; `work` has them placed there."""
    d, nx, ny, nz, _, _, _, _, _ = separation(work.placed, ka, work.fixed, kb)
    plane = work.plane
    plane[0], plane[1], plane[2] = nx, ny, nz
    plane[3] = plane_offset(work.fixed, kb, nx, ny, nz) + wb + 0.5 * (d - wa - wb)


@inner_kernel
def keep_plane(kb: int, wb: float, touch: float, work: SweepWork) -> bool:
    """Keep the plane by which `sweep_pair` saw that two elements never meet; say whether there is one.

    It lies just off the resting element. The other one stayed half a touch tolerance away from that, or half of the
    gap where it began closer.
    """
    nx, ny, nz, plane = work.placed[5, 0], work.placed[5, 1], work.placed[5, 2], work.plane
    if nx == 0.0 and ny == 0.0 and nz == 0.0:
        return False
    plane[0], plane[1], plane[2] = nx, ny, nz
    plane[3] = plane_offset(work.fixed, kb, nx, ny, nz) + wb + 0.25 * touch
    return True


@inner_kernel
def plane_parts(
    ka: int, wa: float, kb: int, wb: float, chain: Floats, count: int, best: float, work: SweepWork
) -> bool:
    """Say whether the plane of `work` keeps the two items there apart until `best`."""
    nx, ny, nz, offset = work.plane[0], work.plane[1], work.plane[2], work.plane[3]
    if plane_offset(work.fixed, kb, nx, ny, nz) + wb > offset:
        return False
    return stays_above(work.core, work.placed, ka, chain, count, nx, ny, nz, offset + wa, best)


@inner_kernel
def sweep_body(
    moving: BodyArrays,
    m: int,
    resting: BodyArrays,
    r: int,
    chain: Floats,
    count: int,
    touch: float,
    best: float,
    work: SweepWork,
) -> float:
    """Return the first contact of body `m` with body `r` before `best`, else `best`; `OVERLAP` where they overlap.

    Pairs of items are looked at in the order in which their balls can meet. A pair is left out when they cannot before
    `best`; or a plane keeps them apart, as one does everywhere on a convex body: that between the elements that met
    last, before that one by which two never met; or an element cannot meet the other item's ball.

    Args:
        chain, count: what moves, and its rows, see `sweep_pair`. touch: gaps up to this touch [m].
        work: has `moving` (the pose relative to the last pivot) and `resting` (relative to the first).
    """
    stack, laid, met = work.stack, False, False
    stack[0, 0], stack[0, 1] = moving.root[m], resting.root[r]
    limit = best if count > 1 else measure_of(abs(chain[0, 0]) * best)
    waiting = 1 if stack[0, 0] >= 0 and stack[0, 1] >= 0 else 0
    waiting = keep_earliest(moving, resting, 0, waiting, chain, count, touch, limit, work)
    while waiting > 0:
        waiting -= 1
        if work.keys[waiting] >= limit and work.keys[waiting] > 0.0:
            continue
        a, b = stack[waiting, 0], stack[waiting, 1]
        ka, wa = put_item(moving, a, work.moving, work.core)
        kb, wb = put_item(resting, b, work.resting, work.fixed)
        if laid and plane_parts(ka, wa, kb, wb, chain, count, best, work):
            continue
        if (a < 0 or b < 0) and part_misses(moving, a, resting, b, ka, kb, wa, wb, chain, count, touch, best, work):
            continue
        if a >= 0 or b >= 0:
            height = split_pair(moving, a, resting, b, stack, waiting)
            waiting = keep_earliest(moving, resting, waiting, height, chain, count, touch, limit, work)
            continue
        found = sweep_pair(work.core, ka, work.fixed, kb, wa + wb, chain, count, touch, best, False, work.placed)
        if found >= best:
            if not met and keep_plane(kb, wb, touch, work):
                laid = True
            continue
        best = found
        work.pair[0], work.pair[1], work.pair[2], work.pair[3] = -1 - a, -1 - b, m, r
        if best < 0.0:
            return best
        limit = best if count > 1 else measure_of(abs(chain[0, 0]) * best)
        lay_plane(ka, wa, kb, wb, work)
        laid = met = True
    return best
