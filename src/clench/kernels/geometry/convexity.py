"""Whether the elements of a part are the surface of their convex hull."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats

#: A part fills its hull if their volumes differ by less than this share [-].
FULL = 1e-6
#: A corner lies over the plane of a neighbouring triangle if it does so by more than this share of the part's size [-].
FLAT = 1e-9


def is_convex(vertices: Floats, elements: NDArray[np.int32]) -> bool:
    """Say whether there is one element only, or a closed surface that is the surface of its convex hull.

    Such a surface bends the same way at every edge, and has the volume of its hull. A flat one of several elements is
    not told to be convex.

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
    if over.max() > most and over.min() < -most:
        return False
    return fills_hull(points, a, b, c)


def fills_hull(points: Floats, a: Floats, b: Floats, c: Floats) -> bool:
    """Say whether a closed surface has the volume of the convex hull of its points; not if that is flat.

    Args:
        points: [m], (P, 3). a, b, c: corners of the triangles [m], (T, 3) each.
    """
    from scipy.spatial import ConvexHull, QhullError

    middle = points.mean(axis=0)
    volume = abs(float(np.einsum("ij,ij->", np.cross(a - middle, b - middle), c - middle))) / 6.0
    try:
        whole = float(ConvexHull(points).volume)
    except QhullError:
        return False
    return abs(volume - whole) <= FULL * whole
