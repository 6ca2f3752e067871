"""Planes that turn with a moving hull, in a window of travel (docs/method.md section 5).

A plane that rests keeps a vertex of a hull off what rests almost until they touch. The flat face of a hull that turns
soon crosses such a plane with its far corners. A plane along this face turns with it. Such a plane is given by its
normal in the hull's frame and by the hull's height over the frame's origin.

Between the start and the end of a window, let the normal change evenly from one value to the other. Then the height of
a point of the hull over a point that rests bends by no more than the point's acceleration and twice the rate of the
normal times the point's speed.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel

from .hull_motion import HullMotion, lowest_between

#: Rows of a window's data: for each plane the normal in the hull's frame, the hull's height and number; then normal and
#: height where the window begins, and where it ends. The last row's fifth number is the sag, see `lowest_between`.
TURNED, EACH, COUNT = 56, 3, 2


@kernel
def forget_turned(window: Floats) -> None:
    """Forget all planes that turn."""
    for k in range(COUNT):
        window[TURNED + EACH * k, 4] = -1.0
        window[TURNED + EACH * k + 1, 3] = -math.inf


@kernel
def remember_turned(motion: HullMotion, n: Vector, start: float, now: Floats, window: Floats) -> None:
    """Put a plane before the others, and forget the last one.

    Args:
        n: unit normal where the window begins. start: the hull's height along it. now: the hull's pose there.
    """
    for row in range(TURNED + EACH * COUNT - 1, TURNED + EACH - 1, -1):
        for c in range(6):
            window[row, c] = window[row - EACH, c]
    for c in range(3):
        window[TURNED, c] = now[0, c] * n[0] + now[1, c] * n[1] + now[2, c] * n[2]
    window[TURNED, 3] = start - (n[0] * now[0, 3] + n[1] * now[1, 3] + n[2] * now[2, 3])
    window[TURNED, 4] = motion.hull


@kernel
def put_turned(motion: HullMotion, now: Floats, then: Floats, length: float, window: Floats) -> None:
    """Write where all planes are where a window of some length begins, and where it ends; those of other hulls are out.

    Args:
        now, then: poses of the hull there.
    """
    for k in range(COUNT):
        row = TURNED + EACH * k
        if window[row, 4] != motion.hull:
            window[row + 1, 3] = -math.inf
            continue
        place_plane(window[row], now, window[row + 1])
        place_plane(window[row], then, window[row + 2])
        x, y, z = (
            window[row + 2, 0] - window[row + 1, 0],
            window[row + 2, 1] - window[row + 1, 1],
            window[row + 2, 2] - window[row + 1, 2],
        )
        turn = math.sqrt(x * x + y * y + z * z)
        window[row + 2, 4] = 0.125 * length * (motion.bend * length + 2.0 * turn * motion.speed)


@kernel
def place_plane(plane: Floats, T: Floats, out: Floats) -> None:
    """Write a plane's normal and the hull's height along it, where a pose puts the hull."""
    height = plane[3]
    for r in range(3):
        out[r] = T[r, 0] * plane[0] + T[r, 1] * plane[1] + T[r, 2] * plane[2]
        height += out[r] * T[r, 3]
    out[3] = height


@kernel
def normal_of(k: int, later: bool, window: Floats) -> Vector:
    """Return the normal of a plane where the window begins, or where it ends."""
    row = window[TURNED + EACH * k + (2 if later else 1)]
    return row[0], row[1], row[2]


@kernel
def is_there(k: int, window: Floats) -> bool:
    """Say whether a plane is of the hull that moves."""
    return bool(window[TURNED + EACH * k + 1, 3] > -math.inf)


@kernel
def is_over(k: int, top: float, window: Floats) -> bool:
    """Say whether a plane has the hull above a height where the window begins."""
    return bool(window[TURNED + EACH * k + 1, 3] > top)


@kernel
def left_over(k: int, top: float, later: float, window: Floats) -> float:
    """Return a bound on how far the hull stays beyond what rests in the whole window [m].

    Args:
        k: the plane. top, later: heights of what rests along the normals where the window begins, and where it ends.
    """
    row = TURNED + EACH * k
    return float(lowest_between(window[row + 1, 3] - top, window[row + 2, 3] - later, window[row + 2, 4]))
