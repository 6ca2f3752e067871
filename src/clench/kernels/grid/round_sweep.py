"""First contact of a moving capsule or sphere with an object: by its grid far away, in windows near by (section 5)."""

from __future__ import annotations

import math

from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.toi_bodies import sweep_elements
from clench.kernels.toi.toi_work import BodyPair, SweepWork, item_of, put_item

from .grid_bound import square_bound
from .round_motion import AT, HALF_TURN, PLANE, RoundMotion, begin_window, motion_of_core, put_corners
from .round_window import sweep_window

#: A core whose gap is below this share of a cube's edge is near [-].
NEAR = 0.3
#: The first window is as long as this many gaps, and this share of a cube's edge, at the highest speed [-].
GAPS, MORE = 2.0, 0.4
#: Every window is longer than the one before by this factor, up to so much in all [-].
LONGER, LONGEST = 2.0, 64.0
#: Points of a core at which the grid is asked lie no farther apart than this many radii, or edges of a cube [-].
APART = 0.75
#: There are at most so many steps between them.
SAMPLES = 16


@kernel
def has_grid(pair: BodyPair) -> bool:
    """Say whether a body of one segment or point moves towards a body that has a grid."""
    moving, root = pair.moving, pair.moving.root[pair.m]
    if pair.resting.grid.square.shape[0] == 0 or root < 0 or pair.resting.root[pair.r] < 0:
        return False
    item = item_of(moving, root)
    return bool(item < 0 and moving.corners[-1 - item] < 3)


@kernel
def sweep_round(pair: BodyPair, begin: float, best: float, work: SweepWork) -> float:
    """Return what `sweep_from` returns where `has_grid`."""
    moving = pair.moving
    item = item_of(moving, moving.root[pair.m])
    corners, radius = put_item(moving, item, work.moving, work.core)
    motion = motion_of_core(pair, corners, radius, work)
    edge, s, longer = pair.resting.grid.place[3], begin, 1.0
    work.pair[0], work.pair[2], work.pair[3] = -1 - item, pair.m, pair.r
    work.round[PLANE, 0] = work.round[PLANE, 1] = work.round[PLANE, 2] = 0.0
    while s < best or s == 0.0:
        put_corners(pair, motion, s, work)
        gap = max(gap_bound(pair, motion, work), 0.0)
        if gap > 0.0 and gap >= motion.fastest * (best - s):
            return best
        if gap > NEAR * edge:
            s += gap / motion.fastest
            continue
        end = best
        if motion.fastest > 0.0:
            end = min(end, s + longer * (GAPS * gap + MORE * edge) / motion.fastest)
        if motion.turn > 0.0:
            end = min(end, s + HALF_TURN / motion.turn)
        begin_window(pair, motion, s, end, work)
        found = sweep_window(pair, motion, s, end, work)
        if found < 0.0:
            return found if s == 0.0 else sweep_elements(pair, 0.0, best, -1, work)
        if found < end or end >= best:
            return found
        s, longer = end, min(LONGER * longer, LONGEST)
    return best


@kernel
def gap_bound(pair: BodyPair, motion: RoundMotion, work: SweepWork) -> float:
    """Return a bound from below on the gap between the core, where it is put, and the object, less the tolerance."""
    resting, rows = pair.resting, work.round
    at = rows[AT, 0], rows[AT, 1], rows[AT, 2]
    least = square_bound(resting, at, work.stack)
    if motion.corners > 1:
        u = rows[AT + 1, 0] - at[0], rows[AT + 1, 1] - at[1], rows[AT + 1, 2] - at[2]
        size = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        steps = min(int(size / (APART * max(motion.radius, resting.grid.place[3]))) + 1, SAMPLES)
        part = (size / steps) ** 2
        before = least
        for k in range(1, steps + 1):
            t = k / steps
            square = square_bound(resting, (at[0] + t * u[0], at[1] + t * u[1], at[2] + t * u[2]), work.stack)
            least = min(least, least_between(before, square, part))
            before = square
    return (math.sqrt(least) if least > 0.0 else 0.0) - motion.radius - pair.touch


@kernel
def least_between(a: float, b: float, part: float) -> float:
    """Return a bound from below on squared distances between two points, from those at the points.

    Args:
        a, b: bounds at the points. part: squared distance of the points [m²].
    """
    rest = part - abs(b - a)
    return min(a, b) if rest <= 0.0 else min(a, b) - rest * rest / (4.0 * part)
