"""Triangle meshes as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.pose import FloatArray, Pose
from clench.core.showing.short_repr import short_repr

IntArray = NDArray[np.int64]


@dataclass(frozen=True, init=False, eq=False)
class TriangleMesh:
    """A triangle mesh: vertices [m], shape (V, 3), and triangles, shape (T, 3), counter-clockwise from outside."""

    vertices: FloatArray
    triangles: IntArray

    __repr__ = short_repr

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        v = np.array(vertices, dtype=np.float64).reshape(-1, 3)
        t = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        v.flags.writeable = False
        t.flags.writeable = False
        object.__setattr__(self, "vertices", v)
        object.__setattr__(self, "triangles", t)

    def transformed(self, pose: Pose) -> TriangleMesh:
        """Return the mesh with its vertices mapped by a pose; the same mesh for the identity."""
        if pose == Pose.identity():
            return self
        return TriangleMesh(pose.apply(self.vertices), self.triangles)

    @staticmethod
    def joined(meshes: list[TriangleMesh]) -> TriangleMesh:
        """Return one mesh that holds the triangles of several."""
        if not meshes:
            return TriangleMesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64))
        if len(meshes) == 1:
            return meshes[0]
        starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
        return TriangleMesh(
            np.vstack([m.vertices for m in meshes]),
            np.vstack([m.triangles + start for m, start in zip(meshes, starts, strict=False)]),
        )


def is_closed(mesh: TriangleMesh) -> bool:
    """Say whether every edge has as many triangles on either side, places merged, and the volume is positive."""
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = place.reshape(-1)[mesh.triangles]
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    size = len(mesh.vertices) + 1
    forward = np.sort((starts * size + ends)[starts != ends])
    backward = np.sort((ends * size + starts)[starts != ends])
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    middle = mesh.vertices.mean(axis=0) if len(mesh.vertices) else np.zeros(3)
    volume = float(np.einsum("ij,ij->", a - middle, np.cross(b - middle, c - middle)))
    return bool(np.array_equal(forward, backward)) and volume > 0.0
