"""First contact of a moving body with listed elements of a resting one, on a short way (docs/method.md section 5).

A plane just over each listed element tells which moving elements can come down to it: those that are low over the plane
where the way begins, or where it ends. Only these are swept.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import back
from clench.kernels.toi.core_motion import CorePair, MovingCore
from clench.kernels.toi.separating_planes import keep_plane, lay_plane, lies_within, stays_beyond
from clench.kernels.toi.toi_bodies import sweep_elements
from clench.kernels.toi.toi_pairs import sweep_pair
from clench.kernels.toi.toi_work import BodyPair, SweepWork, put_item
from clench.kernels.trees.obb import slab_half

from .enclosing_hulls import lowest_point
from .hull_motion import HullMotion, bend_along, lowest_between, motion_of_hull
from .hull_window import CORNERS, END, LISTED, NOW, PLANES, SIMPLEX, put_element

#: Pairs that are swept one by one at most. They wait in the rows of the stack from the last ones on.
MOST = 256


class Fall(NamedTuple):
    """The plane over a resting element, seen from a moving body.

    Args:
        now, then: normal of the plane in the moving body's frame where the window begins, and where it ends.
        begin, end: height of the frame's origin over the plane at these places [m].
        sag: how far points may be below the chord of their heights, see `lowest_between` [m].
    """

    now: Vector
    then: Vector
    begin: float
    end: float
    sag: float


@kernel
def sweep_listed(pair: BodyPair, best: float, listed: int, sweep: SweepWork) -> float:
    """Return what `sweep_elements` does for a window that `list_near` has listed elements for; `best` is its end.

    A pair is left out if the plane between the elements that met last, or the plane by which two never met, keeps it
    apart.

    Args:
        listed: number of listed elements; -1: any can be met.
    """
    found = list_pairs(pair, best, listed, sweep) if listed >= 0 else -1
    if found < 0:
        return sweep_elements(pair, 0.0, best, listed, sweep)
    moving, resting, last, laid, met = pair.moving, pair.resting, sweep.stack.shape[0] - 1, False, False
    for k in range(found):
        a, b = sweep.stack[last - k, 0], sweep.stack[last - k, 1]
        ka, wa = put_item(moving, -1 - a, sweep.moving, sweep.core)
        within = laid and lies_within(resting, -1 - b, sweep)
        if within and stays_beyond(ka, wa, pair.chain, pair.rows, 0.0, best, sweep):
            continue
        kb, wb = put_item(resting, -1 - b, sweep.resting, sweep.fixed)
        core = MovingCore(sweep.core, ka, pair.chain, pair.rows, sweep.placed)
        s = sweep_pair(CorePair(core, sweep.fixed, kb, wa + wb, pair.touch), 0.0, best)
        if s < best:
            best, laid, met = s, True, True
            sweep.pair[0], sweep.pair[1], sweep.pair[2], sweep.pair[3] = a, b, pair.m, pair.r
            if best < 0.0:
                return best
            lay_plane(ka, wa, kb, wb, sweep)
        elif best > 0.0 and not met and keep_plane(kb, wb, pair.touch, sweep):
            laid = True
    return best


@kernel
def list_pairs(pair: BodyPair, end: float, listed: int, sweep: SweepWork) -> int:
    """List the pairs of elements that may meet in a window at the end of the stack; return how many, -1: too many."""
    found, motion = 0, widest_motion_of(pair, sweep)
    for k in range(listed):
        found = list_pairs_with(pair, motion, end, k, found, sweep)
        if found < 0:
            return -1
    return found


@kernel
def list_pairs_with(pair: BodyPair, motion: HullMotion, end: float, k: int, found: int, sweep: SweepWork) -> int:
    """List the moving elements that may meet one listed element; see `list_pairs`."""
    moving, resting, window, stack, e = pair.moving, pair.resting, sweep.hull, sweep.stack, sweep.listed[k]
    fall, at = fall_on(pair, motion, k, end, sweep), middle_of(resting.ball[e], window)
    reach = resting.ball[e, 3] + pair.touch + motion.speed * end
    stack[0, 0], waiting = moving.root[pair.m], 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting, 0]
        if not is_within(moving.node[node], at, reach) or not box_falls(moving.slab[node], fall):
            continue
        if moving.count[node] == 0:
            stack[waiting, 0], stack[waiting + 1, 0] = moving.right[node], node + 1
            waiting += 2
            continue
        for a in range(moving.first[node], moving.first[node] + moving.count[node]):
            if not is_within(moving.ball[a], at, reach):
                continue
            left = height_left(moving, a, fall)
            if left <= 0.0:
                if found == MOST:
                    return -1
                put_pair(a, e, left, found, sweep)
                found += 1
    return found


@kernel
def put_pair(a: int, e: int, left: float, found: int, sweep: SweepWork) -> None:
    """Put a pair of elements behind those found; the one that comes down lowest stays the first.

    Args:
        a, e: the moving element and the resting one. left: see `height_left`.
    """
    stack, lowest, last = sweep.stack, sweep.keys, sweep.stack.shape[0] - 1
    stack[last - found, 0], stack[last - found, 1] = a, e
    if found == 0 or left < lowest[last]:
        stack[last - found, 0], stack[last - found, 1] = stack[last, 0], stack[last, 1]
        stack[last, 0], stack[last, 1], lowest[last] = a, e, left


@kernel
def widest_motion_of(pair: BodyPair, sweep: SweepWork) -> HullMotion:
    """Return bounds on the motion of the points of all hulls of a moving body."""
    body, m = pair.moving.hulls.body, pair.m
    widest = motion_of_hull(pair.moving, body[m], pair.chain, pair.rows, sweep)
    for hull in range(body[m] + 1, body[m + 1]):
        other = motion_of_hull(pair.moving, hull, pair.chain, pair.rows, sweep)
        speed, bend = max(widest.speed, other.speed), max(widest.bend, other.bend)
        widest = HullMotion(hull, other.radius, speed, bend, other.x, other.y, other.z)
    return widest


@kernel
def fall_on(pair: BodyPair, motion: HullMotion, k: int, end: float, sweep: SweepWork) -> Fall:
    """Return how things fall on the plane over a listed element."""
    window, e = sweep.hull, sweep.listed[k]
    n = (window[LISTED + k, 0], window[LISTED + k, 1], window[LISTED + k, 2])
    count = put_element(pair.resting, e, window)
    low, _ = lowest_point(window[CORNERS:PLANES], 0, count, -n[0], -n[1], -n[2])
    top = pair.resting.radius[e] + pair.touch - low
    now, then = window[NOW:END], window[END:SIMPLEX]
    return Fall(
        in_link(now, n),
        in_link(then, n),
        n[0] * now[0, 3] + n[1] * now[1, 3] + n[2] * now[2, 3] - top,
        n[0] * then[0, 3] + n[1] * then[1, 3] + n[2] * then[2, 3] - top,
        0.125 * bend_along(motion, n) * end * end,
    )


@kernel
def middle_of(ball: Floats, window: Floats) -> Vector:
    """Return the middle of a resting ball in the moving body's frame where the window begins."""
    x, y, z = back(window[NOW:END], ball[0], ball[1], ball[2])
    return x, y, z


@kernel
def in_link(T: Floats, n: Vector) -> Vector:
    """Return a vector of the resting body's frame in the moving one's, whose pose is `T`."""
    return (
        T[0, 0] * n[0] + T[1, 0] * n[1] + T[2, 0] * n[2],
        T[0, 1] * n[0] + T[1, 1] * n[1] + T[2, 1] * n[2],
        T[0, 2] * n[0] + T[1, 2] * n[1] + T[2, 2] * n[2],
    )


@kernel
def is_within(ball: Floats, at: Vector, reach: float) -> bool:
    """Say whether a ball is no farther from a point than `reach`."""
    x, y, z = ball[0] - at[0], ball[1] - at[1], ball[2] - at[2]
    return bool(x * x + y * y + z * z <= (reach + ball[3]) ** 2)


@kernel
def box_falls(slab: Any, fall: Fall) -> bool:
    """Say whether a moving box may come down to the plane."""
    u, v = fall.now, fall.then
    start = fall.begin + (u[0] * slab[0] + u[1] * slab[1] + u[2] * slab[2]) - slab_half(slab, u[0], u[1], u[2])
    later = fall.end + (v[0] * slab[0] + v[1] * slab[1] + v[2] * slab[2]) - slab_half(slab, v[0], v[1], v[2])
    return bool(lowest_between(start, later, fall.sag) <= slab[12])


@kernel
def height_left(moving: BodyArrays, a: int, fall: Fall) -> float:
    """Return a bound on how far over the plane a moving element stays; it may come down if that is not positive [m]."""
    u, v, start, later = fall.now, fall.then, math.inf, math.inf
    for k in range(moving.corners[a]):
        p = moving.vertices[moving.elements[a, k]]
        start = min(start, u[0] * p[0] + u[1] * p[1] + u[2] * p[2])
        later = min(later, v[0] * p[0] + v[1] * p[1] + v[2] * p[2])
    return float(lowest_between(fall.begin + start, fall.end + later, fall.sag) - moving.radius[a])
