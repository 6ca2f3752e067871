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
from .turned_planes import COUNT, forget_turned, is_over, is_there, left_over, normal_of, put_turned

#: Poses of the moving body in the resting one's frame where the window begins, and where it ends.
NOW, END = 0, 3
#: The corners that `widest_gap` ended with, and its scratch space. Corners of the element that is looked at.
SIMPLEX, CORNERS = 6, 11
#: The planes found last, the latest first: normal, the hull's height over it where the window begins, a bound on its
#: height in a window of some length, and that length. Heights are infinite until they are asked for.
PLANES = 14
#: The direction that was found last.
LAST = 20
#: The box around the hull where the window begins: its pose, and half its sizes after that.
BOX = 21
#: For each listed element a unit vector that leads from it to the hull.
LISTED = 24
#: The nearest points of what rests and of the hull, where they touch: in the window, and in the sweep.
MET, TOUCHING = 68, 69


@kernel
def begin_window(
    moving: BodyArrays, motion: HullMotion, chain: Floats, count: int, end: float, length: float, sweep: SweepWork
) -> None:
    """Begin a window: place the hull at its end, and the box around the hull at its start; no height is known.

    `NOW` has the pose at the start already.

    Args:
        end: the travel where the window ends. length: of the window.
    """
    window, hulls = sweep.hull, moving.hulls
    put_pose(chain, count, end, sweep, window[END:SIMPLEX])
    put_hull_box(hulls.box[motion.hull], window)
    for k in range(PLANES, LAST):
        if window[k, 3] > -math.inf:
            window[k, 3], window[k, 4], window[k, 5] = math.inf, -math.inf, -1.0
    put_turned(motion, window[NOW:END], window[END:SIMPLEX], length, window)


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
def way_to_box(ball: Floats, window: Floats) -> Vector:
    """Return the unit vector from the middle of a ball to the box around the hull, or any one if it lies inside."""
    x, y, z = ball[0] - window[BOX, 3], ball[1] - window[BOX + 1, 3], ball[2] - window[BOX + 2, 3]
    nx = ny = nz = 0.0
    for c in range(3):
        along = window[BOX, c] * x + window[BOX + 1, c] * y + window[BOX + 2, c] * z
        back = min(max(along, -window[BOX + c, 4]), window[BOX + c, 4]) - along
        nx, ny, nz = nx + back * window[BOX, c], ny + back * window[BOX + 1, c], nz + back * window[BOX + 2, c]
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return 1.0, 0.0, 0.0
    return nx / size, ny / size, nz / size


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
    forget_turned(window)


@kernel
def forget_shorter(length: float, window: Floats) -> None:
    """Forget the bounds on heights that hold for shorter windows than one of a length."""
    for k in range(PLANES, LAST):
        if window[k, 5] < length:
            window[k, 4], window[k, 5] = -math.inf, -1.0


@kernel
def remember_plane(n: Vector, start: float, low: float, length: float, window: Floats) -> None:
    """Put a plane before the others, and forget the last one."""
    for k in range(LAST - 1, PLANES, -1):
        for c in range(6):
            window[k, c] = window[k - 1, c]
    window[PLANES, 0], window[PLANES, 1], window[PLANES, 2] = n
    window[PLANES, 3], window[PLANES, 4], window[PLANES, 5] = start, low, length


@kernel
def stays_over(hulls: HullArrays, motion: HullMotion, k: int, top: float, length: float, window: Floats) -> bool:
    """Say whether a plane tells that a hull stays above a height over it in a window of some length.

    A bound for a longer window holds as well: only one that does not suffice is renewed.
    """
    if window[k, 4] > top:
        return True
    if window[k, 3] <= top or window[k, 5] == length:
        return False
    n = (window[k, 0], window[k, 1], window[k, 2])
    if window[k, 3] == math.inf:
        window[k, 3] = height(hulls, motion, window[NOW:END], n)
        if window[k, 3] <= top:
            return False
    window[k, 4], window[k, 5] = least_height(hulls, motion, n, window[k, 3], length, window), length
    return bool(window[k, 4] > top)


@kernel
def keeps_off_box(
    hulls: HullArrays, motion: HullMotion, slab: Any, touch: float, length: float, window: Floats
) -> bool:
    """Say whether one of the planes keeps the hull off a box."""
    for k in range(COUNT):
        if not is_there(k, window):
            break
        n = normal_of(k, False, window)
        top = slab_top(slab, n[0], n[1], n[2]) + touch
        if is_over(k, top, window):
            n = normal_of(k, True, window)
            if left_over(k, top, slab_top(slab, n[0], n[1], n[2]) + touch, window) > 0.0:
                return True
    for k in range(PLANES, LAST):
        if window[k, 3] == -math.inf:
            return False
        top = slab_top(slab, window[k, 0], window[k, 1], window[k, 2]) + touch
        if stays_over(hulls, motion, k, top, length, window):
            return True
    return False


@kernel
def keeps_off_hull(
    hulls: HullArrays,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    corners: Floats,
    w: float,
    length: float,
    window: Floats,
) -> bool:
    """Say whether one of the planes keeps the hull off another one, grown by `w`; see `lowest_of`."""
    for k in range(COUNT):
        if not is_there(k, window):
            break
        top = top_along(others, other, corners, w, normal_of(k, False, window))
        if not is_over(k, top, window):
            continue
        if left_over(k, top, top_along(others, other, corners, w, normal_of(k, True, window)), window) > 0.0:
            return True
    for k in range(PLANES, LAST):
        if window[k, 3] == -math.inf:
            return False
        top = top_along(others, other, corners, w, (window[k, 0], window[k, 1], window[k, 2]))
        if stays_over(hulls, motion, k, top, length, window):
            return True
    return False


@kernel
def top_along(others: HullArrays, other: int, corners: Floats, w: float, n: Vector) -> float:
    """Return the largest coordinate of a hull along a unit vector, grown by `w` [m]; see `lowest_of`."""
    low, _ = lowest_of(others, other, corners, -n[0], -n[1], -n[2])
    return float(w - low)


@kernel
def put_element(resting: BodyArrays, e: int, window: Floats) -> int:
    """Write the corners of an element; return how many there are."""
    for k in range(resting.corners[e]):
        p = resting.vertices[resting.elements[e, k]]
        for c in range(3):
            window[CORNERS + k, c] = p[c]
    return int(resting.corners[e])


@kernel
def push_children(resting: BodyArrays, n: int, window: Floats, stack: Ints, waiting: int) -> int:
    """Put the children of a node on the stack, the one on top that reaches farther over the latest plane."""
    x, y, z, right = window[PLANES, 0], window[PLANES, 1], window[PLANES, 2], resting.right[n]
    k = 1 if slab_top(resting.slab[n + 1], x, y, z) > slab_top(resting.slab[right], x, y, z) else 0
    stack[waiting + k, 0], stack[waiting + 1 - k, 0] = n + 1, right
    return waiting + 2
