"""Whether the elements of a part are the surface of their convex hull."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats

#: A corner lies over the plane of a neighbouring triangle if it does so by more than this share of the part's size [-].
FLAT = 1e-9


def is_convex(vertices: Floats, elements: NDArray[np.int32]) -> bool:
    """Say whether there is one element only, or a closed surface that bends the same way at every edge.

    The answer is a hint: a surface that winds around itself seems to be convex as well.

    Args:
        vertices: [m], (V, 3). elements: vertex indices, (T, 3).
    """
    if len(elements) == 1:
        return True
    points, number = np.unique(vertices[elements.reshape(-1)], axis=0, return_inverse=True)
    corners = number.reshape(-1, 3)
    ends = np.concatenate([corners[:, [1, 2]], corners[:, [2, 0]], corners[:, [0, 1]]]).astype(np.int64)
    opposite, triangle = corners.T.reshape(-1), np.tile(np.arange(len(corners)), 3)
    # The two triangles of an edge run along it in opposite ways.
    key, back = ends[:, 0] * len(points) + ends[:, 1], ends[:, 1] * len(points) + ends[:, 0]
    one, other = np.argsort(key), np.argsort(back)
    if not np.array_equal(key[one], back[other]) or np.any(key[one][1:] == key[one][:-1]):
        return False
    a, b, c = points[corners[:, 0]], points[corners[:, 1]], points[corners[:, 2]]
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0)
    over = np.einsum("ij,ij->i", normal[triangle[one]], points[opposite[other]] - a[triangle[one]])
    most = FLAT * float(np.ptp(points, axis=0).max())
    return bool(over.max() <= most or over.min() >= -most)
