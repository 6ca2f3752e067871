"""How joints about axes that are not parallel move points (docs/method.md section 4, *several joints at once*).

A chain of such joints has rows (rate, a_x, a_y, a_z, e_x, e_y, e_z): turn per travel, unit axis, and the way to the
next pivot [m], all where the motion begins. The points that it moves are given relative to the last pivot, and the
answer is relative to the first.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector, cross, dot, plus, scaled
from clench.kernels.runtime.compiling import kernel

#: Columns of such a chain; one of parallel joints has three.
SPATIAL = 7


@kernel
def is_spatial(chain: Floats) -> bool:
    """Say whether the axes of a chain are not parallel."""
    return bool(chain.shape[1] == SPATIAL)


@kernel
def axis_of(chain: Floats, i: int) -> Vector:
    """Return the axis of a row."""
    return chain[i, 1], chain[i, 2], chain[i, 3]


@kernel
def way_of(chain: Floats, i: int) -> Vector:
    """Return the way from a row's pivot to the next."""
    return chain[i, 4], chain[i, 5], chain[i, 6]


@kernel
def turned_about(p: Vector, axis: Vector, angle: float) -> Vector:
    """Return a vector turned about a unit axis."""
    s, v = turn_of(angle)
    return turned_so(p, axis, s, v)


@kernel
def turn_of(angle: float) -> tuple[float, float]:
    """Return the sine of an angle, and 1 less its cosine."""
    return math.sin(angle), 2.0 * math.sin(0.5 * angle) ** 2


@kernel
def turned_so(p: Vector, axis: Vector, s: float, v: float) -> Vector:
    """Return a vector turned about a unit axis by an angle; `s` and `v` are what `turn_of` tells of it."""
    across = cross(axis, p)
    return plus(plus(p, scaled(across, s)), scaled(cross(axis, across), v))


@kernel
def move_pose(chain: Floats, count: int, s: float, T: Floats) -> None:
    """Move a pose, relative to the last pivot, as the chain moves by `s`; then it is relative to the first, (3, 4)."""
    for k in range(count):
        i = count - 1 - k
        axis, (sine, versine) = axis_of(chain, i), turn_of(chain[i, 0] * s)
        for c in range(4):
            T[0, c], T[1, c], T[2, c] = turned_so((T[0, c], T[1, c], T[2, c]), axis, sine, versine)
        if i > 0:
            T[0, 3], T[1, 3], T[2, 3] = plus((T[0, 3], T[1, 3], T[2, 3]), way_of(chain, i - 1))


@kernel
def moved(p: Vector, chain: Floats, count: int, s: float) -> Vector:
    """Return where a point is when the chain has moved by `s`."""
    for k in range(count):
        i = count - 1 - k
        p = turned_about(p, axis_of(chain, i), chain[i, 0] * s)
        if i > 0:
            p = plus(p, way_of(chain, i - 1))
    return p


@kernel
def moved_back(m: Vector, chain: Floats, count: int, s: float, step: float) -> Vector:
    """Return a direction that moves with the body, as it was a step before `s + step`."""
    for i in range(count):
        m = turned_about(m, axis_of(chain, i), -chain[i, 0] * (s + step))
    for k in range(count):
        i = count - 1 - k
        m = turned_about(m, axis_of(chain, i), chain[i, 0] * s)
    return m


@kernel
def point_motion(p: Vector, chain: Floats, count: int, s: float) -> tuple[Vector, Vector]:
    """Return velocity and acceleration of a point when the chain has moved by `s`."""
    v, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(count):
        i = count - 1 - k
        axis, rate = axis_of(chain, i), float(chain[i, 0])
        w = scaled(axis, rate)
        p, v, a = turned_about(p, axis, rate * s), turned_about(v, axis, rate * s), turned_about(a, axis, rate * s)
        along = cross(w, p)
        a = plus(a, plus(scaled(cross(w, v), 2.0), cross(w, along)))
        v = plus(v, along)
        if i > 0:
            p = plus(p, way_of(chain, i - 1))
    return v, a


@kernel
def point_bounds(p: Vector, chain: Floats, count: int) -> tuple[float, float]:
    """Return bounds on speed and acceleration of a point, wherever the chain is."""
    lever, bound, reach = 0.0, 0.0, 0.0
    for k in range(count):
        i = count - 1 - k
        rate = abs(chain[i, 0])
        if k == 0:
            across = cross(axis_of(chain, i), p)
            arm, reach = math.sqrt(dot(across, across)), math.sqrt(dot(p, p))
        else:
            way = way_of(chain, i)
            reach += math.sqrt(dot(way, way))
            arm = reach
        bound += 2.0 * rate * lever + rate * rate * arm
        lever += rate * arm
    return lever, bound


@kernel
def total_rate(chain: Floats, count: int) -> float:
    """Return a bound on how fast what moves turns."""
    total = 0.0
    for i in range(count):
        total += abs(chain[i, 0])
    return total
