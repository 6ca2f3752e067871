"""The object: bodies made of shapes, with a pose, a role and a note of what was checked."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

from clench.base.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape


class BodyRole(StrEnum):
    """Name what a body is to the hand."""

    GRASPABLE = "graspable"
    """the fingers close around it"""
    OBSTACLE = "obstacle"
    """the fingers stop at it, but a touch is no grasp (table, clutter)"""


@dataclass(frozen=True)
class Body:
    """Describe one rigid part of the scene, in the object's frame.

    Args:
        name: for messages and contacts.
        shapes: its geometry, in the object's frame.
        role: graspable or obstacle.
        pieces: convex pieces that approximate it for simulation, in the object's frame; empty when not known.
        closed: every mesh is watertight with consistent outward winding, so one-sided contact tests are exact.
    """

    name: str
    shapes: tuple[Shape, ...]
    role: BodyRole = BodyRole.GRASPABLE
    pieces: tuple[TriangleMesh, ...] = ()
    closed: bool = True


@dataclass(frozen=True)
class GraspObject:
    """Hold an object to grasp, with its obstacles.

    Args:
        name: for messages and records.
        bodies: at least one graspable body.
        pose: `T_world_object`.
        collision_source: which geometry is meant.
        warnings: sentences about what looks wrong (units, winding, holes).
        path: the file it was read from, or None.
    """

    name: str
    bodies: tuple[Body, ...]
    pose: Pose = field(default_factory=Pose.identity)
    collision_source: CollisionSource = CollisionSource.RAW
    warnings: tuple[str, ...] = ()
    path: Path | None = None

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
                or ``"sphere:r=0.03"``, ``"cylinder:r=0.03,h=0.1"``, ``"capsule:r=0.02,h=0.1"``,
                ``"box:x=0.1,y=0.05,z=0.03"`` (full lengths), ``"ellipsoid:a=0.03,b=0.02,c=0.05"`` (semi-axes).
            scale: multiplies every length.
            pose: `T_world_object`, identity by default.
            collision_source: `raw` (default), `engine` (the convex hull of every mesh) or `visual` (as raw).

        Raises:
            FileError: missing file, not a mesh. ObjectError: empty, NaN, bad parameter. UnknownNameError.
        """
        from .loading import load_object

        return load_object(model, scale=scale, pose=pose, collision_source=collision_source)

    def posed(self, pose: Pose) -> GraspObject:
        """Return the object at another `T_world_object`."""
        return replace(self, pose=pose)

    def with_body(self, body: Body) -> GraspObject:
        """Return the object with one body more, e.g. an obstacle."""
        return replace(self, bodies=(*self.bodies, body))
