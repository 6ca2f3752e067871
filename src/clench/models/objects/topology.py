"""Analyse the topology of a mesh: edges, parts, flaps, and how often a surface goes around a point."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from clench.core.pose import FloatArray
from clench.models.mesh import IntArray

#: A table of all vertices pays up to so many for each that is named.
_FAR_APART: Final = 4


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
    """Return the defects of the edges of triangles, shape (T, 3)."""
    # Products of names that are far apart would run over. Sides of one edge stand next to each other.
    sides = _sides(compact(faces)[1])
    sides.sort()
    edges = sides >> 1
    if len(sides) % 2 == 0 and (sides[1::2] - sides[::2] == 1).all() and (edges[2::2] != edges[1:-1:2]).all():
        # Every edge has two uses, upwards and downwards: the rule.
        return EdgeDefects(0, 0, 0)
    first = np.flatnonzero(np.concatenate([[True], edges[1:] != edges[:-1]]))
    uses = np.diff(first, append=len(sides))
    pairs = first[uses == 2]
    twisted = np.count_nonzero(sides[pairs] == sides[pairs + 1])
    return EdgeDefects(int(np.count_nonzero(uses == 1)), int(np.count_nonzero(uses > 2)), int(twisted))


def compact(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the vertices that triangles name, in order, and the triangles by their places among those."""
    size = int(faces.max()) + 1
    if size > _FAR_APART * faces.size:
        used, place = np.unique(faces, return_inverse=True)
        return used, place.reshape(-1, 3).astype(np.int64)
    named = np.zeros(size, dtype=bool)
    named[faces] = True
    return np.flatnonzero(named), (np.cumsum(named) - 1)[faces]


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
    edge, uses = _edges(faces)
    sides = np.argsort(edge, kind="stable")
    pairs = sides[uses[edge[sides]] == 2].reshape(-1, 2) % len(faces)
    return faces + vertices * _connected(pairs, len(faces))[:, None]


def components(faces: IntArray, vertices: int) -> IntArray:
    """Return the number of each triangle's part, shape (T,); the triangles of a part share vertices."""
    number = _connected(faces, vertices)[faces[:, 0]]
    named = np.zeros(vertices, dtype=bool)
    named[number] = True
    return np.cumsum(named)[number] - 1


def winding_number(point: FloatArray, points: FloatArray, faces: IntArray) -> float:
    """Return how often a surface goes around a point, 1 inside a closed one (Van Oosterom and Strackee, 1983)."""
    a, b, c = (points[faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    dot = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    denominator = la * lb * lc + dot[0] * lc + dot[1] * la + dot[2] * lb
    return float(np.arctan2(numerator, denominator).sum() / (2.0 * np.pi))


def _sides(faces: IntArray) -> IntArray:
    """Return a number for each of the 3 T sides: twice the number of its edge, plus 1 if it runs upwards."""
    size, keys = int(faces.max()) + 1, []
    for i in range(3):
        start, end = faces[:, i], faces[:, (i + 1) % 3]
        key = np.minimum(start, end)
        key *= size
        key += np.maximum(start, end)
        key <<= 1
        key += start < end
        keys.append(key)
    return np.concatenate(keys)


def _edges(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the edge of each of the 3 T sides, first sides first, and how often each edge is used."""
    _, edge, uses = np.unique(_sides(faces) >> 1, return_inverse=True, return_counts=True)
    return edge.ravel(), uses


def _connected(groups: IntArray, count: int) -> IntArray:
    """Return the component of each of `count` nodes, which rows of a table connect; numbered by their first nodes."""
    from clench.kernels.trees.connectivity import connected_parts

    first = connected_parts(groups, count)
    number: IntArray = np.cumsum(first == np.arange(count)) - 1
    return number[first]
