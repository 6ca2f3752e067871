"""Obstacles: bodies that stop a hand but are no grasp."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from clench.core.argument_types import check_type
from clench.core.exceptions import ObjectError
from clench.core.numbers import is_finite_number
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind

from .grasp_object import Body, BodyRole
from .shape_text import parse_shape

#: Name of a table.
TABLE: Final = "table"


def table(
    height: float = 0.0, *, size: tuple[float, float] = (1.0, 1.0), thickness: float = 0.04, name: str = TABLE
) -> Body:
    """Return a table top under the object: a box whose upper face is at `height` in the object's frame [m].

    Raises:
        ObjectError: a length that is not a number above 0, or a height that is not a finite number.
    """
    lengths = (*size, thickness)
    if not is_finite_number(height) or not all(is_finite_number(v) and v > 0 for v in lengths):
        raise ObjectError(f"{name}: expected a finite height and lengths above 0 m, got {height!r} and {lengths}.")
    half = (size[0] / 2.0, size[1] / 2.0, thickness / 2.0)
    shape = Shape(ShapeKind.BOX, half, Pose([0.0, 0.0, height - thickness / 2.0]), name=name)
    return Body(name, (shape,), BodyRole.OBSTACLE)


def obstacle(shape: Shape | str, pose: Pose | None = None, *, name: str = "obstacle") -> Body:
    """Return an obstacle of one primitive.

    Args:
        shape: a shape, or text like ``"cylinder:r=0.03,h=0.1"``. pose: `T_object_shape`, replacing the shape's own.

    Raises:
        ObjectError, UnknownNameError: malformed text. CommandError: a pose that is no `Pose`.
    """
    if pose is not None:
        check_type(pose, Pose, "pose")
    made = parse_shape(shape) if isinstance(shape, str) else shape
    placed = replace(made, pose=made.pose if pose is None else pose, name=name)
    return Body(name, (placed,), BodyRole.OBSTACLE)
