"""Convex pieces that stand for a mesh in simulation, computed once and kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import io
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from clench.core.caching.cache_folder import cache_folder
from clench.core.exceptions import ObjectError
from clench.core.files.json_files import write_atomically
from clench.core.pose import FloatArray
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.objects.object_loading import in_source
from clench.models.shapes import CollisionSource, ShapeKind
from clench.models.tessellation import convex_hull

from .decomposing import decompose

#: A mesh whose volume misses its hull's by less than this fraction is convex [-].
CONVEX_FRACTION = 1e-4
#: Settings of the decomposition: largest concavity of a piece as a fraction of the mesh's size, then effort.
SETTINGS = {
    "threshold": 0.05,
    "preprocess_resolution": 30,
    "resolution": 1000,
    "mcts_iterations": 30,
    "mcts_nodes": 10,
    "mcts_max_depth": 2,
    "seed": 0,
}
#: Number of the method below: part of the cache's keys, raised when results change.
METHOD = 1


def convex_pieces(mesh: TriangleMesh, name: str, *, show_progress: bool = False) -> tuple[FloatArray, ...]:
    """Return the vertices of convex pieces that approximate a mesh, each of shape (V, 3) [m].

    A convex mesh is its own hull. Any other is decomposed by CoACD, which takes seconds to minutes: the pieces are kept
    in the cache folder under the hash of the geometry.

    Raises:
        ObjectError: the mesh is flat, so that no solid piece exists, or CoACD gives no answer.
    """
    hull, share = hull_of(mesh.vertices, name), _volume(mesh)
    if abs(share - hull[1]) <= CONVEX_FRACTION * hull[1]:
        return (hull[0],)
    folder = cache_folder()
    if folder is None:
        return _decomposed(mesh, name, show_progress)
    key = hashlib.sha256(f"{METHOD} {SETTINGS}".encode())
    key.update(mesh.vertices.tobytes())
    key.update(mesh.triangles.tobytes())
    file = folder / "pieces" / f"{key.hexdigest()[:32]}.npz"
    pieces = _cached(file)
    if pieces is None:
        pieces = _decomposed(mesh, name, show_progress)
        _keep(file, pieces)
    return pieces


def in_pieces(obj: GraspObject, *, show_progress: bool = False) -> GraspObject:
    """Return an object as the engine collides it, so that solver and simulation see the same shapes.

    Args:
        obj: the object. A mesh body that is not convex and has no pieces is decomposed.
        show_progress: show a bar meanwhile.

    Raises:
        ObjectError: a mesh is flat.
    """
    return replace(
        obj,
        bodies=tuple(in_source(_with_pieces(body, show_progress), CollisionSource.ENGINE) for body in obj.bodies),
        collision_source=CollisionSource.ENGINE,
    )


def _with_pieces(body: Body, show_progress: bool) -> Body:
    if body.pieces or any(shape.kind is not ShapeKind.MESH for shape in body.shapes):
        return body
    hulls = [h for s in body.shapes for h in convex_pieces(s.to_mesh(), body.name, show_progress=show_progress)]
    return replace(body, pieces=tuple(convex_hull(TriangleMesh(vertices, [])) for vertices in hulls))


def hull_of(vertices: FloatArray, name: str) -> tuple[FloatArray, float]:
    """Return the corners of the convex hull, shape (V, 3) [m], and its volume [m³].

    Raises:
        ObjectError: the points lie in one plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        raise ObjectError(f"Body '{name}' is flat: simulation needs a solid shape.") from None
    return np.asarray(vertices[hull.vertices]), float(hull.volume)


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] - mesh.vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _decomposed(mesh: TriangleMesh, name: str, show_progress: bool) -> tuple[FloatArray, ...]:
    if not show_progress:
        return decompose(mesh, name, SETTINGS)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        progress.add_task(f"Convex pieces of '{name}' (kept for the next time)", total=None)
        return decompose(mesh, name, SETTINGS)


def _cached(file: Path) -> tuple[FloatArray, ...] | None:
    try:
        with np.load(file, allow_pickle=False) as data:
            return tuple(data[f"piece_{i}"] for i in range(len(data.files)))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None  # missing or damaged: computed again


def _keep(file: Path, pieces: tuple[FloatArray, ...]) -> None:
    content = io.BytesIO()
    np.savez(content, **{f"piece_{i}": piece for i, piece in enumerate(pieces)})  # type: ignore[arg-type]
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, content.getvalue())
    except (OSError, ValueError):
        return  # a cache that cannot be written costs time, nothing else
