"""The object: bodies made of shapes, with a pose, a role and the warnings of the checks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from clench.core.argument_types import check_type
from clench.core.caching.keeping import Keeper
from clench.core.exceptions import ObjectError
from clench.core.pose import Pose
from clench.core.showing.short_repr import described, short_repr
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape


class BodyRole(StrEnum):
    """Name the roles of a body for the hand."""

    GRASPABLE = "graspable"
    """the fingers close around it"""
    OBSTACLE = "obstacle"
    """the fingers stop at it, but a touch is no grasp (table, clutter)"""


@dataclass(frozen=True)
class Body(Keeper):
    """Describe one rigid part of the scene, in the object's frame.

    Args:
        name: for messages and contacts.
        shapes: its geometry, in the object's frame.
        role: graspable or obstacle.
        pieces: convex pieces that approximate it for simulation, in the object's frame; empty when not known.
        closed: every mesh is watertight with consistent outward winding, so one-sided contact tests are exact.
        friction: sliding friction of its surface [-], or None when not known.
    """

    name: str
    shapes: tuple[Shape, ...]
    role: BodyRole = BodyRole.GRASPABLE
    pieces: Sequence[TriangleMesh] = ()
    closed: bool = True
    friction: float | None = None

    __repr__ = short_repr

    def moved(self, pose: Pose) -> Body:
        """Return the body with all of its geometry mapped by a pose."""
        shapes = tuple(replace(shape, pose=pose @ shape.pose) for shape in self.shapes)
        return replace(self, shapes=shapes, pieces=tuple(piece.transformed(pose) for piece in self.pieces))


class MeshPart(NamedTuple):
    """Describe one mesh of an object that has several.

    Args:
        vertices: [m], shape (V, 3). triangles: shape (T, 3), counter-clockwise seen from outside.
        pose: `T_object_mesh`, identity by default. role: graspable or obstacle.
        name: for messages and contacts.
    """

    vertices: ArrayLike
    triangles: ArrayLike
    pose: Pose | None = None
    role: BodyRole | str = BodyRole.GRASPABLE
    name: str = ""


@dataclass(frozen=True)
class GraspObject:
    """An object to grasp, with its obstacles.

    Args:
        name: for messages and records.
        bodies: at least one graspable body.
        pose: `T_world_object`.
        collision_source: which geometry is meant.
        warnings: sentences about problems (units, winding, holes).
        path: the file it was read from, or None. scale: factor on the lengths of the file [-].
    """

    name: str
    bodies: tuple[Body, ...]
    pose: Pose = field(default_factory=Pose.identity)
    collision_source: CollisionSource = CollisionSource.RAW
    warnings: tuple[str, ...] = ()
    path: Path | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        check_type(self.pose, Pose, "pose")
        if not any(body.role is BodyRole.GRASPABLE for body in self.bodies):
            raise ObjectError(f"{self.name}: expected at least one graspable body, got obstacles only.")

    def __repr__(self) -> str:
        bodies = {body.name: body.role.value for body in self.bodies}
        return described(self, name=self.name, bodies=bodies, pose=self.pose, scale=self.scale)

    @classmethod
    def load(
        cls,
        model: str | Path,
        *,
        scale: float = 1.0,
        pose: Pose | None = None,
        collision_source: CollisionSource | str = CollisionSource.RAW,
    ) -> GraspObject:
        """Read an object by built-in name, from a mesh file, or from a shape written as text.

        Args:
            model: ``"mug"``, ``"bottle"``, ``"screwdriver"``, ``"ball"``; a path to obj, stl, ply, off or glb;
                or ``"sphere:r=0.03"``, ``"cylinder:r=0.03,h=0.1"``, ``"capsule:r=0.02,h=0.1"`` (h: straight part),
                ``"box:x=0.1,y=0.05,z=0.03"`` (full lengths), ``"ellipsoid:a=0.03,b=0.02,c=0.05"`` (semi-axes).
            scale: multiplies every length.
            pose: `T_world_object`, identity by default.
            collision_source: `raw` (default), `engine` (the simulator's geometry: convex pieces if known, else the
                convex hull of every mesh) or `visual` (as raw).

        Raises:
            FileError: missing file, not a mesh. ObjectError: empty, NaN, bad parameter. UnknownNameError.
        """
        from .object_loading import load_object

        return load_object(model, scale=scale, pose=pose, collision_source=collision_source)

    @classmethod
    def from_shape(
        cls,
        shape: Shape | str,
        *,
        name: str = "",
        pose: Pose | None = None,
        role: BodyRole | str = BodyRole.GRASPABLE,
        collision_source: CollisionSource | str = CollisionSource.RAW,
    ) -> GraspObject:
        """Make an object of one shape, given as a `Shape` or as text like ``"box:x=0.1,y=0.05,z=0.03"``.

        Raises:
            ObjectError: sizes that are not positive, or a malformed mesh. UnknownNameError: no such shape.
        """
        from .object_loading import object_from_shape

        return object_from_shape(shape, name=name, pose=pose, role=role, collision_source=collision_source)

    @classmethod
    def from_meshes(
        cls,
        parts: Iterable[MeshPart | tuple[Any, ...]],
        *,
        name: str = "object",
        pose: Pose | None = None,
        collision_source: CollisionSource | str = CollisionSource.RAW,
    ) -> GraspObject:
        """Make one object of several meshes, each with its pose and role.

        Args:
            parts: `MeshPart`, or tuples `(vertices, triangles, pose, role, name)` whose last three may be left out.
            name: for messages and records. pose: `T_world_object`. collision_source: as in `load`.

        Raises:
            ObjectError: empty, NaN, an index out of range, no graspable part. UnknownNameError: no such role.
        """
        from .object_loading import object_from_meshes

        return object_from_meshes(parts, name=name, pose=pose, collision_source=collision_source)

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Names of the bodies that are obstacles."""
        return tuple(body.name for body in self.bodies if body.role is BodyRole.OBSTACLE)

    def posed(self, pose: Pose) -> GraspObject:
        """Return the object at another `T_world_object`."""
        return replace(self, pose=pose)

    def with_friction(self, friction: float) -> GraspObject:
        """Return the object with a sliding friction [-] of all its surfaces.

        Raises:
            ObjectError: not a finite number above 0.
        """
        if not (math.isfinite(friction) and friction > 0.0):
            raise ObjectError(f"{self.name}: friction: expected a finite number above 0, got {friction!r}.")
        return replace(self, bodies=tuple(replace(body, friction=float(friction)) for body in self.bodies))

    def with_body(self, body: Body) -> GraspObject:
        """Return the object with one more body, such as an obstacle; see `table` for one.

        Raises:
            CommandError: no `Body`.
        """
        check_type(body, Body, "body")
        return replace(self, bodies=(*self.bodies, body))

    def with_object(
        self, other: GraspObject, pose: Pose | None = None, role: BodyRole | str | None = None
    ) -> GraspObject:
        """Return the object with the bodies of another one.

        Args:
            other: its own `T_world_object` is not used.
            pose: `T_object_other`, where the other stands in this object's frame; identity by default.
            role: role of its bodies for the hand; None keeps their own.

        Raises:
            UnknownNameError: no such role. CommandError: no `GraspObject`.
        """
        from .object_loading import role_named

        check_type(other, GraspObject, "other")
        placed = (body.moved(pose) if pose else body for body in other.bodies)
        added = tuple(replace(body, role=role_named(role)) if role else body for body in placed)
        return replace(self, bodies=(*self.bodies, *added), warnings=(*self.warnings, *other.warnings))
