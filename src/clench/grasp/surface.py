"""The object's surface where it is touched: its outward normal, and whose it is."""

from __future__ import annotations

import numpy as np

from clench.base.pose import FloatArray, invert
from clench.models.shapes import ShapeKind

from .scene import ROUND_KINDS, PackedObject


def surface_normal(packed: PackedObject, source: int, T_palm_object: FloatArray, position: FloatArray) -> FloatArray:
    """Return the outward unit normal in the object's frame, shape (3,): of the touched facet, or of the round shape.

    Args:
        packed: the object. source: touched triangle of its tree, or -1 - index of a round shape.
        T_palm_object: shape (4, 4). position: of the touch in the palm frame [m], shape (3,).
    """
    if source >= 0:
        facet: FloatArray = packed.tree.normals[source]
        return facet
    i = -1 - source
    pose = packed.rounds.T_object_shape[i]
    in_object = (invert(T_palm_object) @ np.append(position, 1.0))[:3]
    normal: FloatArray = pose[:, :3] @ _round_normal(
        int(packed.rounds.kind[i]), packed.rounds.size[i], pose[:, :3].T @ (in_object - pose[:, 3])
    )
    return normal


def nearest_body(packed: PackedObject, place: FloatArray) -> int:
    """Return the body whose surface is nearest to a point of the object's frame, shape (3,) [m]."""
    from clench.kernels.distance import closest_point

    _, triangle, _, _, _ = closest_point(packed.full_tree, np.asarray(place, dtype=np.float64), np.inf)
    return int(packed.full_tree.body[triangle])


def _round_normal(kind: int, size: FloatArray, p: FloatArray) -> FloatArray:
    """Return the normal of a round shape in its own frame at a point of its surface."""
    if kind == ROUND_KINDS[ShapeKind.ELLIPSOID]:
        n = p / size**2
    elif kind == ROUND_KINDS[ShapeKind.CYLINDER]:
        across = float(np.hypot(p[0], p[1]))
        on_cap = abs(abs(p[2]) - size[1]) < abs(across - size[0])
        n = np.array([0.0, 0.0, np.sign(p[2])]) if on_cap else np.array([p[0], p[1], 0.0])
    elif kind == ROUND_KINDS[ShapeKind.CAPSULE]:
        n = p - np.array([0.0, 0.0, min(max(p[2], -size[1]), size[1])])
    else:
        n = p
    unit: FloatArray = n / np.linalg.norm(n)
    return unit
