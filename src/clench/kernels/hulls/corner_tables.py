"""Tables that tell which corners of a hull can lie farthest along any of a small cone of directions.

The six faces of a cube around the origin are divided into squares; a cone is what one square shows of the directions.
Cones with many corners are divided into four. A corner v is left out of a cone about the unit vector d if
`d·(u - v) > ε |u - v|`: u is the corner that lies farthest along d, and no direction of the cone differs from d by more
than ε.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import entry_kernel, kernel

Whole = NDArray[np.int64]
Small = NDArray[np.int32]

#: Squares along an edge of the cube before any is divided.
WIDE: Final = 8
#: A cone with more corners is divided, this often at most.
ENOUGH: Final = 16
DEEPEST: Final = 3
#: By which a cone is widened [-].
SLACK: Final = 1e-6
#: Cones and entries for each corner that are expected at first.
EXPECTED: Final = 16


class CornerTable(NamedTuple):
    """The corners that can lie farthest along the directions of each cone.

    Args:
        cone: first entry of each cone and how many it has; of a cone that is divided, the first of its four parts, and
            -1, (C, 2). The first `6 WIDE²` cones are not part of others.
        entry: corners of the cones that are not divided, cone by cone, (N,).
        order: the corners as they first occur in `entry`, whose numbers are places in this order, (P,). So the corners
            of a cone, and those of the cones around it, are near each other in memory.
    """

    cone: Small
    entry: Small
    order: Whole


def make_table(points: Floats) -> CornerTable:
    """Return the table of a hull's corners, (P, 3)."""
    room, count = EXPECTED * len(points), 0
    while count == 0:
        square = np.empty((6 * WIDE * WIDE + room, 4), dtype=np.int64)
        span = np.empty((len(square), 3), dtype=np.int64)
        entry = np.empty(EXPECTED * len(square), dtype=np.int32)
        count = divide_cones(points, square, span, entry)
        room *= 2
    part, first, end = span[:count].T
    # What is divided has no entries of its own.
    sizes = np.where(part < 0, end - first, 0)
    starts = np.cumsum(sizes) - sizes
    entry = entry[np.repeat(first - starts, sizes) + np.arange(sizes.sum())]
    found, where = np.unique(entry, return_index=True)
    order = np.concatenate([found[np.argsort(where)], np.setdiff1d(np.arange(len(points)), found)])
    place = np.empty(len(points), dtype=np.int32)
    place[order] = np.arange(len(points))
    cone = np.column_stack([np.where(part < 0, starts, part), np.where(part < 0, sizes, -1)])
    return CornerTable(cone.astype(np.int32), place[entry], order)


@entry_kernel
def divide_cones(points: Floats, square: Whole, span: Whole, entry: Small) -> int:
    """Write the cones of a table, divided or not, and their corners; return how many there are, 0 where room lacks.

    Args:
        square: written: face, row and column of the square of each cone, and squares along an edge, (C, 4).
        span: written: first part of each cone, or -1, its first entry and the one after its last, (C, 3).
        entry: written: the corners. Cones that are divided have entries as well.
    """
    count, last = 6 * WIDE * WIDE, 0
    for n in range(count):
        put_square(square[n], n // (WIDE * WIDE), n // WIDE % WIDE, n % WIDE, WIDE)
        last = list_farthest(points, entry, -1, points.shape[0], square[n], last)
        span[n, 0], span[n, 2] = -1, last
        if last > entry.shape[0]:
            return 0
    n = 0
    while n < count:
        span[n, 1] = span[n - 1, 2] if n > 0 else 0
        first, end = span[n, 1], span[n, 2]
        if end - first > ENOUGH and square[n, 3] < WIDE << DEEPEST:
            if count + 4 > span.shape[0]:
                return 0
            span[n, 0] = count
            for part in range(4):
                row, column = 2 * square[n, 1] + part // 2, 2 * square[n, 2] + part % 2
                put_square(square[count], square[n, 0], row, column, 2 * square[n, 3])
                last = list_farthest(points, entry, first, end, square[count], last)
                span[count, 0], span[count, 2] = -1, last
                count += 1
            if last > entry.shape[0]:
                return 0
        n += 1
    return count


@kernel
def put_square(square: Whole, face: int, row: int, column: int, side: int) -> None:
    """Write where a square is."""
    square[0], square[1], square[2], square[3] = face, row, column, side


@kernel
def list_farthest(points: Floats, entry: Small, first: int, end: int, square: Whole, at: int) -> int:
    """List the corners of a cone that can lie farthest along its directions, from an entry on; return the end.

    Args:
        first, end: entries of a cone around this one; if `first` is negative, so many points. at: the first entry that
            is written. What does not fit is only counted.
    """
    d, epsilon = middle_of(square[0], square[1], square[2], square[3])
    begin = max(first, 0)
    top, u = -math.inf, 0
    for n in range(begin, end):
        k = n if first < 0 else entry[n]
        along = d[0] * points[k, 0] + d[1] * points[k, 1] + d[2] * points[k, 2]
        if along > top:
            top, u = along, k
    most = epsilon * (1.0 + SLACK) + SLACK
    for n in range(begin, end):
        k = n if first < 0 else entry[n]
        x, y, z = points[u, 0] - points[k, 0], points[u, 1] - points[k, 1], points[u, 2] - points[k, 2]
        if d[0] * x + d[1] * y + d[2] * z <= most * math.sqrt(x * x + y * y + z * z):
            if at < entry.shape[0]:
                entry[at] = k
            at += 1
    return at


@kernel
def middle_of(face: int, row: int, column: int, side: int) -> tuple[Vector, float]:
    """Return the unit vector in the middle of a cone, and how far a direction of the cone is from it at most."""
    half = 1.0 / side
    a, b = (2.0 * row + 1.0) * half - 1.0, (2.0 * column + 1.0) * half - 1.0
    d, epsilon = on_face(face, a, b), 0.0
    for k in range(4):
        end = on_face(face, a + (half if k & 1 else -half), b + (half if k & 2 else -half))
        x, y, z = end[0] - d[0], end[1] - d[1], end[2] - d[2]
        epsilon = max(epsilon, math.sqrt(x * x + y * y + z * z))
    return d, epsilon


@kernel
def on_face(face: int, a: float, b: float) -> Vector:
    """Return the unit vector to a point on a face of the cube; the axis of the face is followed by those of a and b."""
    size = math.sqrt(1.0 + a * a + b * b)
    top, a, b = (1.0 if face % 2 == 0 else -1.0) / size, a / size, b / size
    if face < 2:
        return top, a, b
    if face < 4:
        return b, top, a
    return a, b, top


@kernel
def cone_of(cone: Small, first: int, x: float, y: float, z: float) -> int:
    """Return the cone, of those from `first` on, that a direction is in and that is not divided."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        axis, top, a, b, size = 0, x, y, z, ax
    elif ay >= az:
        axis, top, a, b, size = 1, y, z, x, ay
    else:
        axis, top, a, b, size = 2, z, x, y, az
    if not size > 0.0:
        a, b, size = 0.0, 0.0, 1.0
    scale = 0.5 * WIDE / size
    a, b = scale * (a + size), scale * (b + size)
    row, column = min(int(a), WIDE - 1), min(int(b), WIDE - 1)
    n = first + ((2 * axis + (0 if top > 0.0 else 1)) * WIDE + row) * WIDE + column
    while cone[n, 1] < 0:
        a, b = 2.0 * (a - row), 2.0 * (b - column)
        row, column = min(int(a), 1), min(int(b), 1)
        n = cone[n, 0] + 2 * row + column
    return int(n)
