"""Objects by built-in name, from files, from shapes, and from several meshes with poses."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.exceptions import ObjectError, UnknownNameError
from clench.core.files.file_bytes import expanded
from clench.core.pose import Pose
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import convex_hull

from .grasp_object import Body, BodyRole, GraspObject, MeshPart
from .mesh_checks import check_mesh, check_size, mesh_arrays, unit_warnings
from .mesh_file import merged, read_mesh
from .shape_text import is_shape_text, parse_shape

#: Radius of the built-in ball: a tennis ball [m].
BALL_RADIUS: Final = 0.0335
#: Names of files and folders that do not tell objects apart.
SAYS_NOTHING: Final = frozenset(
    {
        *("textured", "nontextured", "textured_simple", "mesh", "meshes", "model", "models", "visual", "collision"),
        *("object", "objects", "base", "scan", "google_16k", "google_64k", "google_512k", "tsdf", "poisson"),
    }
)


def _ball() -> Body:
    return Body("ball", (Shape(ShapeKind.SPHERE, (BALL_RADIUS, 0.0, 0.0), name="ball"),))


def _mug() -> Body:
    from .mug import mug

    return mug()


def _bottle() -> Body:
    from .revolved import bottle

    return bottle()


def _screwdriver() -> Body:
    from .revolved import screwdriver

    return screwdriver()


BUILTIN: Final[Mapping[str, Callable[[], Body]]] = {
    "mug": _mug,
    "bottle": _bottle,
    "screwdriver": _screwdriver,
    "ball": _ball,
}


def load_object(
    model: str | Path,
    *,
    scale: float = 1.0,
    pose: Pose | None = None,
    collision_source: CollisionSource | str = CollisionSource.RAW,
) -> GraspObject:
    """Read an object; see `GraspObject.load`."""
    source = collision_source_named(collision_source)
    factor = _scale(scale)
    warnings: tuple[str, ...] = ()
    path: Path | None = None
    if isinstance(model, str) and model in BUILTIN:
        name, body = model, BUILTIN[model]()
    elif isinstance(model, str) and is_shape_text(model) and not os.path.exists(model):
        name, body = model, shape_body(parse_shape(model))
    else:
        path = expanded(model)
        _refuse_bare_name(model, path)
        name = file_name(path)
        vertices, triangles = read_mesh(path)
        checked = check_mesh(vertices, triangles, path.name)
        body = Body(name, (Shape(ShapeKind.MESH, mesh=checked.mesh, name=name),), closed=checked.closed)
        warnings = checked.warnings
    body = scaled_body(body, factor)
    for shape in body.shapes:
        check_size(shape, path.name if path else name)
    read = GraspObject(
        name, (in_source(body, source),), Pose.identity() if pose is None else pose, source, warnings, path, factor
    )
    return replace(read, warnings=(*warnings, *size_warnings(read)))


def file_name(path: Path) -> str:
    """Return the name of an object in a file: the stem, or the nearest folder that says more.

    Collections of scans call every mesh alike, such as `mug/google_16k/textured.obj`.
    """
    stem = path.stem
    if stem.lower() not in SAYS_NOTHING:
        return stem
    folders = (folder.name for folder in path.absolute().parents)
    folder = next((name for name in folders if name and name.lower() not in SAYS_NOTHING), stem)
    # The two stand side by side.
    return f"{folder}_{stem}" if stem.lower() in ("visual", "collision") and folder != stem else folder


def size_warnings(obj: GraspObject) -> tuple[str, ...]:
    """Return the warnings about size of an object read by `load_object`."""
    label = obj.path.name if obj.path else obj.name
    return unit_warnings(np.vstack([_body_points(body) for body in obj.bodies]), label, obj.scale)


def object_from_shape(
    shape: Shape | str, *, name: str, pose: Pose | None, role: BodyRole | str, collision_source: CollisionSource | str
) -> GraspObject:
    """Make an object of one shape; see `GraspObject.from_shape`."""
    source = collision_source_named(collision_source)
    made = parse_shape(shape) if isinstance(shape, str) else shape
    body, warnings = _checked_shape(made, name or made.name or str(made.kind), role_named(role))
    check_size(made, body.name)
    body = in_source(body, source)
    warnings += unit_warnings(_body_points(body), body.name)
    return GraspObject(body.name, (body,), Pose.identity() if pose is None else pose, source, warnings)


def object_from_meshes(
    parts: Iterable[MeshPart | tuple[Any, ...]],
    *,
    name: str,
    pose: Pose | None,
    collision_source: CollisionSource | str,
) -> GraspObject:
    """Make an object of several meshes with poses; see `GraspObject.from_meshes`."""
    source = collision_source_named(collision_source)
    bodies: list[Body] = []
    warnings: list[str] = []
    for i, given in enumerate(parts):
        part = _part(given, f"{name}: part {i}")
        label = part.name or f"{name}[{i}]"
        checked = check_mesh(*merged(*mesh_arrays(part.vertices, part.triangles, label)), label)
        shape = Shape(ShapeKind.MESH, pose=part.pose or Pose.identity(), mesh=checked.mesh, name=label)
        check_size(shape, label)
        bodies.append(in_source(Body(label, (shape,), role_named(part.role), closed=checked.closed), source))
        warnings.extend(checked.warnings)
    if not bodies:
        raise ObjectError(f"{name}: expected at least one part (vertices, triangles, pose, role).")
    warnings.extend(unit_warnings(np.vstack([_body_points(body) for body in bodies]), name))
    return GraspObject(name, tuple(bodies), Pose.identity() if pose is None else pose, source, tuple(warnings))


def shape_body(shape: Shape) -> Body:
    """Return a body of one primitive, named as the shape."""
    return Body(shape.name or str(shape.kind), (shape,), BodyRole.GRASPABLE)


def scaled_body(body: Body, factor: float) -> Body:
    """Return a body with every length multiplied by a factor."""
    if factor == 1.0:
        return body
    shapes = tuple(_scaled_shape(shape, factor) for shape in body.shapes)
    pieces = tuple(type(piece)(piece.vertices * factor, piece.triangles) for piece in body.pieces)
    return replace(body, shapes=shapes, pieces=pieces)


def in_source(body: Body, source: CollisionSource) -> Body:
    """Return a body as a collision source sees it: for `engine`, its convex pieces, or the hull of every mesh."""
    if source is not CollisionSource.ENGINE:
        return body
    if body.pieces:
        names = (f"{body.name} piece {i}" for i in range(len(body.pieces)))
        return replace(
            body,
            shapes=tuple(Shape(ShapeKind.MESH, mesh=m, name=n) for m, n in zip(body.pieces, names, strict=True)),
            closed=True,
        )
    return replace(body, shapes=tuple(_hull_of(shape) for shape in body.shapes), closed=True)


def collision_source_named(source: CollisionSource | str) -> CollisionSource:
    """Return the collision source of that name.

    Raises:
        UnknownNameError: no such source.
    """
    if source not in list(CollisionSource):
        raise UnknownNameError("collision source", str(source), "clench", [str(s) for s in CollisionSource])
    return CollisionSource(source)


def role_named(role: BodyRole | str) -> BodyRole:
    """Return the role of that name.

    Raises:
        UnknownNameError: no such role.
    """
    if role not in list(BodyRole):
        raise UnknownNameError("role", str(role), "clench", [str(r) for r in BodyRole])
    return BodyRole(role)


def _hull_of(shape: Shape) -> Shape:
    if shape.kind is not ShapeKind.MESH:
        return shape
    assert shape.mesh is not None
    return replace(shape, mesh=convex_hull(shape.mesh))


def _scaled_shape(shape: Shape, factor: float) -> Shape:
    a, b, c = shape.size
    mesh = shape.mesh and type(shape.mesh)(shape.mesh.vertices * factor, shape.mesh.triangles)
    pose = Pose(shape.pose.position * factor, shape.pose.wxyz)
    return replace(shape, size=(a * factor, b * factor, c * factor), pose=pose, mesh=mesh)


def _checked_shape(shape: Shape, name: str, role: BodyRole) -> tuple[Body, tuple[str, ...]]:
    """Check a shape that was made by hand and return it as a body."""
    if shape.kind is ShapeKind.MESH:
        if shape.mesh is None:
            raise ObjectError(f"{name}: a mesh shape without triangles.")
        checked = check_mesh(shape.mesh.vertices, shape.mesh.triangles, name)
        return Body(name, (replace(shape, mesh=checked.mesh),), role, closed=checked.closed), checked.warnings
    count = shape.kind.lengths
    if not all(math.isfinite(v) for v in shape.size) or not all(v > 0 for v in shape.size[:count]):
        raise ObjectError(f"{name}: a {shape.kind} needs {count} finite half sizes above 0 m, got {shape.size}.")
    return Body(name, (shape,), BodyRole.GRASPABLE), ()


def _part(given: MeshPart | tuple[Any, ...], where: str) -> MeshPart:
    try:
        return given if isinstance(given, MeshPart) else MeshPart(*given)
    except TypeError:
        raise ObjectError(
            f"{where}: expected (vertices, triangles, pose, role, name), the last three optional."
        ) from None


def _scale(scale: float) -> float:
    if (
        isinstance(scale, bool)
        or not isinstance(scale, (int, float, np.floating))
        or not math.isfinite(scale)
        or scale <= 0
    ):
        raise ObjectError(f"scale: expected a finite number above 0, got {scale!r}.")
    return float(scale)


def _refuse_bare_name(model: str | Path, path: Path) -> None:
    """Take a word without suffix or folder for a misspelt built-in name rather than for a missing file."""
    if isinstance(model, str) and not path.suffix and len(path.parts) <= 1 and not os.path.exists(path):
        raise UnknownNameError("object", model, "the built-in objects, and there is no such file", BUILTIN)


def _body_points(body: Body) -> Any:
    """Return points that span a body, shape (P, 3) [m]; coarse, since only their extent matters."""
    return np.vstack([shape.to_mesh(0.1 * shape.bounding_radius()).vertices for shape in body.shapes])
