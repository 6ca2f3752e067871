"""Triangles as the page draws them: few enough, with sharp edges where the model has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from clench.models.appearance import thinned
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind

#: Triangles of one link, and of one body of the object, that are sent at most.
MOST_OF_LINK: Final = 20_000
MOST_OF_BODY: Final = 60_000
#: Edges that are bent by more than this are drawn sharp [rad].
_SHARP: Final = 0.55
#: Round shapes are drawn with facets off by at most this [m].
_DEVIATION: Final = 5e-5


def drawn(shapes: Sequence[Shape], most: int, hulls: bool = False) -> TriangleMesh:
    """Return the triangles of shapes in one frame, ready to draw.

    Args:
        shapes: in the frame of their link or body. most: triangles; a finer mesh is drawn coarser.
        hulls: draw the convex hull of every mesh.
    """
    from clench.models.tessellation import convex_hull

    meshes = []
    for shape in shapes:
        if hulls and shape.kind is ShapeKind.MESH and shape.mesh is not None:
            meshes.append(convex_hull(shape.mesh).transformed(shape.pose))
        else:
            meshes.append(shape.to_mesh(_DEVIATION))
    return _creased(thinned(TriangleMesh.joined(meshes), most))


def is_hulled(source: CollisionSource) -> bool:
    """Say whether meshes of the object count as their convex hulls."""
    return source is CollisionSource.ENGINE


def _creased(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh whose corners are shared only over edges that are nearly flat, so that shading keeps the others."""
    import trimesh

    if not len(mesh.triangles):
        return mesh
    merged = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=True)
    shaded = trimesh.graph.smooth_shade(merged, angle=_SHARP)
    return TriangleMesh(np.asarray(shaded.vertices), np.asarray(shaded.faces))
