"""First contact of a moving body with a resting one: far away by hulls, near by elements (docs/method.md section 5)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.grid.grid_travel import clear_by_grid
from clench.kernels.grid.round_sweep import has_grid, sweep_round
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.spatial_motion import axis_of, is_spatial, turned_about, way_of
from clench.kernels.toi.toi_bodies import NONE, keep_earliest, measure, sweep_elements
from clench.kernels.toi.toi_work import BodyPair, SweepWork, item_of, push_roots

from .hull_meeting import put_touching
from .hull_sweep import NEAR, clear_travel
from .listed_sweep import sweep_listed
from .near_elements import list_near

#: The elements sweep so far at first from where hulls are near, as a multiple of `NEAR`; each time farther by `LONGER`.
FIRST, LONGER = 8.0, 16.0
#: No travel.
UNSURE = -3.0


@kernel
def sweep_body(pair: BodyPair, best: float, work: SweepWork) -> float:
    """Return the first contact of body `m` with body `r` before `best`, else `best`; `OVERLAP` where they overlap.

    Args:
        pair: the bodies.
        work: has `moving` (the pose relative to the last pivot) and `resting` (relative to the first).
    """
    begin = clear_by_grid(pair, best, work)
    return best if begin == math.inf else float(sweep_from(pair, begin, best, work))


@kernel
def sweep_from(pair: BodyPair, begin: float, best: float, work: SweepWork) -> float:
    """Return what `sweep_body` returns, from a travel on before which bodies do not meet.

    Hulls take the place of elements, which a body of one element would gain nothing from.

    Args:
        pair, work: as in `sweep_body`. begin: the travel, below `best`, or 0: then bodies may overlap at first.
    """
    if has_grid(pair):
        return sweep_round(pair, begin, best, work)
    moving, root = pair.moving, pair.moving.root[pair.m]
    if root >= 0 and item_of(moving, root) < 0:
        return sweep_elements(pair, begin, best, -1, work)
    if never_meet(pair, best, work):
        return best
    copy_pose(work.moving, work.begun)
    found = sweep_stepwise(pair, begin, best, work)
    copy_pose(work.begun, work.moving)
    if found == UNSURE:
        return sweep_elements(pair, 0.0, best, -1, work)
    return found


@kernel
def sweep_stepwise(pair: BodyPair, begin: float, best: float, work: SweepWork) -> float:
    """Return what `sweep_from` returns, or `UNSURE` where elements seem to overlap on the way.

    Args:
        work: `begun` has the pose of the moving body. `moving` is overwritten.
    """
    chain, count, touch = pair.chain, pair.rows, pair.touch
    onward, done, length = work.turned if is_spatial(chain) else work.level, begin, FIRST * NEAR
    ahead = BodyPair(pair.moving, pair.m, pair.resting, pair.r, onward, count, touch)
    while True:
        put_onward(chain, count, done, work, onward)
        clear = clear_travel(ahead, best - done, work)
        if clear == math.inf:
            return best
        if clear > 0.0:
            if work.near[1] >= 0 and put_touching(ahead, clear, work):
                return min(done + clear, best)
            done += clear
            put_onward(chain, count, done, work, onward)
        span = min(length, best - done)
        listed = list_near(ahead, span, work)
        if listed < 0:
            span = best - done
        found = sweep_listed(ahead, span, listed, work)
        if found < 0.0:
            return found if done == 0.0 else UNSURE
        if found < span:
            return min(done + found, best)
        done, length = done + span, LONGER * length
        if done >= best:
            return best


@kernel
def never_meet(pair: BodyPair, best: float, work: SweepWork) -> bool:
    """Say whether the balls around two bodies, or their extents along a common axis, tell that they never meet."""
    height = push_roots(pair.moving, pair.m, pair.resting, pair.r, work.stack)
    limit = measure(best, pair.chain, pair.rows)
    return keep_earliest(pair, 0, height, 0.0, 0.0, limit, NONE, work) == 0


@kernel
def put_onward(chain: Floats, count: int, s: float, work: SweepWork, out: Floats) -> None:
    """Write the chain as it is when it has moved by `s`, and the pose of what it moves to `work.moving`."""
    T, moving = work.begun, work.moving
    for c in range(4):
        p = (T[0, c], T[1, c], T[2, c])
        moving[0, c], moving[1, c], moving[2, c] = turned_by(p, chain, count, s)
    for i in range(count):
        out[i, 0] = chain[i, 0]
        if is_spatial(chain):
            out[i, 1], out[i, 2], out[i, 3] = turned_by(axis_of(chain, i), chain, i, s)
            out[i, 4], out[i, 5], out[i, 6] = turned_by(way_of(chain, i), chain, i + 1, s)
        else:
            out[i, 1], _, out[i, 2] = turned_by((chain[i, 1], 0.0, chain[i, 2]), chain, i + 1, s)


@kernel
def turned_by(p: Vector, chain: Floats, rows: int, s: float) -> Vector:
    """Return a vector as the first rows of a chain turn it."""
    if is_spatial(chain):
        for k in range(rows):
            i = rows - 1 - k
            p = turned_about(p, axis_of(chain, i), chain[i, 0] * s)
        return p
    c, d = math.cos(chain[rows - 1, 0] * s), math.sin(chain[rows - 1, 0] * s)
    return c * p[0] - d * p[2], p[1], d * p[0] + c * p[2]
