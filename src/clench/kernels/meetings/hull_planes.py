"""Planes between the convex hulls of two bodies, found through the points that lie farthest along a direction."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.hulls.enclosing_hulls import lowest_corner
from clench.kernels.hulls.gjk import keep_corners, nearest_of_simplex
from clench.kernels.hulls.hull_window import SIMPLEX
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.toi_work import SweepWork
from clench.kernels.trees.obb import slab_top

#: Directions that are tried at most.
TRIES = 16
#: A plane is good enough when it keeps this share of the hulls' distance apart [-].
GOOD = 0.9
#: Hulls nearer than this are not kept apart [m].
TOUCHING = 1e-12


@kernel
def farthest_vertex(bodies: BodyArrays, m: int, x: float, y: float, z: float, stack: Ints) -> tuple[float, int, int]:
    """Return how far a body reaches along a unit vector of its frame, and the element and the vertex that do."""
    best, found, vertex = -math.inf, 0, 0
    stack[0, 0], waiting = bodies.root[m], 1
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        if bodies.count[n] == 0:
            one, other = n + 1, bodies.right[n]
            top, second = slab_top(bodies.slab[one], x, y, z), slab_top(bodies.slab[other], x, y, z)
            if top > second:
                one, other, top, second = other, one, second, top
            # The farther-reaching one is tested next.
            if top > best:
                stack[waiting, 0] = one
                waiting += 1
            if second > best:
                stack[waiting, 0] = other
                waiting += 1
            continue
        for e in range(bodies.first[n], bodies.first[n] + bodies.count[n]):
            for k in range(bodies.corners[e]):
                v = bodies.elements[e, k]
                p = bodies.vertices[v]
                top = x * p[0] + y * p[1] + z * p[2] + bodies.radius[e]
                if top > best:
                    best, found, vertex = top, e, v
    return best, found, vertex


@kernel
def farthest_point(
    bodies: BodyArrays, m: int, T: Floats, nx: float, ny: float, nz: float, stack: Ints
) -> tuple[float, float, float, float]:
    """Return how far a body reaches along a unit vector, and a point of it there, both in the frame of its pose."""
    x, y, z = (
        T[0, 0] * nx + T[1, 0] * ny + T[2, 0] * nz,
        T[0, 1] * nx + T[1, 1] * ny + T[2, 1] * nz,
        T[0, 2] * nx + T[1, 2] * ny + T[2, 2] * nz,
    )
    hulls = bodies.hulls
    best, reach, p = -math.inf, 0.0, bodies.box[m]
    for hull in range(hulls.body[m], hulls.body[m + 1]):
        low, k = lowest_corner(hulls, hull, -x, -y, -z)
        if hulls.radius[hull] - low > best:
            best, reach, p = hulls.radius[hull] - low, hulls.radius[hull], hulls.points[k]
    if hulls.body[m] == hulls.body[m + 1]:
        best, e, v = farthest_vertex(bodies, m, x, y, z, stack)
        reach, p = bodies.radius[e], bodies.vertices[v]
    px, py, pz = p[0] + reach * x, p[1] + reach * y, p[2] + reach * z
    return (
        best + nx * T[0, 3] + ny * T[1, 3] + nz * T[2, 3],
        T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3],
        T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3],
        T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3],
    )


@kernel
def plane_between(bodies: BodyArrays, m: int, r: int, nx: float, ny: float, nz: float, sweep: SweepWork) -> float:
    """Return how far body `m` lies beyond body `r` along a unit vector [m]; their poses are in `sweep`.

    The difference of the two points there is left in the last row of `sweep.placed`.
    """
    low, ax, ay, az = farthest_point(bodies, m, sweep.moving, -nx, -ny, -nz, sweep.stack)
    top, bx, by, bz = farthest_point(bodies, r, sweep.resting, nx, ny, nz, sweep.stack)
    sweep.placed[7, 0], sweep.placed[7, 1], sweep.placed[7, 2] = ax - bx, ay - by, az - bz
    return -low - top


@kernel
def find_plane(
    bodies: BodyArrays, m: int, r: int, nx: float, ny: float, nz: float, sweep: SweepWork
) -> tuple[float, float, float, float]:
    """Return how far a plane keeps two bodies apart, and its unit normal, from body `r` to `m`.

    The first direction that is tried is given. Those that follow lead to the simplex, among differences of points of
    the two hulls, that is nearest to the origin (Gilbert, Johnson and Keerthi). If hulls overlap, the result is not
    positive.
    """
    best, bx, by, bz = -math.inf, nx, ny, nz
    simplex, weights, size, square = sweep.hull[SIMPLEX : SIMPLEX + 4], sweep.hull[SIMPLEX + 4], 0, math.inf
    for _ in range(TRIES):
        margin = plane_between(bodies, m, r, nx, ny, nz, sweep)
        if margin > best:
            best, bx, by, bz = margin, nx, ny, nz
        if best >= GOOD * math.sqrt(square):
            break
        size, nearest, nx, ny, nz = add_corner(sweep.placed[7], size, simplex, weights)
        if not nearest < square or nearest <= TOUCHING * TOUCHING:
            break
        square = nearest
    return best, bx, by, bz


@kernel
def add_corner(p: Floats, size: int, simplex: Floats, weights: Floats) -> tuple[int, float, float, float, float]:
    """Add a corner to a simplex, and keep those corners that its point nearest to the origin needs.

    Returns:
        how many corners are left, the square of the distance, and the unit vector to that point.
    """
    for c in range(3):
        simplex[size, c] = p[c]
    size, x, y, z = size + 1, p[0], p[1], p[2]
    square = x * x + y * y + z * z
    if size > 1:
        square = nearest_of_simplex(simplex, size, weights)
        size, x, y, z = keep_corners(simplex, size, weights)
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return size, 0.0, 1.0, 0.0, 0.0
    return size, square, x / length, y / length, z / length
