"""Bounds from below on when parts of a moving body can meet parts of a resting one (docs/method.md section 5)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.core_distance import crosses, separation
from clench.kernels.runtime.compiling import kernel

from .core_motion import CorePair, MovingCore, corner_motion, move_core, place_core, plane_offset
from .toi_pairs import step_to_plane

#: A ball that comes this near to another one, as a fraction of the sum of their radii, is taken to meet it [-].
NEAR = 0.125
#: Steps of a core towards another one at most, and of a plane's check.
STEPS = 8
#: Of the squares that a distance comes from [-].
ROUNDING = 1e-14
#: Steps of a walk behind several joints at most.
WALK = 24


@kernel
def turn_measure(c: float, s: float) -> float:
    """Return a measure from 0 to 4 that grows with a turn, whose cosine and sine are given up to a factor."""
    if s >= 0.0:
        return s / (c + s) if c >= 0.0 else 1.0 - c / (s - c)
    return 2.0 + s / (c + s) if c < 0.0 else 3.0 + c / (c - s)


@kernel
def measure_of(turn: float) -> float:
    """Return `turn_measure` of an angle [rad]; infinite from a whole turn on."""
    return turn_measure(math.cos(turn), math.sin(turn)) if turn < 2.0 * math.pi else math.inf


@kernel
def ball_entry(ax: float, az: float, bx: float, bz: float, square: float) -> float:
    """Return the measure of the turn at which a point about the origin comes within a distance of another, or infinity.

    Args:
        ax, az: the point, which turns from x to z. bx, bz: the other one. square: of the distance [m²].
    """
    aa, bb = ax * ax + az * az, bx * bx + bz * bz
    # A point that rounding puts just outside, and that is about to enter, would come round a whole turn later.
    if (ax - bx) ** 2 + (az - bz) ** 2 <= square + ROUNDING * (aa + bb):
        return 0.0
    size = math.sqrt(aa * bb)
    if size == 0.0:
        return math.inf
    c = (aa + bb - square) / (2.0 * size)
    if c >= 1.0:
        return math.inf
    s = math.sqrt(max(1.0 - c * c, 0.0))
    # Where the circle is entered, seen from the origin.
    ex, ez = bx * c + bz * s, bz * c - bx * s
    return turn_measure(ax * ex + az * ez, ax * ez - az * ex)


@kernel
def walk_core(pair: CorePair, near: float, begin: float, best: float) -> float:
    """Return a travel up to which two cores, that are apart until `begin`, stay farther than `pair.w` apart.

    It is infinite if they do until `best`; a pair that is near at the start never is. Every step goes to a plane
    between the two, as in `sweep_pair`, but ends where they are nearer than `near`, or after some steps.
    """
    moving, fixed, kb, w = pair.moving, pair.fixed, pair.corners, pair.w
    s, placed, ka = begin, moving.placed, moving.corners
    for step in range(STEPS):
        place_core(moving, s)
        d, nx, ny, nz, _, _, _, _, _ = separation(placed, ka, fixed, kb)
        if d - w <= near or (step == 0 and crosses(placed, ka, fixed, kb)):
            return s
        offset = plane_offset(fixed, kb, nx, ny, nz) + w
        s += step_to_plane(moving, nx, ny, nz, offset + 0.5 * near, s, best - s)
        if s >= best:
            return math.inf
    return s


@kernel
def walk_ball(
    centre: Floats, other: Floats, reach: float, chain: Floats, count: int, begin: float, limit: float, placed: Floats
) -> float:
    """Return a travel up to which a moving point, the first of `centre`, is farther than `reach` from a resting one.

    Every step is as long as the distance allows at the highest speed that the point can have.

    Args:
        begin: up to here it is known to be. limit: what comes later is of no interest, and told as infinite.
        placed: scratch space, (6, 3).
    """
    _, _, fastest, _ = corner_motion(centre, 0, chain, count, 1.0, 0.0, 0.0, 0.0)
    s = begin
    for _ in range(WALK):
        move_core(centre, 1, chain, count, s, placed)
        x, y, z = placed[0, 0] - other[0, 0], placed[0, 1] - other[0, 1], placed[0, 2] - other[0, 2]
        apart = math.sqrt(x * x + y * y + z * z) - reach
        if apart <= NEAR * reach:
            break
        if apart >= fastest * (limit - s):
            return math.inf
        s += apart / fastest
    return s


@kernel
def stays_above(moving: MovingCore, nx: float, ny: float, nz: float, offset: float, begin: float, best: float) -> bool:
    """Say whether a moving core is seen to stay beyond the plane `n·p = offset` from `begin` until `best`."""
    s = begin
    for _ in range(STEPS):
        place_core(moving, s)
        step = step_to_plane(moving, nx, ny, nz, offset, s, best - s)
        if step <= 0.0:
            return False
        if step >= best - s:
            return True
        if moving.rows == 1:
            return False
        s += step
    return False
