"""Bounds from below on the distance from a body, by its grid (docs/method.md section 5).

The squared distance of p from any set, less |p|², is the smallest of affine functions of p, and hence concave. So what
is interpolated between corners of a cube is never above it. This holds for open, flipped and degenerate surfaces.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.box_walk import nearest_on_edge
from clench.kernels.geometry.mesh_distance import closest_on_triangle
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel

#: By how much a squared distance is rounded down, more than single precision needs [-].
DOWN = 1.0 - 2e-7
#: Share of a cube's squared edge that is more than all rounding of an interpolation [-].
ROUNDING = 1e-10
#: Large cubes have edges of so many small ones. They tell enough from so many of their edges on [-].
LARGE, FAR = 4, 2.0
#: A box is covered by so many balls at most, and must be farther away than this share of a cube's edge, which is more
#: than two polyhedra of the same round shape differ [-].
BALLS, AWAY = 8, 0.01
#: The edges of a box in single precision are square to each other up to less than this [-].
SQUARE = 1.0 - 1e-5


@kernel
def square_bound(body: BodyArrays, p: Vector, stack: Any) -> float:
    """Return a bound from below on the squared distance of a point from a body that has a grid [m²].

    Far away, larger cubes tell enough, and have fewer corners to fill.

    Args:
        body: one body. p: in its frame [m]. stack: scratch space, (PAIRS, 3).
    """
    square, edge = body.grid.square, body.grid.place[3]
    x, y, z = in_cubes(body, p, 0), in_cubes(body, p, 1), in_cubes(body, p, 2)
    if not (0.0 <= x < square.shape[0] - 1.0 and 0.0 <= y < square.shape[1] - 1.0 and 0.0 <= z < square.shape[2] - 1.0):
        return float(square_off_box(body.box[0], p))
    bound = bound_in_cube(body, x, y, z, LARGE, stack)
    if bound >= (FAR * LARGE * edge) ** 2:
        return bound
    return float(bound_in_cube(body, x, y, z, 1, stack))


@kernel
def is_box_off(body: BodyArrays, middle: Vector, half: Vector, T: Floats, stack: Any) -> bool:
    """Say whether balls around the parts of a box are seen to lie off the surface of a body, on either side of it.

    Args:
        body: one body. middle, half: of the box [m]. T: from the box's frame to the body's, (3, 4). stack: scratch
            space, (..., 1).
    """
    if body.grid.square.shape[0] == 0:
        return False
    longest = 0
    for c in range(1, 3):
        longest = c if half[c] > half[longest] else longest
    size, other = half[longest], dot(half, half) - half[longest] ** 2
    parts = min(int(size / max(math.sqrt(other), 1e-9 * size)) + 1, BALLS) if size > 0.0 else 1
    reach = math.sqrt(other + (size / parts) ** 2) + AWAY * body.grid.place[3]
    for k in range(parts):
        step = size * ((2 * k + 1) / parts - 1.0)
        x = middle[0] + (step if longest == 0 else 0.0)
        y = middle[1] + (step if longest == 1 else 0.0)
        z = middle[2] + (step if longest == 2 else 0.0)
        p = (
            T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
            T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
            T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
        )
        if not square_bound(body, p, stack) > reach * reach:
            return False
    return True


@kernel
def in_cubes(body: BodyArrays, p: Vector, axis: int) -> float:
    """Return a coordinate of a point in a grid, in edges of a cube."""
    return float((p[axis] - body.grid.place[axis]) / body.grid.place[3])


@kernel
def bound_in_cube(body: BodyArrays, x: float, y: float, z: float, n: int, stack: Any) -> float:
    """Return what `square_bound` returns, by the corners of a cube of `n` edges, as far as the grid reaches.

    Args:
        x, y, z: the point, within the grid, see `in_cubes`.
    """
    square, edge = body.grid.square, body.grid.place[3]
    i, j, k = int(x) // n * n, int(y) // n * n, int(z) // n * n
    a, b, c = (
        min(n, square.shape[0] - 1 - i),
        min(n, square.shape[1] - 1 - j),
        min(n, square.shape[2] - 1 - k),
    )
    if has_unknown(square, i, j, k, a, b, c):
        fill_cube(body, i, j, k, a, b, c, stack)
    x, y, z = (x - i) / a, (y - j) / b, (z - k) / c
    low = between(square[i, j, k], square[i, j, k + c], z)
    high = between(square[i, j + b, k], square[i, j + b, k + c], z)
    near = low + y * (high - low)
    low = between(square[i + a, j, k], square[i + a, j, k + c], z)
    high = between(square[i + a, j + b, k], square[i + a, j + b, k + c], z)
    lost = a * a * x * (1.0 - x) + b * b * y * (1.0 - y) + c * c * z * (1.0 - z)
    return float(near + x * (low + y * (high - low) - near) - edge * edge * (lost + n * n * ROUNDING))


@kernel
def between(a: Any, b: Any, t: float) -> float:
    """Return a number between two, in double precision."""
    low = np.float64(a)
    return float(low + t * (np.float64(b) - low))


@kernel
def square_off_box(box: Floats, p: Vector) -> float:
    """Return the squared distance of a point from a box, given by its middle and half size [m²]."""
    total = 0.0
    for c in range(3):
        total += max(abs(p[c] - box[c]) - box[3 + c], 0.0) ** 2
    return total


@kernel
def has_unknown(square: Any, i: int, j: int, k: int, a: int, b: int, c: int) -> bool:
    """Say whether a corner of a box of cubes, from one corner on, has no distance yet."""
    one = min(min(square[i, j, k], square[i, j, k + c]), min(square[i, j + b, k], square[i, j + b, k + c]))
    i += a
    other = min(min(square[i, j, k], square[i, j, k + c]), min(square[i, j + b, k], square[i, j + b, k + c]))
    return bool(min(one, other) < 0.0)


@kernel
def fill_cube(body: BodyArrays, i: int, j: int, k: int, a: int, b: int, c: int, stack: Any) -> None:
    """Compute the distances at those corners of a box of cubes that have none."""
    square, place = body.grid.square, body.grid.place
    for u in (i, i + a):
        for v in (j, j + b):
            for w in (k, k + c):
                if square[u, v, w] < 0.0:
                    p = place[0] + u * place[3], place[1] + v * place[3], place[2] + w * place[3]
                    square[u, v, w] = np.float32(DOWN * closest_element(body, p, stack)[0])


@kernel
def closest_element(body: BodyArrays, p: Vector, stack: Any) -> tuple[float, int]:
    """Return the squared distance of a point from a body with its elements' radii [m²], and the closest element."""
    best, found, waiting = math.inf, -1, 1
    stack[0, 0] = body.root[0]
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        if square_to_node(body, n, p, best) >= best:
            continue
        if body.count[n] == 0:
            right = body.right[n]
            k = 1 if to_ball(body.node[n + 1], p) < to_ball(body.node[right], p) else 0
            stack[waiting + k, 0], stack[waiting + 1 - k, 0] = n + 1, right
            waiting += 2
            continue
        for e in range(body.first[n], body.first[n] + body.count[n]):
            square = square_to_element(body, e, p)
            if square < best:
                best, found = square, e
    return best, found


@kernel
def to_ball(ball: Floats, p: Vector) -> float:
    """Return the squared distance of a point from the middle of a ball [m²]."""
    square: float = (p[0] - ball[0]) ** 2 + (p[1] - ball[1]) ** 2 + (p[2] - ball[2]) ** 2
    return square


@kernel
def square_to_node(body: BodyArrays, n: int, p: Vector, most: float) -> float:
    """Return a bound from below on the squared distance of a point from a node's ball, or from its box [m²].

    Args:
        most: if the ball is farther away than this, its distance is enough [m²].
    """
    gap = max(math.sqrt(to_ball(body.node[n], p)) - body.node[n, 3], 0.0)
    if gap * gap >= most:
        return float(gap * gap)
    slab = body.slab[n]
    margin = np.float64(slab[12])
    u = np.float64(slab[3]), np.float64(slab[4]), np.float64(slab[5])
    v = np.float64(slab[6]), np.float64(slab[7]), np.float64(slab[8])
    w = np.float64(slab[9]), np.float64(slab[10]), np.float64(slab[11])
    d = p[0] - np.float64(slab[0]), p[1] - np.float64(slab[1]), p[2] - np.float64(slab[2])
    # A box without height is flat: the direction across its other edges takes the place of the third.
    one, other, third = beyond(u, u, v, w, d), beyond(v, u, v, w, d), beyond(cross(u, v), u, v, w, d)
    square = max(one - margin, 0.0) ** 2 + max(other - margin, 0.0) ** 2 + max(third - margin, 0.0) ** 2
    return SQUARE * square


@kernel
def beyond(n: Vector, u: Vector, v: Vector, w: Vector, d: Vector) -> float:
    """Return how far a point, seen from the middle of a box, lies beyond the box along a vector [m].

    Args:
        n: the vector, of any length. u, v, w: half edges of the box. d: the point [m].
    """
    size = math.sqrt(dot(n, n))
    if size <= 0.0:
        return 0.0
    return (abs(dot(n, d)) - abs(dot(n, u)) - abs(dot(n, v)) - abs(dot(n, w))) / size


@kernel
def square_to_element(body: BodyArrays, e: int, p: Vector) -> float:
    """Return the squared distance of a point from an element [m²]; 0 within its radius."""
    square, radius = square_to_core(body, e, p), body.radius[e]
    return square if radius == 0.0 else max(math.sqrt(square) - radius, 0.0) ** 2


@kernel
def square_to_core(body: BodyArrays, e: int, p: Vector) -> float:
    """Return the squared distance of a point from the core of an element [m²].

    Where rounding names the wrong part of a thin triangle, its edges are near enough.
    """
    corners, square = body.corners[e], math.inf
    a, b, c = corner_of(body, e, 0), corner_of(body, e, 1), corner_of(body, e, 2)
    if corners == 3:
        square = min(square, between_points(closest_on_triangle(p, a, b, c), p))
        square = min(square, to_edge(b, c, p))
        square = min(square, to_edge(c, a, p))
    return min(square, to_edge(a, b, p) if corners > 1 else between_points(a, p))


@kernel
def corner_of(body: BodyArrays, e: int, k: int) -> Vector:
    """Return a corner of an element."""
    v = body.elements[e, k]
    return body.vertices[v, 0], body.vertices[v, 1], body.vertices[v, 2]


@kernel
def between_points(q: Vector, p: Vector) -> float:
    """Return the squared distance between two points; infinite where the first is not a number."""
    square = (q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2
    return square if square >= 0.0 else math.inf


@kernel
def to_edge(a: Vector, b: Vector, p: Vector) -> float:
    """Return the squared distance of a point from the segment between two points [m²]."""
    return float(between_points(nearest_on_edge(a, (b[0] - a[0], b[1] - a[1], b[2] - a[2]), p), p))
