"""Collision shapes, shared by hands and objects: five round or flat primitives and meshes."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from clench.core.caching.keeping import Keeper
from clench.core.pose import Pose
from clench.core.showing.short_repr import short_repr

from .mesh import TriangleMesh


class ShapeKind(StrEnum):
    """Name the kinds of shape; `size` in metres follows MuJoCo's half-size conventions."""

    SPHERE = "sphere"
    """`size = (radius, 0, 0)`"""
    CAPSULE = "capsule"
    """`size = (radius, half length of the core, 0)`, core along z"""
    CYLINDER = "cylinder"
    """`size = (radius, half length, 0)`, axis along z"""
    BOX = "box"
    """`size = half extents`"""
    ELLIPSOID = "ellipsoid"
    """`size = semi-axes`"""
    MESH = "mesh"
    """`size = (0, 0, 0)`; the triangles are in `mesh`, in the shape's frame"""

    @property
    def lengths(self) -> int:
        """Number of entries of `size` that count."""
        counts = {ShapeKind.MESH: 0, ShapeKind.SPHERE: 1, ShapeKind.CAPSULE: 2, ShapeKind.CYLINDER: 2}
        return counts.get(self, 3)


class CollisionSource(StrEnum):
    """Name which geometry of a model is meant (docs/method.md section 2); results compare only for the same choice."""

    ENGINE = "engine"
    """MuJoCo's collision geometry: primitives, and the convex hull of every mesh"""
    RAW = "raw"
    """the collision geometry with the triangles of its meshes as they are"""
    VISUAL = "visual"
    """the geometry that is drawn, triangles as they are"""


@dataclass(frozen=True)
class Shape(Keeper):
    """Place one shape in the frame of its link or body.

    Args:
        kind: which shape.
        size: half sizes [m] as `ShapeKind` says.
        pose: `T_link_shape`.
        mesh: the triangles of a mesh, in the shape's frame; None for primitives.
        name: the name in the model file, for messages.
    """

    kind: ShapeKind
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pose: Pose = field(default_factory=Pose.identity)
    mesh: TriangleMesh | None = None
    name: str = ""

    __repr__ = short_repr

    def to_mesh(self, deviation: float = 1e-4) -> TriangleMesh:
        """Return triangles inscribed in the shape, in the link's frame, off by at most `deviation` [m]."""
        from .tessellation import tessellate

        return tessellate(self, deviation).transformed(self.pose)

    def bounding_radius(self) -> float:
        """Return the radius [m] of a ball around the shape's own origin that holds it."""
        a, b, c = self.size
        match self.kind:
            case ShapeKind.SPHERE:
                return a
            case ShapeKind.CAPSULE:
                return a + b
            case ShapeKind.CYLINDER:
                return float(np.hypot(a, b))
            case ShapeKind.BOX:
                return float(np.sqrt(a * a + b * b + c * c))
            case ShapeKind.ELLIPSOID:
                return max(a, b, c)
            case ShapeKind.MESH:
                assert self.mesh is not None
                return float(np.linalg.norm(self.mesh.vertices, axis=1).max(initial=0.0))
