"""What the triangles of each node of a tree add up to: a winding number takes a far node as one thing.

A vector y leads from a point to a small piece of a surface. The point sees the piece under the solid angle n·y/|y|³
times its area. A node keeps the first two terms of the Taylor series of this function, and a bound of the others.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from clench.kernels.runtime.compiling import entry_kernel, kernel

from .tree_growth import Floats, Ints, Nodes

#: Columns of a row: centre, vector area (3), second-order term (6), area, spread, radius.
VECTOR, SECOND, AREA, SPREAD, RADIUS, COLUMNS = 3, 6, 12, 13, 14, 15
#: A mesh that is smaller or larger than this [m] has no moments: their powers could leave the range of numbers.
_LEAST, _MOST = 1e-30, 1e30
#: Rounding moves a centre by less than this fraction of the largest coordinate, whatever the depth of the tree.
_ROUNDING: Final = 1e-12


def node_moments(vertices: Floats, triangles: Ints, nodes: Nodes) -> Floats:
    """Return the moments of every node, shape (N, 15), or no rows for a mesh of an extreme size.

    A row has these columns. h leads from the centre to a point of the surface, n is the normal there.

        0–2: centre of the area [m].
        3–5: integral of n [m²].
        6–11: xx, yy, zz, xy, xz, yz of the integral of h nᵀ, without its trace and its antisymmetric part [m³].
        12: area [m²]. 13: at least the integral of |h|² [m⁴]. 14: at least the largest |h| [m].

    Args:
        vertices: [m], (V, 3). triangles: vertex indices in tree order, (T, 3). nodes: of the tree.
    """
    size = float(np.abs([nodes.low[0], nodes.high[0]]).max()) if len(nodes.low) else 0.0
    if not _LEAST < size < _MOST:
        return np.empty((0, COLUMNS))
    moments = np.zeros((len(nodes.low), COLUMNS))
    write_moments(vertices, triangles, nodes, moments)
    return moments


@entry_kernel
def write_moments(vertices: Floats, triangles: Ints, nodes: Nodes, moments: Floats) -> None:
    """Add moments to `moments`, which are zero, children before their parents; see `node_moments`."""
    count, first = nodes.count, nodes.first
    for node in range(moments.shape[0] - 1, -1, -1):
        place_center(vertices, triangles, nodes, node, moments)
        if count[node]:
            for t in range(first[node], first[node] + count[node]):
                add_triangle(vertices, triangles, t, moments, node)
        else:
            add_child(moments, node + 1, node)
            add_child(moments, nodes.right[node], node)
        # No point of the surface is farther than the farthest corner of the box.
        farthest, size = 0.0, 0.0
        for k in range(3):
            low, high = nodes.low[node, k], nodes.high[node, k]
            farthest += max(moments[node, k] - low, high - moments[node, k]) ** 2
            size = max(size, abs(low), abs(high))
        radius = min(math.sqrt(farthest), moments[node, RADIUS])
        moments[node, RADIUS] = radius * (1.0 + _ROUNDING)
        moments[node, SPREAD] += _ROUNDING * (moments[node, SPREAD] + moments[node, AREA] * radius * size)
        # The trace has no effect outside.
        third = (moments[node, SECOND] + moments[node, SECOND + 1] + moments[node, SECOND + 2]) / 3.0
        for k in range(3):
            moments[node, SECOND + k] -= third


@kernel
def place_center(vertices: Floats, triangles: Ints, nodes: Nodes, node: int, moments: Floats) -> None:
    """Write area and centre of area of a node; the middle of its box where it has no area."""
    area, x, y, z = 0.0, 0.0, 0.0, 0.0
    if nodes.count[node]:
        for t in range(nodes.first[node], nodes.first[node] + nodes.count[node]):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            nx, ny, nz = vector_area(vertices, a, b, c)
            part = math.sqrt(nx * nx + ny * ny + nz * nz)
            area += part
            x += part * (vertices[a, 0] + vertices[b, 0] + vertices[c, 0]) / 3.0
            y += part * (vertices[a, 1] + vertices[b, 1] + vertices[c, 1]) / 3.0
            z += part * (vertices[a, 2] + vertices[b, 2] + vertices[c, 2]) / 3.0
    else:
        for side in range(2):
            child = nodes.right[node] if side else node + 1
            part = moments[child, AREA]
            area += part
            x += part * moments[child, 0]
            y += part * moments[child, 1]
            z += part * moments[child, 2]
    moments[node, AREA] = area
    if area > 0.0:
        moments[node, 0], moments[node, 1], moments[node, 2] = x / area, y / area, z / area
    for k in range(3):
        low, high = nodes.low[node, k], nodes.high[node, k]
        center = moments[node, k] if area > 0.0 else low + 0.5 * (high - low)
        moments[node, k] = min(max(center, low), high)


@kernel
def add_triangle(vertices: Floats, triangles: Ints, t: int, moments: Floats, node: int) -> None:
    """Add the moments of a triangle to those of its leaf."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    nx, ny, nz = vector_area(vertices, a, b, c)
    middle, square, away = (0.0, 0.0, 0.0), 0.0, 0.0
    for i in (a, b, c):
        x, y = vertices[i, 0] - moments[node, 0], vertices[i, 1] - moments[node, 1]
        z = vertices[i, 2] - moments[node, 2]
        middle = (middle[0] + x / 3.0, middle[1] + y / 3.0, middle[2] + z / 3.0)
        square += x * x + y * y + z * z
        away = max(away, x * x + y * y + z * z)
    mx, my, mz = middle
    add_moved(moments, node, middle, (nx, ny, nz))
    moments[node, RADIUS] = max(moments[node, RADIUS], math.sqrt(away))
    # The mean of |h|² over a triangle: a twelfth of the sum at its corners and of nine times its value at the middle.
    mean = (square + 9.0 * (mx * mx + my * my + mz * mz)) / 12.0
    moments[node, SPREAD] += mean * math.sqrt(nx * nx + ny * ny + nz * nz)


@kernel
def add_child(moments: Floats, child: int, node: int) -> None:
    """Add the moments of a child to those of its parent; spreads add up as moments of inertia do."""
    x, y = moments[child, 0] - moments[node, 0], moments[child, 1] - moments[node, 1]
    z = moments[child, 2] - moments[node, 2]
    vector = (moments[child, VECTOR], moments[child, VECTOR + 1], moments[child, VECTOR + 2])
    add_moved(moments, node, (x, y, z), vector)
    for k in range(6):
        moments[node, SECOND + k] += moments[child, SECOND + k]
    square = x * x + y * y + z * z
    moments[node, SPREAD] += moments[child, SPREAD] + moments[child, AREA] * square
    moments[node, RADIUS] = max(moments[node, RADIUS], moments[child, RADIUS] + math.sqrt(square))


@kernel
def add_moved(moments: Floats, node: int, h: tuple[float, float, float], vector: tuple[float, float, float]) -> None:
    """Add a vector area that lies at h from a node's centre."""
    x, y, z = h
    nx, ny, nz = vector
    for k in range(3):
        moments[node, VECTOR + k] += vector[k]
        moments[node, SECOND + k] += h[k] * vector[k]
    moments[node, SECOND + 3] += 0.5 * (x * ny + y * nx)
    moments[node, SECOND + 4] += 0.5 * (x * nz + z * nx)
    moments[node, SECOND + 5] += 0.5 * (y * nz + z * ny)


@kernel
def vector_area(vertices: Floats, a: int, b: int, c: int) -> tuple[float, float, float]:
    """Return the normal of a triangle times its area [m²]."""
    ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
    vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
    return 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)
