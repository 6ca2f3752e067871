"""The same surface with more triangles: every triangle is parted into four at the middles of its edges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject

#: Tried one after another until a round shape has enough triangles [fraction of its size].
_DEVIATIONS: Final = tuple(0.5 * 0.8**k for k in range(80))


def base_mesh(obj: GraspObject, triangles: int) -> TriangleMesh:
    """Return an object's triangles in its frame; round shapes are tessellated to about as many as wanted."""
    size = max(shape.bounding_radius() for body in obj.bodies for shape in body.shapes)
    mesh = TriangleMesh.joined([])
    for deviation in _DEVIATIONS:
        parts = [shape.to_mesh(deviation * size) for body in obj.bodies for shape in body.shapes]
        found = TriangleMesh.joined(parts)
        if len(mesh.triangles) and len(found.triangles) > 1.2 * triangles:
            break
        mesh = found
    return mesh


def refinements(mesh: TriangleMesh, most: int) -> Iterator[TriangleMesh]:
    """Yield a mesh, and the same with four times the triangles, and so on up to a number of them."""
    while True:
        yield mesh
        if 4 * len(mesh.triangles) > most:
            return
        mesh = parted(mesh)


def parted(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh of four times as many triangles with the same surface."""
    corners = mesh.triangles
    edges = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    different, number = np.unique(edges, axis=0, return_inverse=True)
    middles = 0.5 * (mesh.vertices[different[:, 0]] + mesh.vertices[different[:, 1]])
    a, b, c = corners.T
    ab, bc, ca = (len(mesh.vertices) + number.reshape(-1, 3)).T
    parts = [np.column_stack(part) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return TriangleMesh(np.vstack([mesh.vertices, middles]), np.vstack(parts))
