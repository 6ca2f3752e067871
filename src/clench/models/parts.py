"""The connected parts of a mesh, one point each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray

if TYPE_CHECKING:
    from clench.kernels.trees.bvh import MeshTree


def part_points(tree: MeshTree) -> FloatArray:
    """Return a point of every connected part of a mesh [m], shape (N, 3); places that coincide are connected.

    The point of a part is the corner with the smallest x, then y, then z. The points are in the same order.
    """
    from clench.kernels.trees.connectivity import connected_parts

    if not len(tree.triangles):
        return np.empty((0, 3))
    used = np.zeros(len(tree.vertices), dtype=bool)
    used[tree.triangles] = True
    part = connected_parts(tree.triangles, len(tree.vertices))
    parts_used = part[used]
    if (parts_used == parts_used[0]).all():
        # Merging places, which takes longer than all the rest, would join nothing more.
        corners = tree.vertices[used]
        corners = corners[corners[:, 0] == corners[:, 0].min()]
        least: FloatArray = corners[np.lexsort(corners.T[::-1])[:1]]
        return least
    order = np.lexsort(tree.vertices.T[::-1])
    sorted_vertices = tree.vertices[order]
    new = np.concatenate([[True], (sorted_vertices[1:] != sorted_vertices[:-1]).any(axis=1)])
    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.cumsum(new) - 1
    # The smallest number of a part is that of its first place.
    triangles = place[tree.triangles]
    part = connected_parts(triangles, int(new.sum()))
    points: FloatArray = sorted_vertices[new][np.unique(part[triangles[:, 0]])]
    return points
