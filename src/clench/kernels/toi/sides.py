"""How far items of two bodies lie apart along one direction: nodes of trees by their boxes, and elements."""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.trees.obb import slab_top


class Sides(NamedTuple):
    """A unit vector as two bodies see it, or a vector of length 0, along which nothing lies apart.

    Args:
        one, other: in the frame of either body. height: how far the first frame is beyond the other one [m].
    """

    one: Vector
    other: Vector
    height: float


@kernel
def sides_of(n: Vector, one: Floats, other: Floats) -> Sides:
    """Return a vector in the frames of two poses, and how far the first pose is beyond the other along it."""
    return Sides(
        (
            n[0] * one[0, 0] + n[1] * one[1, 0] + n[2] * one[2, 0],
            n[0] * one[0, 1] + n[1] * one[1, 1] + n[2] * one[2, 1],
            n[0] * one[0, 2] + n[1] * one[1, 2] + n[2] * one[2, 2],
        ),
        (
            n[0] * other[0, 0] + n[1] * other[1, 0] + n[2] * other[2, 0],
            n[0] * other[0, 1] + n[1] * other[1, 1] + n[2] * other[2, 1],
            n[0] * other[0, 2] + n[1] * other[1, 2] + n[2] * other[2, 2],
        ),
        n[0] * (one[0, 3] - other[0, 3]) + n[1] * (one[1, 3] - other[1, 3]) + n[2] * (one[2, 3] - other[2, 3]),
    )


@kernel
def gap_over(one: BodyArrays, a: int, other: BodyArrays, b: int, sides: Sides) -> float:
    """Return how far an item of one body is beyond an item of another one."""
    u, v, height = sides
    return float(span(one, a, u[0], u[1], u[2])[0] - span(other, b, v[0], v[1], v[2])[1] + height)


@kernel
def span(bodies: BodyArrays, n: int, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the smallest and largest coordinate of an item, a node's box or an element, along a unit vector."""
    if n >= 0:
        slab = bodies.slab[n]
        middle = x * slab[0] + y * slab[1] + z * slab[2]
        top = slab_top(slab, x, y, z)
        return middle - (top - middle), top
    low, high = math.inf, -math.inf
    for k in range(bodies.corners[-1 - n]):
        p = bodies.vertices[bodies.elements[-1 - n, k]]
        at = x * p[0] + y * p[1] + z * p[2]
        low, high = min(low, at), max(high, at)
    return low - bodies.radius[-1 - n], high + bodies.radius[-1 - n]
