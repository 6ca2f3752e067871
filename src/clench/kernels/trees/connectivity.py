"""How the triangles of a mesh hang together: shared vertices and edges, and connected parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clench.kernels.runtime.compiling import entry_kernel, kernel

from .tree_growth import Ints


def owned_features(triangles: Ints, vertices: int) -> NDArray[np.uint8]:
    """Give every vertex and every edge to the first triangle that has it.

    Args:
        triangles: (T, 3). vertices: how many there are.

    Returns:
        a mask per triangle, (T,): bit k for its vertex k, bit 3 + k for its edge from k to k + 1.
    """
    masks, start = np.zeros(len(triangles), dtype=np.uint8), np.empty(vertices + 1, dtype=np.int32)
    sides = np.empty((2, triangles.size), dtype=np.int32)
    own_vertices(triangles, start, masks)
    sort_sides(triangles, start, sides)
    own_edges(triangles, sides[0], masks)
    return masks


def connected_parts(dofs: NDArray[np.integer[Any]], count: int) -> Ints:
    """Return for each of so many nodes the smallest node of the part that it is in, (N,).

    Args:
        dofs: nodes that are connected, one degree of freedom per row, (G, K). count: how many nodes there are.
    """
    part = np.arange(count, dtype=np.int32)
    connect(np.ascontiguousarray(dofs, dtype=np.int32), part)
    return part


@entry_kernel
def own_vertices(triangles: Ints, seen: Ints, masks: Any) -> None:
    """Set bit k of each triangle whose vertex k no triangle before it has; `seen` is scratch space, (V + 1,)."""
    for v in range(seen.shape[0]):
        seen[v] = 0
    for t in range(triangles.shape[0]):
        for k in range(3):
            if seen[triangles[t, k]] == 0:
                seen[triangles[t, k]] = 1
                masks[t] |= 1 << k


@entry_kernel
def sort_sides(triangles: Ints, start: Ints, sides: Ints) -> None:
    """Sort the sides of triangles by their lower and then by their higher vertex; equal ones keep their order.

    Counting takes the same time for any mesh, also where a vertex has thousands of edges.

    Args:
        triangles: (T, 3); side k of triangle t has the number 3 t + k. start: scratch space, (V + 1,).
        sides: written, (2, 3 T); the first row is the result.
    """
    for turn in range(2):
        for v in range(start.shape[0]):
            start[v] = 0
        for s in range(sides.shape[1]):
            start[end_of(triangles, s, turn) + 1] += 1
        for v in range(1, start.shape[0]):
            start[v] += start[v - 1]
        for n in range(sides.shape[1]):
            s = n if turn == 0 else sides[1, n]
            v = end_of(triangles, s, turn)
            sides[1 - turn, start[v]] = s
            start[v] += 1


@entry_kernel
def own_edges(triangles: Ints, sides: Ints, masks: Any) -> None:
    """Set bit 3 + k of each triangle whose side k is the first one of its edge, given all sides sorted by edges."""
    low, high = -1, -1
    for s in sides:
        a, b = end_of(triangles, s, 1), end_of(triangles, s, 0)
        if a != low or b != high:
            masks[s // 3] |= 8 << (s % 3)
        low, high = a, b


@kernel
def end_of(triangles: Ints, side: int, lower: int) -> int:
    """Return the higher vertex of a side, or the lower one."""
    t, k = side // 3, side % 3
    v, w = np.int64(triangles[t, k]), np.int64(triangles[t, k + 1 if k < 2 else 0])
    return int(min(v, w) if lower else max(v, w))


@entry_kernel
def connect(dofs: Ints, part: Ints) -> None:
    """Write for each node the smallest node of its part.

    Args:
        dofs: nodes that are connected, one degree of freedom per row, (G, K). part: each node's own number at the
            start, (N,).
    """
    for g in range(dofs.shape[0]):
        for k in range(1, dofs.shape[1]):
            a, b = _root(part, dofs[g, 0]), _root(part, dofs[g, k])
            if a < b:
                part[b] = a
            else:
                part[a] = b
    for n in range(part.shape[0]):
        part[n] = part[part[n]]


@kernel
def _root(part: Ints, node: int) -> int:
    """Return the smallest node that is known to be connected to a node."""
    while part[node] != node:
        part[node] = part[part[node]]
        node = part[node]
    return node
