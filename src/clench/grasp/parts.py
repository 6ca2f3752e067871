"""The connected parts of a mesh, one point each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clench.base.pose import FloatArray

if TYPE_CHECKING:
    from clench.kernels.tree import MeshTree


def part_points(tree: MeshTree) -> FloatArray:
    """Return a point of every connected part of a mesh [m], shape (N, 3); places that coincide are connected."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if not len(tree.triangles):
        return np.empty((0, 3))
    places, index = np.unique(tree.vertices, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[tree.triangles]
    a, b = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    graph = coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(places),) * 2)
    _, part = connected_components(graph, directed=False)
    used = np.unique(triangles)
    _, first = np.unique(part[used], return_index=True)
    points: FloatArray = places[used[first]]
    return points
