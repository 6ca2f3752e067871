"""How the triangles of a mesh hang together: edges, parts, flaps, and how often a surface goes around a point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clench.base.pose import FloatArray
from clench.models.mesh import IntArray


class EdgeDefects(NamedTuple):
    """Count the edges that have one use, more than two uses, and two uses in the same direction."""

    holes: int
    crowded: int
    twisted: int

    @property
    def none(self) -> bool:
        """Whether every edge has exactly two uses, in opposite directions."""
        return not any(self)


def edge_defects(faces: IntArray) -> EdgeDefects:
    """Return what is wrong with the edges of triangles, shape (T, 3)."""
    edge, uses, direction = _edges(faces)
    balance = np.bincount(edge, weights=direction)
    twisted = np.count_nonzero((uses == 2) & (balance != 0))
    return EdgeDefects(int(np.count_nonzero(uses == 1)), int(np.count_nonzero(uses > 2)), int(twisted))


def without_flaps(faces: IntArray) -> IntArray:
    """Drop pairs of triangles with the same corners, given that no two are equal with their winding."""
    _, index, uses = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    kept: IntArray = faces[uses[index.ravel()] == 1]
    return kept


def parted(faces: IntArray, vertices: int) -> IntArray:
    """Give parts that share crowded edges or single vertices names of their own for their vertices.

    A part hangs together by edges with exactly two uses.

    Args:
        faces: shape (T, 3). vertices: how many there are.

    Returns:
        Triangles whose index `i` stands for vertex `i % vertices`.
    """
    edge, uses, _ = _edges(faces)
    sides = np.argsort(edge, kind="stable")
    pairs = sides[uses[edge[sides]] == 2].reshape(-1, 2) % len(faces)
    return faces + vertices * _connected(pairs, len(faces))[:, None]


def components(faces: IntArray, vertices: int) -> IntArray:
    """Return the number of the part each triangle belongs to, shape (T,); a part hangs together by its vertices."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    label = _connected(pairs, vertices)[faces[:, 0]]
    return np.unique(label, return_inverse=True)[1].astype(np.int64)


def winding_number(point: FloatArray, points: FloatArray, faces: IntArray) -> float:
    """Return how often a surface goes around a point, 1 inside a closed one (Van Oosterom and Strackee, 1983)."""
    a, b, c = (points[faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    denominator = la * lb * lc + dot[0] * lc + dot[1] * la + dot[2] * lb
    return float(np.arctan2(numerator, denominator).sum() / (2.0 * np.pi))


def _edges(faces: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the edge of each of the 3 T sides, how often each edge is used, and the direction of each side, ±1."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = directed.min(axis=1), directed.max(axis=1)
    _, edge, uses = np.unique(low * (int(high.max()) + 1) + high, return_inverse=True, return_counts=True)
    return edge.ravel(), uses, np.where(directed[:, 0] < directed[:, 1], 1, -1)


def _connected(pairs: IntArray, count: int) -> IntArray:
    """Return the component of each of `count` nodes, joined by pairs, shape (P, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
