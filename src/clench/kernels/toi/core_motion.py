"""How the corners of a moving core move, and when one comes down to a plane (docs/method.md section 5, full width)."""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector, dot
from clench.kernels.runtime.compiling import kernel

from .spatial_motion import is_spatial, moved, moved_back, point_bounds, point_motion, total_rate


class MovingCore(NamedTuple):
    """A convex core, and the chain that moves it.

    Args:
        core: its corners relative to the last pivot [m], (4, 3). corners: how many of them count.
        chain, rows: what moves, rows (Ω, e_x, e_z), of which the last gives only its rate; where axes are not parallel
            see `spatial_motion`.
        placed: where the corners are at some travel, and scratch space, (6, 3) at least.
    """

    core: Floats
    corners: int
    chain: Floats
    rows: int
    placed: Floats


class CorePair(NamedTuple):
    """A moving core and a resting one that it may meet.

    Args:
        moving: the moving one. fixed: corners of the resting one, relative to the first pivot [m], (3, 3).
        corners: how many of these count. w: sum of both radii [m]. touch: gaps up to this touch [m].
    """

    moving: MovingCore
    fixed: Floats
    corners: int
    w: float
    touch: float


@kernel
def place_core(moving: MovingCore, s: float) -> None:
    """Write to `placed` where a core is when its chain has moved by `s`."""
    move_core(moving.core, moving.corners, moving.chain, moving.rows, s, moving.placed)


@kernel
def pair_gap(pair: CorePair, nx: float, ny: float, nz: float) -> float:
    """Return how far the moving core, where it is placed, lies beyond the resting one along n, less their radii."""
    moving = pair.moving
    return plane_gap(moving.placed, moving.corners, pair.fixed, pair.corners, nx, ny, nz) - pair.w


@kernel
def widest_motion(moving: MovingCore, s: float) -> tuple[float, float]:
    """Return bounds on speed and acceleration of all corners of a core, for any direction."""
    speed, bend = 0.0, 0.0
    for k in range(moving.corners):
        _, _, lever, bound = corner_motion(moving.core, k, moving.chain, moving.rows, 1.0, 0.0, 0.0, s)
        speed, bend = max(speed, lever), max(bend, bound)
    return speed, bend


@kernel
def move_core(core: Floats, corners: int, chain: Floats, count: int, s: float, out: Floats) -> None:
    """Write a core's corners when the chain has moved by `s`; they are given relative to its last pivot."""
    if is_spatial(chain):
        for k in range(corners):
            out[k, 0], out[k, 1], out[k, 2] = moved((core[k, 0], core[k, 1], core[k, 2]), chain, count, s)
        return
    x, z = 0.0, 0.0
    for i in range(count - 1):
        c, d = math.cos(chain[i, 0] * s), math.sin(chain[i, 0] * s)
        x += c * chain[i, 1] - d * chain[i, 2]
        z += d * chain[i, 1] + c * chain[i, 2]
    c, d = math.cos(chain[count - 1, 0] * s), math.sin(chain[count - 1, 0] * s)
    for k in range(corners):
        out[k, 0] = x + c * core[k, 0] - d * core[k, 2]
        out[k, 1] = core[k, 1]
        out[k, 2] = z + d * core[k, 0] + c * core[k, 2]


@kernel
def base_motion(
    chain: Floats, count: int, nx: float, nz: float, s: float
) -> tuple[float, float, float, float, float, float]:
    """Return the last pivot at `s`, its speed and acceleration along n, and bounds on both (of the speed: for any n).

    The axes are parallel: along them nothing moves, so only the part of n across them counts.
    """
    px, pz, slope, curvature, lever, bound = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count - 1):
        rate = chain[i, 0]
        c, d = math.cos(rate * s), math.sin(rate * s)
        x, z = c * chain[i, 1] - d * chain[i, 2], d * chain[i, 1] + c * chain[i, 2]
        px += x
        pz += z
        slope += rate * (nz * x - nx * z)
        curvature -= rate * rate * (nx * x + nz * z)
        arm = math.sqrt(x * x + z * z)
        lever += abs(rate) * arm
        bound += rate * rate * arm
    return px, pz, slope, curvature, lever, math.sqrt(nx * nx + nz * nz) * bound


@kernel
def corner_motion(
    core: Floats, k: int, chain: Floats, count: int, nx: float, ny: float, nz: float, s: float
) -> tuple[float, float, float, float]:
    """Return speed and acceleration of a corner along n at `s`, and bounds (of the speed: for any n)."""
    if is_spatial(chain):
        corner, n = (core[k, 0], core[k, 1], core[k, 2]), (nx, ny, nz)
        velocity, acceleration = point_motion(corner, chain, count, s)
        lever, bound = point_bounds(corner, chain, count)
        return dot(velocity, n), dot(acceleration, n), lever, bound
    rate = chain[count - 1, 0]
    c, d = math.cos(rate * s), math.sin(rate * s)
    x, z = c * core[k, 0] - d * core[k, 2], d * core[k, 0] + c * core[k, 2]
    _, _, slope, curvature, lever, bound = base_motion(chain, count, nx, nz, s)
    arm = math.sqrt(x * x + z * z)
    return (
        slope + rate * (nz * x - nx * z),
        curvature - rate * rate * (nx * x + nz * z),
        lever + abs(rate) * arm,
        bound + math.sqrt(nx * nx + nz * nz) * rate * rate * arm,
    )


@kernel
def turn_rate(chain: Floats, count: int) -> float:
    """Return a bound on how fast the core, or anything before it, turns."""
    if is_spatial(chain):
        return float(total_rate(chain, count))
    rate = 0.0
    for i in range(count):
        rate = max(rate, abs(chain[i, 0]))
    return rate


@kernel
def carried_back(m: Vector, chain: Floats, count: int, s: float, step: float) -> Vector:
    """Return a direction that goes along with the core as it was a step before `s + step`."""
    if is_spatial(chain):
        return moved_back(m, chain, count, s, step)
    c, d = math.cos(chain[count - 1, 0] * step), math.sin(chain[count - 1, 0] * step)
    return c * m[0] + d * m[2], m[1], c * m[2] - d * m[0]


@kernel
def plane_offset(core: Floats, corners: int, nx: float, ny: float, nz: float) -> float:
    """Return the largest coordinate of a core along n."""
    top: float = nx * core[0, 0] + ny * core[0, 1] + nz * core[0, 2]
    for k in range(1, corners):
        top = max(top, nx * core[k, 0] + ny * core[k, 1] + nz * core[k, 2])
    return top


@kernel
def plane_gap(a: Floats, ka: int, b: Floats, kb: int, nx: float, ny: float, nz: float) -> float:
    """Return how far core `a` lies beyond core `b` along n."""
    return -plane_offset(a, ka, -nx, -ny, -nz) - plane_offset(b, kb, nx, ny, nz)


@kernel
def turn_to_plane(gap: float, slope: float, curvature: float, best: float) -> float:
    """Return the next turn at which a point comes down to a plane, for a gap `K + A cos + B sin` >= 0 now.

    Args:
        gap: now. slope: B. curvature: -A. best: turns from here on are of no interest.
    """
    a = -curvature
    size = math.sqrt(a * a + slope * slope)
    # The gap stays above gap + slope s - size s²/2.
    if gap + best * (slope - 0.5 * size * best) > 0.0:
        return best
    constant = gap - a
    if constant >= size:
        return best
    turn = math.atan2(slope, a) + math.acos(min(max(-constant / size, -1.0), 1.0))
    return max(turn, 0.0)
