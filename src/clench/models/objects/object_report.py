"""Describe an object: the output of `clench object`."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Final

from numpy.typing import ArrayLike

from clench.core.exceptions import ObjectError
from clench.core.numbers import real_array
from clench.models.shapes import ShapeKind

from .grasp_object import Body, GraspObject
from .mass import mass_properties
from .stable_poses import StablePose, graspable_points, stable_poses

SCHEMA: Final = "clench.object/1"

#: Probability that is shown as a number; a smaller one would be 0.0 %.
_LEAST_SHARE: Final = 0.001


@dataclass(frozen=True)
class BodyReport:
    """Describe one body.

    Args:
        shapes: their kinds. triangles: of its meshes. watertight: every mesh is closed and wound outwards.
    """

    name: str
    role: str
    shapes: tuple[str, ...]
    triangles: int
    watertight: bool
    friction: float | None


@dataclass(frozen=True)
class ObjectReport:
    """Describe an object in its own frame; obstacles count in `bodies` only.

    Args:
        name: of the object. path: its file, or None. scale: factor on the lengths of the file [-].
        lower, upper: corners of the bounding box [m], shape (3,). size: its sides [m].
        volume: [m³]. center_of_mass: [m], the given one, or that of uniform density.
        watertight: every graspable body is closed; the volume of an open one is that of its convex hull.
        bodies: see `BodyReport`.
        stable_poses: see `clench.stable_poses`; empty for a flat object.
        no_stable_pose: a sentence that says why there is none, or None.
        warnings: sentences about problems.
    """

    name: str
    path: str | None
    scale: float
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    size: tuple[float, ...]
    volume: float
    center_of_mass: tuple[float, ...]
    watertight: bool
    bodies: tuple[BodyReport, ...]
    stable_poses: tuple[StablePose, ...]
    no_stable_pose: str | None
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with schema `clench.object/1`."""
        document = {"schema": SCHEMA, **asdict(self)}
        document["stable_poses"] = [
            asdict(s) | {"pose": s.pose.to_dict(), "tip_angle": s.tip_angle} for s in self.stable_poses
        ]
        return document

    def summary_rows(self) -> list[tuple[str, str]]:
        """Return label and text: size, volume, centre of mass, shapes."""
        sides = " x ".join(f"{side * 1e3:.4g}" for side in self.size)
        box = f"{sides} mm, from {_vector(self.lower)} to {_vector(self.upper)} m"
        hull = "" if self.watertight else " (of the convex hull: the mesh is not watertight)"
        return [
            ("object", self.name if self.path is None else f"{self.name} ({self.path})"),
            ("size", box),
            ("volume", f"{self.volume * 1e6:.4g} cm³{hull}"),
            ("centre of mass", f"{_vector(self.center_of_mass)} m"),
            ("watertight", "yes" if self.watertight else "no"),
            *((body.role, _body_text(body)) for body in self.bodies),
        ]

    def pose_rows(self) -> list[tuple[str, ...]]:
        """Return probability, direction that points down, height of the centre of mass [mm], and supporting face."""
        return [_pose_row(stable) for stable in self.stable_poses]


def describe_object(obj: GraspObject, center_of_mass: ArrayLike | None = None) -> ObjectReport:
    """Return size, mass properties and stable poses of an object.

    Args:
        obj: the object. center_of_mass: in its frame [m]; None: that of uniform density.

    Raises:
        ObjectError, CommandError: the given centre of mass is malformed, or not inside of the convex hull.
    """
    points, mass = graspable_points(obj), mass_properties(obj)
    found, reason = tuple[StablePose, ...](), None
    try:
        found = stable_poses(obj, center_of_mass=center_of_mass)
    except ObjectError as error:
        if center_of_mass is not None:
            raise
        reason = str(error)
    center = mass.center if center_of_mass is None else real_array(center_of_mass)
    assert center is not None  # `stable_poses` has checked it
    low, high = points.min(axis=0), points.max(axis=0)
    return ObjectReport(
        name=obj.name,
        path=None if obj.path is None else str(obj.path),
        scale=obj.scale,
        lower=tuple(low.tolist()),
        upper=tuple(high.tolist()),
        size=tuple((high - low).tolist()),
        volume=mass.volume,
        center_of_mass=tuple(center.tolist()),
        watertight=mass.exact,
        bodies=tuple(_body(body) for body in obj.bodies),
        stable_poses=found,
        no_stable_pose=reason,
        warnings=obj.warnings,
    )


def _body(body: Body) -> BodyReport:
    return BodyReport(
        name=body.name,
        role=str(body.role),
        shapes=tuple(str(shape.kind) for shape in body.shapes),
        triangles=sum(len(s.mesh.triangles) for s in body.shapes if s.kind is ShapeKind.MESH and s.mesh is not None),
        watertight=body.closed,
        friction=body.friction,
    )


def _body_text(body: BodyReport) -> str:
    made = ", ".join(body.shapes)
    return f"{body.name}: {made}" + (f", {body.triangles} triangles in all" if body.triangles else "")


def _pose_row(stable: StablePose) -> tuple[str, ...]:
    if stable.facets == 1:
        base = f"flat, tips at {math.degrees(stable.tip_angle):.1f}°"
    else:
        base = f"rolls, {stable.facets} facets in {math.degrees(stable.spread):.0f}°"
    down = tuple((-stable.pose.rotation[2]).tolist())
    share = f"{100.0 * stable.probability:.1f} %" if stable.probability >= _LEAST_SHARE else "below 0.1 %"
    return share, _vector(down, 3), f"{stable.center_height * 1e3:.1f}", base


def _vector(values: tuple[float, ...], digits: int = 6) -> str:
    """Return numbers as text, rounded so that rounding errors become 0."""
    return "[" + ", ".join(f"{round(value, digits) + 0.0:.4g}" for value in values) + "]"
