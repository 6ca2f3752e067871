"""How long a moving core stays clear of the box around a node of a resting body (docs/method.md section 5).

Small parts of a surface are flat: the boxes around them are thin, where capsules are as thick as they are wide. Of a
moving node the core is the rectangle in the middle of its box.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.core_motion import CorePair, MovingCore, place_core, plane_offset
from clench.kernels.toi.toi_bounds import STEPS
from clench.kernels.toi.toi_pairs import step_to_plane

from .mesh_distance import closest_on_triangle
from .vectors import Vector, cross, dot, scaled

#: How often the closest points of a core and a box are looked for, each from the other one.
TURNS = 3
#: Squares of edges are taken to be at least this [m²].
SMALLEST = 1e-300
#: Edges with a smaller sine between them are taken for parallel [-].
PARALLEL = 1e-6


@kernel
def put_box(slab: Any, T: Floats, box: Floats) -> float:
    """Write the box around a node, in a pose; return by how much it is grown [m].

    Its axes are made square to each other in double precision, and as long as the edges of the node's box reach.

    Args:
        slab: see `clench.kernels.trees.obb`.
        box: written with the middle, three unit axes, and half the sizes along them [m], (5, 3).
    """
    u = np.float64(slab[3]), np.float64(slab[4]), np.float64(slab[5])
    v = np.float64(slab[6]), np.float64(slab[7]), np.float64(slab[8])
    w = np.float64(slab[9]), np.float64(slab[10]), np.float64(slab[11])
    first, third = square_axes(u, v)
    put_axis(first, u, v, w, T, 0, box)
    put_axis(cross(third, first), u, v, w, T, 1, box)
    put_axis(third, u, v, w, T, 2, box)
    for r in range(3):
        box[0, r] = T[r, 0] * slab[0] + T[r, 1] * slab[1] + T[r, 2] * slab[2] + T[r, 3]
    return float(slab[12])


@kernel
def square_axes(u: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Return the unit vectors along u and across both, for any sizes, up to none; along v if u has no length."""
    size, other = math.sqrt(dot(u, u)), math.sqrt(dot(v, v))
    along, length = (u, size) if size > 0.0 else (v, other)
    first = scaled(along, 1.0 / length) if length > 0.0 else (1.0, 0.0, 0.0)
    third = cross(first, v)
    size = math.sqrt(dot(third, third))
    if size <= PARALLEL * other:
        third = cross(first, (0.0, 0.0, 1.0) if abs(first[2]) < 0.5 else (0.0, 1.0, 0.0))
        size = math.sqrt(dot(third, third))
    return first, scaled(third, 1.0 / size)


@kernel
def put_axis(axis: Vector, u: Vector, v: Vector, w: Vector, T: Floats, k: int, box: Floats) -> None:
    """Write axis `k` of a box, turned by a pose, and how far the edges u, v and w reach along it."""
    for r in range(3):
        box[1 + k, r] = T[r, 0] * axis[0] + T[r, 1] * axis[1] + T[r, 2] * axis[2]
    box[4, k] = abs(dot(axis, u)) + abs(dot(axis, v)) + abs(dot(axis, w))


@kernel
def nearest_on_edge(a: Vector, edge: Vector, p: Vector) -> Vector:
    """Return the point of the segment from `a` along an edge that is closest to a point."""
    along = edge[0] * (p[0] - a[0]) + edge[1] * (p[1] - a[1]) + edge[2] * (p[2] - a[2])
    t = min(max(along / max(dot(edge, edge), SMALLEST), 0.0), 1.0)
    return a[0] + t * edge[0], a[1] + t * edge[1], a[2] + t * edge[2]


@kernel
def nearest_of(core: Floats, corners: int, p: Vector) -> Vector:
    """Return the point of a core that is closest to a point; four corners are those of a rectangle, in order."""
    a = core[0, 0], core[0, 1], core[0, 2]
    if corners == 1:
        return a
    b = core[1, 0], core[1, 1], core[1, 2]
    if corners == 3:
        return closest_on_triangle(p, a, b, (core[2, 0], core[2, 1], core[2, 2]))
    q = nearest_on_edge(a, (b[0] - a[0], b[1] - a[1], b[2] - a[2]), p)
    if corners == 2:
        return q
    return nearest_on_edge(q, (core[3, 0] - a[0], core[3, 1] - a[1], core[3, 2] - a[2]), p)


@kernel
def off_box(core: Floats, corners: int, box: Floats, local: Floats) -> tuple[float, float, float, float, float]:
    """Return how far a core lies beyond a box along a direction that parts them well, and the box's top along it.

    The gap is never larger than the distance, and not above zero where they overlap. The directions that are looked at
    are the box's axes, and that between the closest points, as far as a few looks from either find them.

    Args:
        core: up to a rectangle, (4, 3). corners: how many of its rows count. box: see `put_box`. local: scratch space,
            (4, 3).

    Returns:
        gap, unit direction, largest coordinate of the box along it.
    """
    gap, n = -math.inf, (1.0, 0.0, 0.0)
    for r in range(3):
        low, high = math.inf, -math.inf
        for k in range(corners):
            dx, dy, dz = core[k, 0] - box[0, 0], core[k, 1] - box[0, 1], core[k, 2] - box[0, 2]
            at = box[1 + r, 0] * dx + box[1 + r, 1] * dy + box[1 + r, 2] * dz
            local[k, r] = at
            low, high = min(low, at), max(high, at)
        beyond = max(low, -high) - box[4, r]
        if beyond > gap:
            sign = 1.0 if low >= -high else -1.0
            gap, n = beyond, (sign if r == 0 else 0.0, sign if r == 1 else 0.0, sign if r == 2 else 0.0)
    if gap > 0.0:
        q = (0.0, 0.0, 0.0)
        for _ in range(TURNS):
            p = nearest_of(local, corners, q)
            q = clamped(p[0], box[4, 0]), clamped(p[1], box[4, 1]), clamped(p[2], box[4, 2])
            d = p[0] - q[0], p[1] - q[1], p[2] - q[2]
            size = math.sqrt(dot(d, d))
            if size <= max(gap, 0.0):
                break
            m = scaled(d, 1.0 / size)
            beyond = -plane_offset(local, corners, -m[0], -m[1], -m[2]) - box_reach(box, m)
            if beyond > gap:
                gap, n = beyond, m
    nx = n[0] * box[1, 0] + n[1] * box[2, 0] + n[2] * box[3, 0]
    ny = n[0] * box[1, 1] + n[1] * box[2, 1] + n[2] * box[3, 1]
    nz = n[0] * box[1, 2] + n[1] * box[2, 2] + n[2] * box[3, 2]
    return gap, nx, ny, nz, nx * box[0, 0] + ny * box[0, 1] + nz * box[0, 2] + box_reach(box, n)


@kernel
def clamped(x: float, half: float) -> float:
    """Return the nearest point to a coordinate within half a size to either side."""
    return min(max(x, -half), half)


@kernel
def box_reach(box: Floats, m: Vector) -> float:
    """Return how far a box reaches from its middle along a direction that is given along its axes."""
    reach: float = abs(m[0]) * box[4, 0] + abs(m[1]) * box[4, 1] + abs(m[2]) * box[4, 2]
    return reach


@kernel
def walk_to_box(moving: MovingCore, box: Floats, w: float, near: float, begin: float, best: float) -> float:
    """Return a travel up to which a core, that is apart from a box until `begin`, stays farther than `w` from it.

    It is infinite if it does until `best`. Every step goes to a plane between the two, see `step_to_plane`, but ends
    where they are nearer than `near`, or after some steps.
    """
    s, placed = begin, moving.placed
    for _ in range(STEPS):
        place_core(moving, s)
        gap, nx, ny, nz, top = off_box(placed, moving.corners, box, placed[4:])
        if gap - w <= near:
            return s
        s += step_to_plane(moving, nx, ny, nz, top + w + 0.5 * near, s, best - s)
        if s >= best:
            return math.inf
    return s


@kernel
def put_rectangle(corners: Floats, box: Floats) -> None:
    """Write a box without height around a rectangle, whose corners are given in order, (4, 3)."""
    u = edge_half(corners, 1)
    v = edge_half(corners, 3)
    first, third = square_axes(u, v)
    second = cross(third, first)
    for r in range(3):
        box[0, r] = 0.5 * (corners[0, r] + corners[2, r])
        box[1, r], box[2, r], box[3, r] = first[r], second[r], third[r]
    box[4, 0] = abs(dot(first, u)) + abs(dot(first, v))
    box[4, 1], box[4, 2] = abs(dot(second, v)), 0.0


@kernel
def edge_half(corners: Floats, k: int) -> Vector:
    """Return half of the way from the first corner to corner `k`."""
    a, b = corners[0], corners[k]
    return 0.5 * (b[0] - a[0]), 0.5 * (b[1] - a[1]), 0.5 * (b[2] - a[2])


@kernel
def walk_rectangle(pair: CorePair, box: Floats, near: float, begin: float, best: float) -> float:
    """Return what `walk_to_box` does, for a rectangle that moves towards a resting core.

    Args:
        pair: whose moving core is the rectangle, its corners in order. box: scratch space, (5, 3).
    """
    moving, fixed, kb, w = pair.moving, pair.fixed, pair.corners, pair.w
    s, placed = begin, moving.placed
    for _ in range(STEPS):
        place_core(moving, s)
        put_rectangle(placed, box)
        gap, nx, ny, nz, _ = off_box(fixed, kb, box, placed[4:])
        if gap - w <= near:
            return s
        offset = plane_offset(fixed, kb, -nx, -ny, -nz) + w + 0.5 * near
        s += step_to_plane(moving, -nx, -ny, -nz, offset, s, best - s)
        if s >= best:
            return math.inf
    return s
