"""First contact of a moving body with a resting one, through their trees (docs/method.md section 5, full width)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.box_walk import put_box, walk_rectangle, walk_to_box
from clench.kernels.runtime.compiling import kernel
from clench.kernels.trees.obb import RECTANGLE, put_slab_face

from .core_motion import CorePair, MovingCore
from .pair_queue import take_first, take_in
from .separating_planes import keep_plane, lay_plane, lies_within, passes_beside, stays_beyond
from .spatial_motion import is_spatial
from .toi_bounds import ball_entry, measure_of, walk_ball, walk_core
from .toi_pairs import sweep_pair
from .toi_work import QUEUE, BodyPair, SweepWork, is_looser, push_first, put_ball, put_item, split_pair

#: How coarsely the sweep of a node is settled, as a fraction of how thick it is, and of how wide [-].
COARSE, WIDE = 0.1, 0.02
#: No item.
NONE = -(2**40)


@kernel
def earliest_meeting(pair: BodyPair, a: int, b: int, begin: float, limit: float, work: SweepWork) -> float:
    """Return a bound on when the balls of two items come within `touch`: a `turn_measure`, for several joints a travel.

    Args:
        begin: a travel before which they do not. limit: later ones are of no interest, in the measure of the result.
    """
    chain, count = pair.chain, pair.rows
    reach = put_ball(pair.moving, a, work.moving, work.core[0])
    reach = reach + put_ball(pair.resting, b, work.resting, work.fixed[0]) + pair.touch
    if count > 1:
        return float(walk_ball(work.core, work.fixed, reach, chain, count, begin, limit, work.placed))
    square = reach * reach - (work.core[0, 1] - work.fixed[0, 1]) ** 2
    if square < 0.0:
        return math.inf
    # Mirrored where the joint turns from z to x.
    sense = 1.0 if chain[0, 0] > 0.0 else -1.0
    return ball_entry(work.core[0, 0], sense * work.core[0, 2], work.fixed[0, 0], sense * work.fixed[0, 2], square)


@kernel
def keep_earliest(
    pair: BodyPair, low: int, high: int, begin: float, floor: float, limit: float, beyond: int, work: SweepWork
) -> int:
    """Order the pairs on the stack from `low` on, the earliest on top, without those that meet later than `limit`.

    Args:
        beyond: a moving item that stays beyond the plane of `work`, or `NONE`. The rest as in `earliest_meeting`.

    Returns:
        the stack's new height.
    """
    stack, keys, kept, spatial = work.stack, work.keys, low, is_spatial(pair.chain)
    for k in range(low, high):
        a, b = stack[k, 0], stack[k, 1]
        if a == beyond and lies_within(pair.resting, b, work):
            continue
        if not spatial and passes_beside(pair.moving, a, pair.resting, b, work):
            continue
        key = max(earliest_meeting(pair, a, b, begin, limit, work), floor)
        if key >= limit and key > 0.0:
            continue
        n = kept
        while n > low and keys[n - 1] < key:
            keys[n], stack[n, 0], stack[n, 1] = keys[n - 1], stack[n - 1, 0], stack[n - 1, 1]
            n -= 1
        keys[n], stack[n, 0], stack[n, 1] = key, a, b
        work.since[kept], stack[kept, 2] = begin, 0
        kept += 1
    return kept


@kernel
def put_moving(moving: BodyArrays, a: int, T: Floats, out: Floats) -> tuple[int, float]:
    """Write the core of a moving item, of a flat node a rectangle; return its corners and its radius."""
    if a >= 0:
        return put_slab_face(moving.slab[a], T, out)
    return put_item(moving, a, T, out)


@kernel
def walk_item(pair: BodyPair, ka: int, wa: float, a: int, b: int, since: float, best: float, work: SweepWork) -> float:
    """Return a travel up to which a pair of items, of which one is a node at least, is farther apart than `touch`.

    It is infinite if it is until `best`.

    Args:
        ka, wa: corners and radius of the moving item `a`, which is in `work`. since: a travel before which it is known.
    """
    resting, touch, moving = pair.resting, pair.touch, MovingCore(work.core, ka, pair.chain, pair.rows, work.placed)
    near = touch + (COARSE * wa if a >= 0 else 0.0)
    if b < 0:
        kb, wb = put_item(resting, b, work.resting, work.fixed)
        cores = CorePair(moving, work.fixed, kb, wa + wb + touch, touch)
        if ka == RECTANGLE:
            return float(walk_rectangle(cores, work.box, near, since, best))
        return float(walk_core(cores, near, since, best))
    grown, box = put_box(resting.slab[b], work.resting, work.box), work.box
    near += COARSE * (box[4, 2] + grown) + WIDE * box[4, 0]
    w = wa + grown + touch
    return float(walk_to_box(moving, box, w, near, since, best))


@kernel
def measure(s: float, chain: Floats, count: int) -> float:
    """Return a travel as `earliest_meeting` tells it."""
    return s if count > 1 else float(measure_of(abs(chain[0, 0]) * s))


@kernel
def sweep_elements(pair: BodyPair, begin: float, best: float, listed: int, work: SweepWork) -> float:
    """Return the first contact of body `m` with body `r` before `best`, else `best`; `OVERLAP` where they overlap.

    Pairs of items are looked at in the order in which they can meet, as far as balls, and boxes after those, tell. A
    pair is left out in three cases: it cannot meet before `best`; its items pass beside each other; or a plane keeps
    them apart, as one does everywhere on a convex body. The tested planes are the plane between the elements that met
    last, and the plane by which two never met. Elements that are left are swept.

    Args:
        pair: the bodies. begin: a travel before which they do not meet, or 0. listed: see `push_first`.
        work: has `moving` (the pose relative to the last pivot) and `resting` (relative to the first).
    """
    moving, resting, chain, count, touch = pair.moving, pair.resting, pair.chain, pair.rows, pair.touch
    stack, keys, laid, met, beyond, apart = work.stack, work.keys, False, False, NONE, 0.0
    limit = measure(best, chain, count)
    queue, height = 0, push_first(moving, pair.m, resting, pair.r, listed, work.listed, stack[QUEUE:]) + QUEUE
    height = keep_earliest(pair, QUEUE, height, begin, measure(begin, chain, count), limit, NONE, work)
    while queue > 0 or height > QUEUE:
        if height > QUEUE:
            height = row = height - 1
        else:
            queue = row = take_first(work, queue)
        if keys[row] >= limit and keys[row] > 0.0:
            continue
        a, b, since = stack[row, 0], stack[row, 1], work.since[row]
        ka, wa = put_moving(moving, a, work.moving, work.core)
        within = laid and lies_within(resting, b, work)
        if within and (a != beyond or since < apart):
            beyond, apart = a if stays_beyond(ka, wa, chain, count, since, best, work) else NONE, since
        if within and a == beyond:
            continue
        if a >= 0 or b >= 0:
            if stack[row, 2] == 0:
                s = walk_item(pair, ka, wa, a, b, since, best, work)
                if s == math.inf or (within and s > since and stays_beyond(ka, wa, chain, count, s, best, work)):
                    continue
                stack[row, 2], work.since[row], keys[row] = 1, s, max(keys[row], measure(s, chain, count))
                # A pair waits while others can meet earlier.
                if row < QUEUE and queue > 0 and keys[0] < keys[row]:
                    queue = take_in(work, queue, row)
                    continue
            since, floor, low = work.since[row], keys[row], height
            known = beyond if since >= apart else NONE
            height = split_pair(moving, a, resting, b, is_looser(moving, a, resting, b), stack, low)
            height = keep_earliest(pair, low, height, since, floor, limit, known, work)
            while low == QUEUE and queue < QUEUE and height > QUEUE:
                height -= 1
                queue = take_in(work, queue, height)
            continue
        if since > 0.0 and since >= best:
            continue
        kb, wb = put_item(resting, b, work.resting, work.fixed)
        core = MovingCore(work.core, ka, chain, count, work.placed)
        found = sweep_pair(CorePair(core, work.fixed, kb, wa + wb, touch), since, best)
        if found >= best:
            if best > 0.0 and not met and keep_plane(kb, wb, touch, work):
                laid, beyond = True, NONE
            continue
        best = found
        work.pair[0], work.pair[1], work.pair[2], work.pair[3] = -1 - a, -1 - b, pair.m, pair.r
        if best < 0.0:
            return best
        limit = measure(best, chain, count)
        lay_plane(ka, wa, kb, wb, work)
        laid, met, beyond = True, True, NONE
    return best
