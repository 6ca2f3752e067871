"""Cut a triangle mesh by a curl plane: the object's perimeter curve as segments (docs/method.md section 2)."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from clench.kernels.runtime.by_reference import kept
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import Floats, Ints, MeshTree, build_tree

Row = tuple[float, float, float, float]
Point = tuple[float, float, float]
Flat = tuple[float, float]

#: A vertex lies on the plane up to this fraction of the largest coordinate.
_ON_PLANE = 1e-12
#: Segments shorter than this fraction of the largest coordinate take their normal from the face.
_SHORT = 1e-12


class _Triangles(Protocol):
    @property
    def vertices(self) -> Floats: ...

    @property
    def triangles(self) -> Any: ...


def cut_mesh(
    mesh: MeshTree | _Triangles, T_axis_group_object: ArrayLike, offset: float, reach: float = np.inf
) -> tuple[Floats, Ints]:
    """Cut a mesh by a plane and return segments and their triangles: `cut`, with buffers that grow.

    Args:
        mesh: a tree, or anything with `vertices` and `triangles`.
        T_axis_group_object: maps the mesh's coordinates to the axis group's, shape (3, 4) or (4, 4).
        offset: the plane is `y_axis_group = offset` [m].
        reach: see `cut` [m].

    Returns:
        segments as `cut` writes them, shape (S, 6); triangles of the mesh in the order of the input, shape (S,).
    """
    tree = mesh if isinstance(mesh, MeshTree) else build_tree(mesh.vertices, mesh.triangles)
    T = np.ascontiguousarray(np.asarray(T_axis_group_object, dtype=np.float64)[:3])
    offsets, counts, wanted = np.array([offset], dtype=np.float64), np.zeros((1, 3), dtype=np.int64), 256
    while wanted:
        capacity = wanted
        segments, sources = np.empty((1, capacity, 6)), np.empty((1, capacity), dtype=np.int64)
        wanted = cut(kept(tree), T, offsets, (0, 1), float(reach), segments, sources, counts, 0, capacity)
    found = counts[0, 0]
    return segments[0, :found].copy(), tree.original[sources[0, :found]]


@entry_kernel
def cut(
    tree: MeshTree,
    T: Floats,
    offsets: Floats,
    planes: tuple[int, int],
    reach: float,
    segments: Floats,
    sources: Any,
    counts: Any,
    base: int,
    capacity: int,
) -> int:
    """Cut a mesh by parallel planes `y_axis_group = offset`; write one segment per plane and triangle that crosses it.

    The sign of each vertex against a plane decides (a above, o on, b below; any order of the three):

    =========  =======================================  ==================================================
    signs      segment                                  why
    =========  =======================================  ==================================================
    a a a      none                                     no common point
    b b b      none                                     no common point
    o o o      none                                     its neighbours give its border
    o o a      the edge between the two on the plane    so does o o b: either neighbour may be the only one
    o o b      the edge between the two on the plane    the same, mirrored
    o a a      none                                     a point, which its neighbours give
    o b b      none                                     the same, mirrored
    o a b      from the vertex to the crossing          one edge crosses
    a a b      between two crossings                    two edges cross
    a b b      between two crossings                    the same, mirrored
    =========  =======================================  ==================================================

    The crossing of an edge is symmetric in its end points, so both of its triangles give the same bits.
    Triangles without area give nothing. The tree is walked once for all planes.

    Args:
        tree: the mesh in the object's frame.
        T: `T_axis_group_object`, shape (3, 4).
        offsets: of all planes [m], (P,). planes: the range of those that cut.
        reach: segments farther than this from the axis group's origin, in the plane, are left out [m].
        segments: row `plane - base` gets rows `[ax, az, bx, bz, nx, nz]`, normal unit and outward, shape (P, C, 6).
        sources: written with each segment's triangle in tree order, shape (P, C).
        counts: whose first column gets the number of segments; 0 where there were too many, shape (P, >= 1).
        capacity: how many segments a row may get, at most C.

    Returns:
        0, or the capacity that would have sufficed.
    """
    # Fields and entries are taken out once, and no array is handed on in the loop: either costs more than the geometry.
    low, high = planes
    vertices, triangles, normals = tree.vertices, tree.triangles, tree.normals
    first, count, skip, least, most = tree.first, tree.count, tree.skip, tree.low, tree.high
    x_row = (T[0, 0], T[0, 1], T[0, 2], T[0, 3])
    y_row = (T[1, 0], T[1, 1], T[1, 2], T[1, 3])
    z_row = (T[2, 0], T[2, 1], T[2, 2], T[2, 3])
    scale = _start_counts(tree, abs(T[1, 3]), offsets, low, high, counts, base)
    on, node, nodes = _ON_PLANE * scale, 0, least.shape[0]
    while node < nodes:
        lx, ly, lz = least[node, 0], least[node, 1], least[node, 2]
        hx, hy, hz = 0.5 * (most[node, 0] - lx), 0.5 * (most[node, 1] - ly), 0.5 * (most[node, 2] - lz)
        center = (lx + hx, ly + hy, lz + hz)
        y, near, crossed = _map(y_row, center), _span(y_row, hx, hy, hz) + 2.0 * on, False
        for plane in range(low, high):
            crossed = crossed or abs(y - offsets[plane]) <= near
        if not crossed or _out_of_reach(center, hx, hy, hz, x_row, z_row, reach, 2.0 * on):
            node = skip[node]
            continue
        for t in range(first[node], first[node] + count[node]):
            i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            a = (vertices[i, 0], vertices[i, 1], vertices[i, 2])
            b = (vertices[j, 0], vertices[j, 1], vertices[j, 2])
            c = (vertices[k, 0], vertices[k, 1], vertices[k, 2])
            ya, yb, yc = _map(y_row, a), _map(y_row, b), _map(y_row, c)
            below, above = min(ya, yb, yc) - on, max(ya, yb, yc) + on
            for plane in range(low, high):
                offset = offsets[plane]
                if below > offset or above < offset:
                    continue
                p, q, r = (
                    (_map(x_row, a), _map(z_row, a)),
                    (_map(x_row, b), _map(z_row, b)),
                    (_map(x_row, c), _map(z_row, c)),
                )
                ends, ax, az, bx, bz = _segment(p, q, r, ya - offset, yb - offset, yc - offset, on)
                if ends == 2 and _within(ax, az, bx, bz, reach):
                    m = (normals[t, 0], normals[t, 1], normals[t, 2], 0.0)
                    nx, nz = _normal(ax, az, bx, bz, _dot(x_row, m), _dot(z_row, m), _SHORT * scale)
                    if nx != 0.0 or nz != 0.0:
                        row = plane - base
                        found = counts[row, 0]
                        counts[row, 0] = found + 1
                        if found < capacity:
                            segments[row, found, 0], segments[row, found, 1] = ax, az
                            segments[row, found, 2], segments[row, found, 3] = bx, bz
                            segments[row, found, 4], segments[row, found, 5] = nx, nz
                            sources[row, found] = t
        node += 1
    return int(_end_counts(low - base, high - base, counts, capacity))


@kernel
def _start_counts(tree: MeshTree, scale: float, offsets: Floats, low: int, high: int, counts: Any, base: int) -> float:
    """Set the counts of planes to 0; return the largest coordinate, at least `scale` [m]."""
    for plane in range(low, high):
        scale = max(scale, abs(offsets[plane]))
        counts[plane - base, 0] = 0
    for k in range(3 if tree.low.shape[0] else 0):
        scale = max(scale, abs(tree.low[0, k]), abs(tree.high[0, k]))
    return scale


@kernel
def _end_counts(first: int, last: int, counts: Any, capacity: int) -> int:
    """Return the largest count above the capacity, else 0; rows with too many segments have none."""
    wanted = 0
    for row in range(first, last):
        if counts[row, 0] > capacity:
            wanted = max(wanted, counts[row, 0])
            counts[row, 0] = 0
    return wanted


@kernel
def _span(row: Row, hx: float, hy: float, hz: float) -> float:
    """Return how far a box with some half extents gets from its centre in a direction."""
    return abs(row[0]) * hx + abs(row[1]) * hy + abs(row[2]) * hz


@kernel
def _out_of_reach(
    center: Point, hx: float, hy: float, hz: float, x_row: Row, z_row: Row, reach: float, slack: float
) -> bool:
    """Say whether a box stays farther than `reach` from the axis group's origin, in the plane."""
    if reach == np.inf:
        return False
    x = max(abs(_map(x_row, center)) - _span(x_row, hx, hy, hz) - slack, 0.0)
    z = max(abs(_map(z_row, center)) - _span(z_row, hx, hy, hz) - slack, 0.0)
    return x * x + z * z > reach * reach


@kernel
def _segment(
    p: Flat, q: Flat, r: Flat, da: float, db: float, dc: float, on: float
) -> tuple[int, float, float, float, float]:
    """Return the number of end points on the plane (2: a segment) and the two (x, z).

    Args:
        p, q, r: the vertices in the plane. da, db, dc: their distances from it. on: up to which they lie on it.
    """
    if abs(da) > on and abs(db) > on and abs(dc) > on:
        # No vertex on the plane, the common case: two edges cross, those of the vertex that is alone on its side.
        if (da > 0.0) == (db > 0.0):
            p, r, da, dc = r, p, dc, da
        elif (da > 0.0) == (dc > 0.0):
            p, q, da, db = q, p, db, da
        u, v = _crossing(p, q, abs(da), abs(db)), _crossing(p, r, abs(da), abs(dc))
        return 2, u[0], u[1], v[0], v[1]
    da = 0.0 if abs(da) <= on else da
    db = 0.0 if abs(db) <= on else db
    dc = 0.0 if abs(dc) <= on else dc
    if da == 0.0 and db == 0.0 and dc == 0.0:
        return 0, 0.0, 0.0, 0.0, 0.0
    # Each vertex on the plane and each edge with an end on either side gives one end point.
    ends, u, v = 0, p, p
    if da == 0.0:
        ends, u, v = _add(ends, u, v, p)
    if db == 0.0:
        ends, u, v = _add(ends, u, v, q)
    if dc == 0.0:
        ends, u, v = _add(ends, u, v, r)
    if da * db < 0.0:
        ends, u, v = _add(ends, u, v, _crossing(p, q, abs(da), abs(db)))
    if db * dc < 0.0:
        ends, u, v = _add(ends, u, v, _crossing(q, r, abs(db), abs(dc)))
    if dc * da < 0.0:
        ends, u, v = _add(ends, u, v, _crossing(r, p, abs(dc), abs(da)))
    return ends, u[0], u[1], v[0], v[1]


@kernel
def _dot(row: Row, m: Row) -> float:
    return row[0] * m[0] + row[1] * m[1] + row[2] * m[2]


@kernel
def _map(row: Row, p: Point) -> float:
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]


@kernel
def _add(ends: int, u: Flat, v: Flat, point: Flat) -> tuple[int, Flat, Flat]:
    if ends == 0:
        return 1, point, v
    return ends + 1, u, point


@kernel
def _crossing(p: Flat, q: Flat, dp: float, dq: float) -> Flat:
    """Return the point between p and q at distances dp and dq from the plane: the same bits with both exchanged."""
    share = 1.0 / (dp + dq)
    return (p[0] * dq + q[0] * dp) * share, (p[1] * dq + q[1] * dp) * share


@kernel
def _within(ax: float, az: float, bx: float, bz: float, reach: float) -> bool:
    """Say whether a segment comes as near to the origin as `reach`."""
    if ax * ax + az * az <= reach * reach:
        return True
    ux, uz = bx - ax, bz - az
    squared = ux * ux + uz * uz
    s = 0.0
    if squared > 0.0:
        s = min(max(-(ax * ux + az * uz) / squared, 0.0), 1.0)
    x, z = ax + s * ux, az + s * uz
    return x * x + z * z <= reach * reach


@kernel
def _normal(ax: float, az: float, bx: float, bz: float, fx: float, fz: float, short: float) -> Flat:
    """Return the unit normal of a segment on the side of the face's projected normal; zero without one."""
    if fx == 0.0 and fz == 0.0:
        return 0.0, 0.0
    nx, nz = az - bz, bx - ax
    length = math.sqrt(nx * nx + nz * nz)
    side = nx * fx + nz * fz
    if length <= short or side == 0.0:
        length = math.sqrt(fx * fx + fz * fz)
        return fx / length, fz / length
    share = 1.0 / length if side > 0.0 else -1.0 / length
    return nx * share, nz * share
