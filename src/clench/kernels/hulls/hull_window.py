"""A window of travel in which planes keep a moving hull off what rests (docs/method.md section 5).

A plane keeps a hull off a part of the resting body over a whole window in one case: the hull's lowest point over the
plane is above it where the window begins and where it ends, by more than any point can sag in between.

`SweepWork.hull` has a window's data; the numbers below are its rows.
"""

from __future__ import annotations

import math
from typing import Any

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.toi_work import SweepWork
from clench.kernels.trees.obb import slab_top

from .enclosing_hulls import HullArrays
from .gjk import lowest_of
from .hull_motion import HullMotion, bend_along, height, lowest_between, put_pose

#: Poses of the moving body in the resting one's frame where the window begins, and where it ends.
NOW, END = 0, 3
#: Scratch space of `separating_direction`. Corners of the element or of the box that is looked at.
SIMPLEX, CORNERS, BOX_END = 6, 11, 19
#: The planes found last, the latest first: normal, the hull's height over it where the window begins, least height.
PLANES = 19
#: The direction that was found last, and the gap that ended the window before.
LAST = 25
#: The box around the hull where the window begins: its pose, and half its sizes in the last column.
BOX = 26


@kernel
def begin_window(
    moving: BodyArrays, motion: HullMotion, chain: Floats, count: int, s: float, end: float, sweep: SweepWork
) -> None:
    """Begin a window: place the hull at its end, the box around the hull and the planes at its start.

    `NOW` has the pose at the start already.
    """
    window, hulls = sweep.hull, moving.hulls
    put_pose(chain, count, end, sweep, window[END:SIMPLEX])
    put_hull_box(hulls.box[motion.hull], window)
    for k in range(PLANES, LAST):
        if window[k, 3] > -math.inf:
            window[k, 3] = height(hulls, motion, window[NOW:END], (window[k, 0], window[k, 1], window[k, 2]))
    renew_planes(hulls, motion, end - s, window)


@kernel
def put_hull_box(box: Floats, window: Floats) -> None:
    """Write the box around a hull where the window begins."""
    T, out = window[NOW:END], window[BOX:]
    for r in range(3):
        for c in range(4):
            out[r, c] = T[r, 0] * box[0, c] + T[r, 1] * box[1, c] + T[r, 2] * box[2, c]
        out[r, 3], out[r, 4] = out[r, 3] + T[r, 3], box[r, 4]


@kernel
def square_from_box(ball: Floats, window: Floats) -> float:
    """Return the squared distance of the middle of a ball from the box around the hull [m²]."""
    x, y, z = ball[0] - window[BOX, 3], ball[1] - window[BOX + 1, 3], ball[2] - window[BOX + 2, 3]
    square = 0.0
    for c in range(3):
        along = window[BOX, c] * x + window[BOX + 1, c] * y + window[BOX + 2, c] * z
        square += max(abs(along) - window[BOX + c, 4], 0.0) ** 2
    return square


@kernel
def least_height(
    hulls: HullArrays, motion: HullMotion, n: Vector, start: float, length: float, window: Floats
) -> float:
    """Return a bound on the height of a hull along a unit vector in a window of some length, from the height at its
    start [m].
    """
    sag = 0.125 * bend_along(motion, n) * length * length
    return lowest_between(start, height(hulls, motion, window[END:SIMPLEX], n), sag)


@kernel
def forget_planes(window: Floats) -> None:
    """Forget all planes."""
    for k in range(PLANES, LAST):
        window[k, 0] = window[k, 1] = window[k, 2] = 0.0
        window[k, 3] = window[k, 4] = -math.inf


@kernel
def renew_planes(hulls: HullArrays, motion: HullMotion, length: float, window: Floats) -> None:
    """Compute the least heights over the planes in a window that has another end."""
    for k in range(PLANES, LAST):
        if window[k, 3] > -math.inf:
            n = (window[k, 0], window[k, 1], window[k, 2])
            window[k, 4] = least_height(hulls, motion, n, window[k, 3], length, window)


@kernel
def remember_plane(n: Vector, start: float, low: float, window: Floats) -> None:
    """Put a plane before the others, and forget the last one."""
    for k in range(LAST - 1, PLANES, -1):
        for c in range(5):
            window[k, c] = window[k - 1, c]
    window[PLANES, 0], window[PLANES, 1], window[PLANES, 2] = n
    window[PLANES, 3], window[PLANES, 4] = start, low


@kernel
def keeps_off_box(slab: Any, touch: float, window: Floats) -> bool:
    """Say whether one of the planes keeps the hull off a box."""
    for k in range(PLANES, LAST):
        if slab_top(slab, window[k, 0], window[k, 1], window[k, 2]) + touch < window[k, 4]:
            return True
    return False


@kernel
def keeps_off_hull(others: HullArrays, other: int, corners: Floats, w: float, window: Floats) -> bool:
    """Say whether one of the planes keeps the hull off another one, grown by `w`; see `lowest_of`."""
    for k in range(PLANES, LAST):
        low, _ = lowest_of(others, other, corners, -window[k, 0], -window[k, 1], -window[k, 2])
        if w - low < window[k, 4]:
            return True
    return False


@kernel
def put_element(resting: BodyArrays, e: int, window: Floats) -> int:
    """Write the corners of an element; return how many there are."""
    for k in range(resting.corners[e]):
        p = resting.vertices[resting.elements[e, k]]
        for c in range(3):
            window[CORNERS + k, c] = p[c]
    return int(resting.corners[e])


@kernel
def put_box_corners(slab: Any, window: Floats) -> None:
    """Write the corners of the box around a node, without its margin."""
    for k in range(8):
        u = 1.0 if k & 1 else -1.0
        v = 1.0 if k & 2 else -1.0
        w = 1.0 if k & 4 else -1.0
        for c in range(3):
            window[CORNERS + k, c] = slab[c] + u * slab[3 + c] + v * slab[6 + c] + w * slab[9 + c]


@kernel
def push_children(resting: BodyArrays, n: int, window: Floats, stack: Ints, waiting: int) -> int:
    """Put the children of a node on the stack, the one on top that reaches farther over the latest plane."""
    x, y, z, right = window[PLANES, 0], window[PLANES, 1], window[PLANES, 2], resting.right[n]
    k = 1 if slab_top(resting.slab[n + 1], x, y, z) > slab_top(resting.slab[right], x, y, z) else 0
    stack[waiting + k, 0], stack[waiting + 1 - k, 0] = n + 1, right
    return waiting + 2
