"""Measure how deep two meshes overlap: the deepest surface point of one inside the other (docs/method.md section 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import Floats, Ints, MeshTree

from .mesh_distance import Point, closest_within, corners, is_inside

Masks = NDArray[np.uint8]
Deepest = tuple[float, Point]
Scratch = tuple[Floats, Ints]

#: Entries that `penetration` needs for the crossings of one edge; an edge with more is sampled up to the last of them.
CROSSINGS = 64


@entry_kernel
def penetration(
    link: MeshTree,
    link_owners: Masks,
    link_closed: bool,
    obj: MeshTree,
    obj_owners: Masks,
    obj_closed: bool,
    T_obj_link: Floats,
    T_link_obj: Floats,
    limit: float,
    scratch: Scratch,
) -> tuple[float, float, float, float]:
    """Return the depth of penetration of a link and an object, and its place.

    Depth is the largest distance from a point of the link's surface inside the object to the object's surface, or the
    same the other way round. Points looked at: vertices, triangle centres, and the middle of every piece of an edge
    between two crossings of the other surface; so it is exact at vertices and never too large.

    The search ends at the first point that is `limit` deep. Far inside a large object the triangles of its surface are
    all about as far away, and to find the nearest of them takes as long as to look at each.

    Args:
        link: the link's mesh.
        link_owners: `feature_owners` of it.
        link_closed: it is watertight with outward normals.
        obj: the object's mesh.
        obj_owners: `feature_owners` of it.
        obj_closed: it is watertight with outward normals.
        T_obj_link: maps the link's coordinates to the object's, shape (3, 4).
        T_link_obj: its inverse, shape (3, 4).
        limit: the largest depth that is told apart [m].
        scratch: two arrays, shapes (CROSSINGS,) and (STACK_SIZE,).

    Returns:
        depth [m], at most `limit`, 0 when disjoint or just touching, and the place x, y, z in the object's frame [m].
    """
    depth, p = _deepest(link, link_owners, T_obj_link, obj, obj_closed, 0.0, limit, scratch)
    other, q = _deepest(obj, obj_owners, T_link_obj, link, link_closed, depth, limit, scratch)
    if other > depth:
        x, y, z = moved(T_obj_link, q)
        return other, x, y, z
    return depth, p[0], p[1], p[2]


@kernel
def moved(T: Floats, p: Point) -> Point:
    """Map a point by a transform, shape (3, 4)."""
    return (
        T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3],
        T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3],
        T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3],
    )


@kernel
def _deepest(
    a: MeshTree,
    owners: Masks,
    T: Floats,
    b: MeshTree,
    closed: bool,
    best: float,
    limit: float,
    scratch: Scratch,
) -> Deepest:
    """Return depth and place (in b's frame) of the point of a's surface deepest inside b, if deeper than `best`."""
    stack = scratch[1]
    vertices, triangles, low, high = a.vertices, a.triangles, a.low, a.high
    first, count, skip = a.first, a.count, a.skip
    place = (0.0, 0.0, 0.0)
    node = 0
    while node < low.shape[0] and best < limit:
        hx, hy = 0.5 * (high[node, 0] - low[node, 0]), 0.5 * (high[node, 1] - low[node, 1])
        hz = 0.5 * (high[node, 2] - low[node, 2])
        center = moved(T, (low[node, 0] + hx, low[node, 1] + hy, low[node, 2] + hz))
        if _is_shallow(b, center, np.sqrt(hx * hx + hy * hy + hz * hz), closed, best, stack):
            node = skip[node]
            continue
        for t in range(first[node], first[node] + count[node]):
            p, q, r = corners(vertices, triangles, t)
            p, q, r = moved(T, p), moved(T, q), moved(T, r)
            middle = ((p[0] + q[0] + r[0]) / 3.0, (p[1] + q[1] + r[1]) / 3.0, (p[2] + q[2] + r[2]) / 3.0)
            best, place = _deeper(b, middle, closed, best, limit, place, stack)
            for k in range(3):
                if owners[t] & (1 << k):
                    best, place = _deeper(b, p, closed, best, limit, place, stack)
                if owners[t] & (8 << k):
                    best, place = _deeper_on_edge(b, p, q, closed, best, limit, place, scratch)
                p, q, r = q, r, p
        node += 1
    return best, place


@kernel
def _is_shallow(b: MeshTree, center: Point, radius: float, closed: bool, best: float, stack: Ints) -> bool:
    """Say whether no point of a ball can be deeper inside b than `best`: depth changes no faster than place."""
    if b.low.shape[0] == 0:
        return True
    outside = 0.0
    for k in range(3):
        outside = max(outside, b.low[0, k] - center[k], center[k] - b.high[0, k])
    if outside >= radius:
        return True
    squared = closest_within(b, center, radius + best, stack)[0]
    distance = np.sqrt(squared)
    if distance < radius - best:
        return False
    if is_inside(b, center, closed):
        return bool(distance + radius <= best)
    return True


@kernel
def _deeper(b: MeshTree, p: Point, closed: bool, best: float, limit: float, place: Point, stack: Ints) -> Deepest:
    """Return the deeper of `best` and the depth of p inside b up to `limit`, with its place."""
    if best >= limit:
        return best, place
    if best > 0.0 and closest_within(b, p, best, stack)[1] >= 0:
        return best, place
    if not is_inside(b, p, closed):
        return best, place
    depth = min(np.sqrt(closest_within(b, p, limit, stack)[0]), limit)
    if depth > best:
        return depth, p
    return best, place


@kernel
def _deeper_on_edge(
    b: MeshTree,
    p: Point,
    q: Point,
    closed: bool,
    best: float,
    limit: float,
    place: Point,
    scratch: Scratch,
) -> Deepest:
    """Look at the middle of every piece of the edge pq between crossings with b."""
    crossings, stack = scratch
    number = _cross_edge(b, p, q, crossings)
    if number == 0:
        return best, place
    start = 0.0
    for i in range(number + 1):
        end = crossings[i] if i < number else 1.0
        s = 0.5 * (start + end)
        if end > start:
            middle = (p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]), p[2] + s * (q[2] - p[2]))
            best, place = _deeper(b, middle, closed, best, limit, place, stack)
        start = end
    return best, place


@kernel
def _cross_edge(b: MeshTree, p: Point, q: Point, crossings: Floats) -> int:
    """Write where the edge pq crosses b, as fractions of its length in ascending order; return how often."""
    vertices, triangles, low, high = b.vertices, b.triangles, b.low, b.high
    first, count, skip = b.first, b.count, b.skip
    number, node = 0, 0
    while node < low.shape[0]:
        if _edge_misses(low, high, node, p, q):
            node = skip[node]
            continue
        for t in range(first[node], first[node] + count[node]):
            u, v, w = corners(vertices, triangles, t)
            s = _cross_triangle(p, q, u, v, w)
            if s >= 0.0 and number < CROSSINGS:
                at = number
                while at > 0 and crossings[at - 1] > s:
                    crossings[at] = crossings[at - 1]
                    at -= 1
                crossings[at] = s
                number += 1
        node += 1
    return number


@kernel
def _edge_misses(low: Floats, high: Floats, node: int, p: Point, q: Point) -> bool:
    enter, leave = 0.0, 1.0
    for k in range(3):
        d = q[k] - p[k]
        if d == 0.0:
            if p[k] < low[node, k] or p[k] > high[node, k]:
                return True
        else:
            s, t = (low[node, k] - p[k]) / d, (high[node, k] - p[k]) / d
            # Widened, so that rounding does not lose a flat box.
            enter, leave = max(enter, min(s, t) - 1e-12), min(leave, max(s, t) + 1e-12)
    return enter > leave


@kernel
def _cross_triangle(p: Point, q: Point, a: Point, b: Point, c: Point) -> float:
    """Return where the edge pq crosses a triangle, as a fraction of its length; -1 when it does not."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    hx, hy, hz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    volume = ux * hx + uy * hy + uz * hz
    if volume == 0.0:
        return -1.0
    sx, sy, sz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    one = (sx * hx + sy * hy + sz * hz) / volume
    gx, gy, gz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    two = (dx * gx + dy * gy + dz * gz) / volume
    at = (vx * gx + vy * gy + vz * gz) / volume
    if one < 0.0 or two < 0.0 or one + two > 1.0 or at < 0.0 or at > 1.0:
        return -1.0
    return at
