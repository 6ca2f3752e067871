"""Closest point on a mesh, and whether a point lies inside it, through the mesh's tree."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import STACK_SIZE, Floats, Ints, MeshTree

from .winding import winds_around

Point = tuple[float, float, float]

#: Three fixed directions for rays, in general position: no component is 0, none is a simple fraction of another.
_RAYS = np.array(
    [
        [0.5345224838248488, 0.2672612419124244, 0.8017837257372732],
        [-0.7312722147536012, 0.6218127413511079, 0.2803452183126441],
        [0.2113248654051871, -0.8932163721455103, -0.3969081252730811],
    ]
)


@entry_kernel
def signed_distance(tree: MeshTree, p: Any, closed: bool) -> float:
    """Return the distance from a point to the mesh [m], negative inside; infinite for a mesh without triangles.

    Args:
        tree: the mesh.
        p: the point in the mesh's frame [m], three numbers.
        closed: the mesh is watertight with outward normals.
    """
    distance = math.sqrt(closest_point(tree, p, np.inf)[0])
    return -distance if is_inside(tree, p, closed) else distance


@entry_kernel(allocates=True)
def closest_point(tree: MeshTree, p: Any, bound: float) -> tuple[float, int, float, float, float]:
    """Return the squared distance, triangle and coordinates of the point of the mesh closest to `p`.

    Args:
        tree: the mesh.
        p: the point in the mesh's frame [m], three numbers.
        bound: only points nearer than this count [m].

    Returns:
        squared distance [m²], triangle in tree order, x, y, z [m]; infinite and -1 when nothing is near enough.
    """
    stack = np.empty(STACK_SIZE, dtype=np.int32)
    found: tuple[float, int, float, float, float] = closest_within(tree, (p[0], p[1], p[2]), bound, stack)
    return found


@kernel
def closest_within(tree: MeshTree, p: Point, bound: float, stack: Ints) -> tuple[float, int, float, float, float]:
    """Do as `closest_point` with a stack of `STACK_SIZE` entries that the caller gives."""
    vertices, triangles, low, high = tree.vertices, tree.triangles, tree.low, tree.high
    first, count, right = tree.first, tree.count, tree.right
    best, best_triangle, x, y, z = bound * bound, -1, 0.0, 0.0, 0.0
    waiting = 0
    if low.shape[0] > 0:
        stack[0] = 0
        waiting = 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if _box_distance(low, high, node, p) >= best:
            continue
        if count[node] == 0:
            near, far = node + 1, right[node]
            near_squared, far_squared = _box_distance(low, high, near, p), _box_distance(low, high, far, p)
            if far_squared < near_squared:
                near, far, near_squared, far_squared = far, near, far_squared, near_squared
            if far_squared < best:
                stack[waiting] = far
                waiting += 1
            if near_squared < best:
                stack[waiting] = near
                waiting += 1
            continue
        for t in range(first[node], first[node] + count[node]):
            a, b, c = corners(vertices, triangles, t)
            q = closest_on_triangle(p, a, b, c)
            squared = (q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (q[2] - p[2]) ** 2
            if squared < best:
                best, best_triangle, x, y, z = squared, t, q[0], q[1], q[2]
    if best_triangle < 0:
        return np.inf, -1, 0.0, 0.0, 0.0
    return best, best_triangle, x, y, z


@entry_kernel
def is_inside(tree: MeshTree, p: Any, closed: bool) -> bool:
    """Say whether a point lies inside a mesh.

    For a closed mesh, the signed crossings of three rays in fixed directions decide by majority of two. If the rays
    disagree or hit an edge, and for open meshes, the winding number decides (more than one half in magnitude is
    inside).
    """
    if tree.low.shape[0] == 0:
        return False
    for k in range(3):
        # An open mesh has no inside beyond its box worth the name: its winding number falls below one half there.
        if p[k] < tree.low[0, k] or p[k] > tree.high[0, k]:
            return False
    q = (p[0], p[1], p[2])
    if closed:
        clear0, winding0 = _crossings(tree, q, 0)
        clear1, winding1 = _crossings(tree, q, 1)
        if clear0 and clear1 and winding0 == winding1:
            return bool(winding0 > 0)
        clear2, winding2 = _crossings(tree, q, 2)
        if clear2 and ((clear0 and winding0 == winding2) or (clear1 and winding1 == winding2)):
            return bool(winding2 > 0)
    return bool(winds_around(tree, q))


@kernel
def _crossings(tree: MeshTree, p: Point, ray: int) -> tuple[bool, int]:
    """Count the signed crossings of a ray from p with the mesh; say whether it met no edge and no vertex."""
    vertices, triangles, low, high = tree.vertices, tree.triangles, tree.low, tree.high
    first, count, skip = tree.first, tree.count, tree.skip
    dx, dy, dz = _RAYS[ray, 0], _RAYS[ray, 1], _RAYS[ray, 2]
    # Shear the ray onto z, so that an edge gives its two triangles the same sign (their products are the same bits).
    sx, sy = dx / dz, dy / dz
    ahead = 1.0 if dz > 0.0 else -1.0
    clear, winding, node = True, 0, 0
    while node < low.shape[0]:
        if _ray_misses(low, high, node, p, dx, dy, dz):
            node = skip[node]
            continue
        for t in range(first[node], first[node] + count[node]):
            a, b, c = corners(vertices, triangles, t)
            az, bz, cz = a[2] - p[2], b[2] - p[2], c[2] - p[2]
            ax, ay = a[0] - p[0] - sx * az, a[1] - p[1] - sy * az
            bx, by = b[0] - p[0] - sx * bz, b[1] - p[1] - sy * bz
            cx, cy = c[0] - p[0] - sx * cz, c[1] - p[1] - sy * cz
            u, v, w = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
            if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
                continue
            if u == 0.0 or v == 0.0 or w == 0.0:
                clear = False
                continue
            # u, v, w have one sign, that of the projected area: positive when the face looks along +z.
            depth = (u * az + v * bz + w * cz) * ahead
            if u > 0.0 and depth > 0.0:
                winding += 1 if ahead > 0.0 else -1
            elif u < 0.0 and depth < 0.0:
                winding -= 1 if ahead > 0.0 else -1
        node += 1
    return clear, winding


@kernel
def _ray_misses(low: Floats, high: Floats, node: int, p: Point, dx: float, dy: float, dz: float) -> bool:
    enter, leave = 0.0, np.inf
    slack = 1e-12 * (high[0, 0] - low[0, 0] + high[0, 1] - low[0, 1] + high[0, 2] - low[0, 2])
    t0, t1 = (low[node, 0] - slack - p[0]) / dx, (high[node, 0] + slack - p[0]) / dx
    enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    t0, t1 = (low[node, 1] - slack - p[1]) / dy, (high[node, 1] + slack - p[1]) / dy
    enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    t0, t1 = (low[node, 2] - slack - p[2]) / dz, (high[node, 2] + slack - p[2]) / dz
    enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    return bool(enter > leave)


@kernel
def _box_distance(low: Floats, high: Floats, node: int, p: Point) -> float:
    """Return the squared distance from a point to a node's box [m²]."""
    x = max(low[node, 0] - p[0], p[0] - high[node, 0], 0.0)
    y = max(low[node, 1] - p[1], p[1] - high[node, 1], 0.0)
    z = max(low[node, 2] - p[2], p[2] - high[node, 2], 0.0)
    return float(x * x + y * y + z * z)


@kernel
def corners(vertices: Floats, triangles: Ints, t: int) -> tuple[Point, Point, Point]:
    """Return the three corners of a triangle."""
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    return (
        (vertices[i, 0], vertices[i, 1], vertices[i, 2]),
        (vertices[j, 0], vertices[j, 1], vertices[j, 2]),
        (vertices[k, 0], vertices[k, 1], vertices[k, 2]),
    )


@entry_kernel
def closest_on_triangle(p: Point, a: Point, b: Point, c: Point) -> Point:
    """Return the point of a triangle closest to p, by its Voronoi regions: corners, edges, inside."""
    bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    cx, cy, cz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    qx, qy, qz = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3, d4 = bx * qx + by * qy + bz * qz, cx * qx + cy * qy + cz * qz
    if d3 >= 0.0 and d4 <= d3:
        return b
    third = d1 * d4 - d3 * d2
    if third <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3) if d1 > d3 else 0.0
        return a[0] + s * bx, a[1] + s * by, a[2] + s * bz
    rx, ry, rz = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5, d6 = bx * rx + by * ry + bz * rz, cx * rx + cy * ry + cz * rz
    if d6 >= 0.0 and d5 <= d6:
        return c
    second = d5 * d2 - d1 * d6
    if second <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s = d2 / (d2 - d6) if d2 > d6 else 0.0
        return a[0] + s * cx, a[1] + s * cy, a[2] + s * cz
    one = d3 * d6 - d5 * d4
    if one <= 0.0 and d4 >= d3 and d5 >= d6:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return b[0] + s * (cx - bx), b[1] + s * (cy - by), b[2] + s * (cz - bz)
    s, t = second / (one + second + third), third / (one + second + third)
    return a[0] + s * bx + t * cx, a[1] + s * by + t * cy, a[2] + s * bz + t * cz
