"""First contact of a mesh that moves along a line with a mesh at rest (docs/method.md section 4, *Approach*)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clench.kernels.geometry.mesh_distance import Point, corners
from clench.kernels.geometry.penetration import moved
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import STACK_SIZE, Floats, Ints, MeshTree

from .passing_planes import forget_passing, passes_triangle, passes_until, remember_passing

Masks = NDArray[np.uint8]
Triple = tuple[Point, Point, Point]

#: Foot tests are closed and widened by this fraction.
_FOOT = 1e-12
#: Projections thinner than this fraction are edge-on to the motion: no event, their neighbours give it.
_EDGE_ON = 1e-14
#: Pairs of nodes that wait at most.
PAIRS = 2 * STACK_SIZE


@entry_kernel
def first_contact(
    moving: MeshTree,
    moving_owners: Masks,
    T_rest_moving: Floats,
    rest: MeshTree,
    rest_owners: Masks,
    direction: Floats,
    limit: float,
    stack: Ints,
    planes: Floats,
) -> tuple[float, int, int]:
    """Return how far a mesh moves along a direction until it first touches another.

    Events: moving vertex on face, moving face on vertex, edge on edge; all are linear in the distance. Pairs of nodes
    are visited nearest first, and left when they cannot meet before the best contact so far. Their boxes tell it, or a
    plane across the motion, or one along a triangle of a contact.

    Args:
        moving: the moving mesh.
        moving_owners: `feature_owners` of it.
        T_rest_moving: maps its coordinates at the start to those of the mesh at rest, shape (3, 4).
        rest: the mesh at rest.
        rest_owners: `feature_owners` of it.
        direction: unit vector in the frame of the mesh at rest, shape (3,).
        limit: contacts farther than this are of no interest [m].
        stack: scratch, shape (PAIRS, 2). planes: scratch, shape (PLANES, COLUMNS) of `passing_planes`.

    Returns:
        distance [m], infinite when there is no contact before `limit`; the triangles of both in tree order, or -1.
        Meshes that overlap at the start give their first contact of surfaces, which means little.
    """
    best, moving_triangle, rest_triangle = limit, -1, -1
    if moving.low.shape[0] == 0 or rest.low.shape[0] == 0:
        return np.inf, -1, -1
    along = _frame(direction)
    # A meeting that lies behind only by rounding is a contact at the start.
    slack = _FOOT * (_reach(moving.low, moving.high) + _reach(rest.low, rest.high))
    slack += _FOOT * (abs(T_rest_moving[0, 3]) + abs(T_rest_moving[1, 3]) + abs(T_rest_moving[2, 3]))
    forget_passing(planes)
    remember_passing((direction[0], direction[1], direction[2]), moving, T_rest_moving, direction, planes)
    stack[0, 0], stack[0, 1] = 0, 0
    waiting = 1
    while waiting:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if passes_until(moving, a, rest, b, slack, best, planes):
            continue
        if _entry(moving.low, moving.high, a, T_rest_moving, rest.low, rest.high, b, direction) >= best:
            continue
        if moving.count[a] and rest.count[b]:
            before = best
            best, moving_triangle, rest_triangle = _meet_leaves(
                moving,
                moving_owners,
                T_rest_moving,
                rest,
                rest_owners,
                (a, b),
                along,
                slack,
                (best, moving_triangle, rest_triangle),
                planes,
            )
            if best < before:
                _remember_triangles(moving, moving_triangle, T_rest_moving, rest, rest_triangle, direction, planes)
            continue
        descend = rest.count[b] > 0 or (moving.count[a] == 0 and _size(moving, a) > _size(rest, b))
        c, d = (a + 1, b) if descend else (a, b + 1)
        e, f = (moving.right[a], b) if descend else (a, rest.right[b])
        near = _entry(moving.low, moving.high, c, T_rest_moving, rest.low, rest.high, d, direction)
        far = _entry(moving.low, moving.high, e, T_rest_moving, rest.low, rest.high, f, direction)
        if far < near:
            c, d, e, f, near, far = e, f, c, d, far, near
        if far < best:
            stack[waiting, 0], stack[waiting, 1] = e, f
            waiting += 1
        if near < best:
            stack[waiting, 0], stack[waiting, 1] = c, d
            waiting += 1
    if moving_triangle < 0:
        return np.inf, -1, -1
    return best, moving_triangle, rest_triangle


@kernel
def _remember_triangles(
    moving: MeshTree, i: int, T: Floats, rest: MeshTree, j: int, direction: Floats, planes: Floats
) -> None:
    """Remember the planes of two triangles that meet."""
    m, n = moving.normals[i], rest.normals[j]
    turned = (
        T[0, 0] * m[0] + T[0, 1] * m[1] + T[0, 2] * m[2],
        T[1, 0] * m[0] + T[1, 1] * m[1] + T[1, 2] * m[2],
        T[2, 0] * m[0] + T[2, 1] * m[1] + T[2, 2] * m[2],
    )
    remember_passing(turned, moving, T, direction, planes)
    remember_passing((n[0], n[1], n[2]), moving, T, direction, planes)


@kernel
def _frame(direction: Floats) -> Triple:
    """Return rows of a rotation that maps the direction to z."""
    z = (direction[0], direction[1], direction[2])
    # The axis least along the direction gives a well-conditioned cross product.
    if abs(z[0]) <= abs(z[1]) and abs(z[0]) <= abs(z[2]):
        x = (0.0, z[2], -z[1])
    elif abs(z[1]) <= abs(z[2]):
        x = (-z[2], 0.0, z[0])
    else:
        x = (z[1], -z[0], 0.0)
    n = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    x = (x[0] / n, x[1] / n, x[2] / n)
    y = (z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0])
    return x, y, z


@kernel
def _size(tree: MeshTree, node: int) -> float:
    x = tree.high[node, 0] - tree.low[node, 0]
    y = tree.high[node, 1] - tree.low[node, 1]
    z = tree.high[node, 2] - tree.low[node, 2]
    return float(x * x + y * y + z * z)


@kernel
def _entry(low: Floats, high: Floats, a: int, T: Floats, low_b: Floats, high_b: Floats, b: int, d: Floats) -> float:
    """Return the distance after which the boxes of two nodes can meet, 0 or more; infinite when they never do."""
    cx, cy, cz = 0.5 * (low[a, 0] + high[a, 0]), 0.5 * (low[a, 1] + high[a, 1]), 0.5 * (low[a, 2] + high[a, 2])
    hx, hy, hz = high[a, 0] - cx, high[a, 1] - cy, high[a, 2] - cz
    enter, leave = 0.0, np.inf
    slack = 1e-12 * (abs(T[0, 3]) + abs(T[1, 3]) + abs(T[2, 3]) + _reach(low, high) + _reach(low_b, high_b))
    for k in range(3):
        center = T[k, 0] * cx + T[k, 1] * cy + T[k, 2] * cz + T[k, 3] - 0.5 * (low_b[b, k] + high_b[b, k])
        half = abs(T[k, 0]) * hx + abs(T[k, 1]) * hy + abs(T[k, 2]) * hz + slack
        half += 0.5 * (high_b[b, k] - low_b[b, k])
        if abs(d[k]) < 1e-15:
            if abs(center) > half:
                return np.inf
        else:
            s, t = (-half - center) / d[k], (half - center) / d[k]
            enter, leave = max(enter, min(s, t)), min(leave, max(s, t))
    return enter if enter <= leave else np.inf


@kernel
def _reach(low: Floats, high: Floats) -> float:
    most = 0.0
    for k in range(3):
        most = max(most, abs(low[0, k]), abs(high[0, k]))
    return most


@kernel
def _meet_leaves(
    moving: MeshTree,
    moving_owners: Masks,
    T: Floats,
    rest: MeshTree,
    rest_owners: Masks,
    leaves: tuple[int, int],
    along: Triple,
    slack: float,
    found: tuple[float, int, int],
    planes: Floats,
) -> tuple[float, int, int]:
    """Return the best contact so far after all pairs of triangles of two leaves; `found`: before."""
    a, b = leaves
    best, moving_triangle, rest_triangle = found
    for j in range(rest.first[b], rest.first[b] + rest.count[b]):
        u, v, w = corners(rest.vertices, rest.triangles, j)
        if passes_triangle(moving, a, (u, v, w), slack, best, planes):
            continue
        two = (_turn(along, u), _turn(along, v), _turn(along, w))
        for i in range(moving.first[a], moving.first[a] + moving.count[a]):
            u, v, w = corners(moving.vertices, moving.triangles, i)
            one = (_turn(along, moved(T, u)), _turn(along, moved(T, v)), _turn(along, moved(T, w)))
            if _apart(one, two, best):
                continue
            distance = _meet(one, moving_owners[i], two, rest_owners[j], slack)
            if distance < best:
                best, moving_triangle, rest_triangle = distance, i, j
    return best, moving_triangle, rest_triangle


@kernel
def _turn(rows: Triple, p: Point) -> Point:
    x, y, z = rows
    return (
        x[0] * p[0] + x[1] * p[1] + x[2] * p[2],
        y[0] * p[0] + y[1] * p[1] + y[2] * p[2],
        z[0] * p[0] + z[1] * p[1] + z[2] * p[2],
    )


@kernel
def _apart(one: Triple, two: Triple, best: float) -> bool:
    """Say whether two triangles pass each other, or meet after `best` only."""
    a, b, c = one
    d, e, f = two
    size = max(abs(a[0]), abs(a[1]), abs(a[2]), abs(d[0]), abs(d[1]), abs(d[2]))
    slack = _FOOT * size
    if min(a[0], b[0], c[0]) > max(d[0], e[0], f[0]) + slack or max(a[0], b[0], c[0]) < min(d[0], e[0], f[0]) - slack:
        return True
    if min(a[1], b[1], c[1]) > max(d[1], e[1], f[1]) + slack or max(a[1], b[1], c[1]) < min(d[1], e[1], f[1]) - slack:
        return True
    return min(d[2], e[2], f[2]) - max(a[2], b[2], c[2]) > best or max(d[2], e[2], f[2]) < min(a[2], b[2], c[2]) - slack


@kernel
def _meet(one: Triple, one_owns: int, two: Triple, two_owns: int, slack: float) -> float:
    """Return the distance at which two triangles first touch by the features that they own; infinite for none."""
    best = np.inf
    a, b, c = one
    d, e, f = two
    for k in range(3):
        if one_owns & (1 << k):
            best = min(best, _earlier(_height_over(a, d, e, f), slack))
        if two_owns & (1 << k):
            best = min(best, _earlier(-_height_over(d, one[0], one[1], one[2]), slack))
        if one_owns & (8 << k):
            if two_owns & 8:
                best = min(best, _earlier(_edges(a, b, two[0], two[1]), slack))
            if two_owns & 16:
                best = min(best, _earlier(_edges(a, b, two[1], two[2]), slack))
            if two_owns & 32:
                best = min(best, _earlier(_edges(a, b, two[2], two[0]), slack))
        a, b, c = b, c, a
        d, e, f = e, f, d
    return best


@kernel
def _earlier(distance: float, slack: float) -> float:
    """Return a distance as it counts: not a number is none, and what lies behind by rounding only is 0."""
    if distance >= 0.0:
        return distance
    return 0.0 if distance >= -slack else np.inf


@kernel
def _height_over(p: Point, a: Point, b: Point, c: Point) -> float:
    """Return how far above p, along z, a triangle lies; not a number when it does not."""
    ax, ay, bx, by, cx, cy = a[0] - p[0], a[1] - p[1], b[0] - p[0], b[1] - p[1], c[0] - p[0], c[1] - p[1]
    u, v, w = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    area = u + v + w
    longest = max((bx - ax) ** 2 + (by - ay) ** 2, (cx - bx) ** 2 + (cy - by) ** 2, (ax - cx) ** 2 + (ay - cy) ** 2)
    if abs(area) <= _EDGE_ON * longest:
        return np.nan
    if area < 0.0:
        u, v, w = -u, -v, -w
    if min(u, v, w) < -_FOOT * longest:
        return np.nan
    u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    return (u * (a[2] - p[2]) + v * (b[2] - p[2]) + w * (c[2] - p[2])) / (u + v + w)


@kernel
def _edges(a: Point, b: Point, c: Point, d: Point) -> float:
    """Return how far above the edge ab, along z, the edge cd lies where they cross; not a number when they do not."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    area = ux * vy - uy * vx
    if abs(area) <= _EDGE_ON * np.sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy)):
        return np.nan
    wx, wy = c[0] - a[0], c[1] - a[1]
    s, t = (wx * vy - wy * vx) / area, (wx * uy - wy * ux) / area
    if s < -_FOOT or s > 1.0 + _FOOT or t < -_FOOT or t > 1.0 + _FOOT:
        return np.nan
    s, t = min(max(s, 0.0), 1.0), min(max(t, 0.0), 1.0)
    return (c[2] + t * (d[2] - c[2])) - (a[2] + s * (b[2] - a[2]))
