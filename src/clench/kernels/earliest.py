"""Bounds from below on when parts of a moving body can meet parts of a resting one (METHOD.md section 5)."""

from __future__ import annotations

import math

from .closest import above_face, edge_count, face_normal
from .compiling import inner_kernel
from .core_motion import corner_motion, move_core
from .layout import Floats
from .sweep_pairs import step_to_plane

#: A ball that comes this near to a core, as a fraction of the sum of their radii, is taken to meet it [-].
NEAR = 0.125
#: Steps of a ball along its arc towards a core at most, and of a plane's check.
STEPS = 8
#: Of the squares that a distance comes from [-].
ROUNDING = 1e-14
#: Steps of a walk behind several joints at most.
WALK = 24


@inner_kernel
def turn_measure(c: float, s: float) -> float:
    """Return a measure from 0 to 4 that grows with a turn, whose cosine and sine are given up to a factor."""
    if s >= 0.0:
        return s / (c + s) if c >= 0.0 else 1.0 - c / (s - c)
    return 2.0 + s / (c + s) if c < 0.0 else 3.0 + c / (c - s)


@inner_kernel
def measure_of(turn: float) -> float:
    """Return `turn_measure` of an angle [rad]; infinite from a whole turn on."""
    return turn_measure(math.cos(turn), math.sin(turn)) if turn < 2.0 * math.pi else math.inf


@inner_kernel
def ball_entry(ax: float, az: float, bx: float, bz: float, square: float) -> float:
    """Return the measure of the turn at which a point about the origin comes within a distance of another, or infinity.

    Args:
        ax, az: the point, which turns from x to z. bx, bz: the other one. square: of the distance [m²].
    """
    aa, bb = ax * ax + az * az, bx * bx + bz * bz
    # What rounding puts just outside, and is about to enter, would come round a whole turn later.
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


@inner_kernel
def point_to_core(x: float, y: float, z: float, core: Floats, corners: int) -> float:
    """Return the distance from a point to a core: to its edges, and to its face where the point lies above it.

    The edges alone hold for a triangle without area.
    """
    least = math.inf
    for k in range(edge_count(corners)):
        m = (k + 1) % corners
        qx, qy, qz = core[k, 0], core[k, 1], core[k, 2]
        ux, uy, uz = core[m, 0] - qx, core[m, 1] - qy, core[m, 2] - qz
        square = ux * ux + uy * uy + uz * uz
        t = ((x - qx) * ux + (y - qy) * uy + (z - qz) * uz) / square if square > 0.0 else 0.0
        t = min(max(t, 0.0), 1.0)
        least = min(least, (x - qx - t * ux) ** 2 + (y - qy - t * uy) ** 2 + (z - qz - t * uz) ** 2)
    if corners == 3:
        nx, ny, nz, size = face_normal(core)
        if size > 0.0 and above_face(core, nx, ny, nz, x, y, z):
            height = nx * (x - core[0, 0]) + ny * (y - core[0, 1]) + nz * (z - core[0, 2])
            least = min(least, height * height)
    return math.sqrt(least)


@inner_kernel
def core_misses(p: Floats, core: Floats, corners: int, reach: float, sense: float, turn: float) -> bool:
    """Say whether a point that turns about the y axis is seen to stay farther than `reach` from a core.

    The point goes along its arc by as much as it is away from the core, some times over.

    Args:
        p: the point. core, corners: at rest. sense: 1 where the point turns from x to z, else -1. turn: how far [rad].
    """
    far = math.hypot(p[0], p[2])
    x, y, z, at = p[0], p[1], p[2], 0.0
    for _ in range(STEPS):
        gap = point_to_core(x, y, z, core, corners) - reach
        if gap <= NEAR * reach:
            return False
        if gap >= (turn - at) * far:
            return True
        at += gap / far
        c, s = math.cos(at), sense * math.sin(at)
        x, z = c * p[0] - s * p[2], c * p[2] + s * p[0]
    return False


@inner_kernel
def walk_ball(
    centre: Floats, other: Floats, reach: float, chain: Floats, count: int, limit: float, placed: Floats
) -> float:
    """Return a travel up to which a moving point, the first of `centre`, is farther than `reach` from a resting one.

    Every step is as long as the distance allows at the highest speed that the point can have.

    Args:
        limit: what comes later is of no interest. placed: scratch space, (6, 3).
    """
    _, _, fastest, _ = corner_motion(centre, 0, chain, count, 1.0, 0.0, 0.0, 0.0)
    s = 0.0
    for _ in range(WALK):
        move_core(centre, 1, chain, count, s, placed)
        x, y, z = placed[0, 0] - other[0, 0], placed[0, 1] - other[0, 1], placed[0, 2] - other[0, 2]
        apart = math.sqrt(x * x + y * y + z * z) - reach
        if apart <= NEAR * reach:
            break
        if apart >= fastest * (limit - s):
            return limit
        s += apart / fastest
    return s


@inner_kernel
def stays_above(
    core: Floats,
    placed: Floats,
    corners: int,
    chain: Floats,
    count: int,
    nx: float,
    ny: float,
    nz: float,
    offset: float,
    best: float,
) -> bool:
    """Say whether a moving core is seen to stay beyond the plane `n·p = offset` until `best`."""
    s = 0.0
    for _ in range(STEPS):
        move_core(core, corners, chain, count, s, placed)
        step = step_to_plane(core, placed, corners, chain, count, nx, ny, nz, offset, s, best - s)
        if step <= 0.0:
            return False
        if step >= best - s:
            return True
        if count == 1:
            return False
        s += step
    return False
