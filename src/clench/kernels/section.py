"""Cut a triangle mesh by a curl plane: the object's perimeter curve as segments (METHOD.md section 2)."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .compiling import inner_kernel, kernel
from .tree import Floats, Ints, MeshTree, build_tree

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
    mesh: MeshTree | _Triangles, T_family_object: ArrayLike, offset: float, reach: float = np.inf
) -> tuple[Floats, Ints]:
    """Cut a mesh by a plane and return segments and their triangles: `cut`, with buffers that grow.

    Args:
        mesh: a tree, or anything with `vertices` and `triangles`.
        T_family_object: maps the mesh's coordinates to the plane family's, shape (3, 4) or (4, 4).
        offset: the plane is `y_family = offset` [m].
        reach: see `cut` [m].

    Returns:
        segments as `cut` writes them, shape (S, 6); triangles of the mesh in the order of the input, shape (S,).
    """
    tree = mesh if isinstance(mesh, MeshTree) else build_tree(mesh.vertices, mesh.triangles)
    T = np.ascontiguousarray(np.asarray(T_family_object, dtype=np.float64)[:3])
    capacity = 256
    while True:
        segments = np.empty((capacity, 6))
        sources = np.empty(capacity, dtype=np.int32)
        count = cut(tree, T, float(offset), float(reach), segments, sources)
        if count >= 0:
            return segments[:count].copy(), tree.original[sources[:count]]
        capacity = -count


@kernel
def cut(tree: MeshTree, T: Floats, offset: float, reach: float, segments: Floats, sources: Ints) -> int:
    """Cut a mesh by the plane `y_family = offset`; write one segment per triangle that crosses it.

    The sign of each vertex against the plane decides (a above, o on, b below; any order of the three):

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
    Triangles without area give nothing.

    Args:
        tree: the mesh in the object's frame.
        T: `T_family_object`, shape (3, 4).
        offset: of the plane [m].
        reach: segments farther than this from the family's origin, in the plane, are left out [m].
        segments: written rows `[ax, az, bx, bz, nx, nz]`, normal unit and outward, shape (>= S, 6).
        sources: written with each segment's triangle in tree order, shape (>= S,).

    Returns:
        the number of segments S; or -S when the buffers are too small for all of them.
    """
    # Fields and entries are taken out once: reading them inside the loop costs more than the geometry.
    vertices, triangles, normals, low, high = tree.vertices, tree.triangles, tree.normals, tree.low, tree.high
    first, count, skip = tree.first, tree.count, tree.skip
    x_row = (T[0, 0], T[0, 1], T[0, 2], T[0, 3])
    y_row = (T[1, 0], T[1, 1], T[1, 2], T[1, 3] - offset)
    z_row = (T[2, 0], T[2, 1], T[2, 2], T[2, 3])
    nodes = low.shape[0]
    scale = max(abs(T[1, 3]), abs(offset))
    for k in range(3 if nodes else 0):
        scale = max(scale, abs(low[0, k]), abs(high[0, k]))
    on = _ON_PLANE * scale
    found, node = 0, 0
    while node < nodes:
        lx, ly, lz = low[node, 0], low[node, 1], low[node, 2]
        hx, hy, hz = 0.5 * (high[node, 0] - lx), 0.5 * (high[node, 1] - ly), 0.5 * (high[node, 2] - lz)
        if _misses(lx + hx, ly + hy, lz + hz, hx, hy, hz, x_row, y_row, z_row, reach, 2.0 * on):
            node = skip[node]
            continue
        for t in range(first[node], first[node] + count[node]):
            i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            a = (vertices[i, 0], vertices[i, 1], vertices[i, 2])
            b = (vertices[j, 0], vertices[j, 1], vertices[j, 2])
            c = (vertices[k, 0], vertices[k, 1], vertices[k, 2])
            ends, ax, az, bx, bz = _segment(a, b, c, x_row, y_row, z_row, on)
            if ends == 2 and _within(ax, az, bx, bz, reach):
                m = (normals[t, 0], normals[t, 1], normals[t, 2], 0.0)
                nx, nz = _normal(ax, az, bx, bz, _dot(x_row, m), _dot(z_row, m), _SHORT * scale)
                if nx != 0.0 or nz != 0.0:
                    if found < segments.shape[0]:
                        segments[found, 0], segments[found, 1] = ax, az
                        segments[found, 2], segments[found, 3] = bx, bz
                        segments[found, 4], segments[found, 5] = nx, nz
                        sources[found] = t
                    found += 1
        node += 1
    return found if found <= segments.shape[0] else -found


@inner_kernel
def _misses(
    cx: float,
    cy: float,
    cz: float,
    hx: float,
    hy: float,
    hz: float,
    x_row: Row,
    y_row: Row,
    z_row: Row,
    reach: float,
    slack: float,
) -> bool:
    """Say whether a box, given by centre and half extents, lies off the plane or out of reach."""
    y = y_row[0] * cx + y_row[1] * cy + y_row[2] * cz + y_row[3]
    if abs(y) > abs(y_row[0]) * hx + abs(y_row[1]) * hy + abs(y_row[2]) * hz + slack:
        return True
    if reach == np.inf:
        return False
    x = abs(x_row[0] * cx + x_row[1] * cy + x_row[2] * cz + x_row[3])
    z = abs(z_row[0] * cx + z_row[1] * cy + z_row[2] * cz + z_row[3])
    x = max(x - abs(x_row[0]) * hx - abs(x_row[1]) * hy - abs(x_row[2]) * hz - slack, 0.0)
    z = max(z - abs(z_row[0]) * hx - abs(z_row[1]) * hy - abs(z_row[2]) * hz - slack, 0.0)
    return x * x + z * z > reach * reach


@inner_kernel
def _segment(
    a: Point, b: Point, c: Point, x_row: Row, y_row: Row, z_row: Row, on: float
) -> tuple[int, float, float, float, float]:
    """Return the number of end points on the plane (2: a segment) and the two (x, z)."""
    da, db, dc = _map(y_row, a), _map(y_row, b), _map(y_row, c)
    if (da > on and db > on and dc > on) or (da < -on and db < -on and dc < -on):
        return 0, 0.0, 0.0, 0.0, 0.0
    p = (_map(x_row, a), _map(z_row, a))
    q = (_map(x_row, b), _map(z_row, b))
    r = (_map(x_row, c), _map(z_row, c))
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


@inner_kernel
def _dot(row: Row, m: Row) -> float:
    return row[0] * m[0] + row[1] * m[1] + row[2] * m[2]


@inner_kernel
def _map(row: Row, p: Point) -> float:
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]


@inner_kernel
def _add(ends: int, u: Flat, v: Flat, point: Flat) -> tuple[int, Flat, Flat]:
    if ends == 0:
        return 1, point, v
    return ends + 1, u, point


@inner_kernel
def _crossing(p: Flat, q: Flat, dp: float, dq: float) -> Flat:
    """Return the point between p and q at distances dp and dq from the plane: the same bits with both exchanged."""
    share = 1.0 / (dp + dq)
    return (p[0] * dq + q[0] * dp) * share, (p[1] * dq + q[1] * dp) * share


@inner_kernel
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


@inner_kernel
def _normal(ax: float, az: float, bx: float, bz: float, fx: float, fz: float, short: float) -> Flat:
    """Return the unit normal of a segment on the side of the face's projected normal; zero without one."""
    if fx == 0.0 and fz == 0.0:
        return 0.0, 0.0
    nx, nz = az - bz, bx - ax
    length = np.sqrt(nx * nx + nz * nz)
    side = nx * fx + nz * fz
    if length <= short or side == 0.0:
        length = np.sqrt(fx * fx + fz * fz)
        return fx / length, fz / length
    share = 1.0 / length if side > 0.0 else -1.0 / length
    return nx * share, nz * share
