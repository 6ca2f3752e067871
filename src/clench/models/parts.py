"""The connected parts of a mesh, one point each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray

if TYPE_CHECKING:
    from clench.kernels.geometry.bvh import MeshTree


def part_points(tree: MeshTree) -> FloatArray:
    """Return a point of every connected part of a mesh [m], shape (N, 3); places that coincide are connected."""
    if not len(tree.triangles):
        return np.empty((0, 3))
    used = np.unique(tree.triangles)
    part = _part_of(tree.triangles, len(tree.vertices))[used]
    if (part == part[0]).all():
        # Merging places, which takes longer than all the rest, would join nothing more.
        corners = tree.vertices[used]
        return corners[np.lexsort(corners.T[::-1])[:1]]
    places, index = np.unique(tree.vertices, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[tree.triangles]
    used = np.unique(triangles)
    _, first = np.unique(_part_of(triangles, len(places))[used], return_index=True)
    points: FloatArray = places[used[first]]
    return points


def _part_of(triangles: NDArray[np.integer], count: int) -> NDArray[np.int32]:
    """Return the number of the connected part that each of so many vertices is in."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    a, b = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    graph = coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    part: NDArray[np.int32] = connected_components(graph, directed=False)[1]
    return part
