"""Lay curl planes across a finger, and cut its links by them (docs/method.md sections 1-2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clench.core.pose import FloatArray
from clench.core.tolerances import EDGE_INSET
from clench.models.shapes import Shape

from .outlines import RoundedOutline, cut_shape

#: An edge closer than this fraction of the width to another plane gets none of its own [-].
_SAME = 0.02


@dataclass(frozen=True, eq=False)
class LinkOutline:
    """Place one rounded outline: which link it is cut from, and which of the plan's joints moves it.

    Args:
        link: index in the hand. joint: index in the plan's joints. outline: relative to that joint's pivot.
    """

    link: int
    joint: int
    outline: RoundedOutline


@dataclass(frozen=True, eq=False)
class MovedLink:
    """Place a link that the joints of an axis group, or later ones, move.

    Args:
        link: index in the hand. joint: index in the plan's joints of the axis group's last joint before the link.
        T_axis_group_link: at the open posture, shape (4, 4). shapes: of the link, in its frame.
        pivot: of the joint [m], shape (2,). arm: the joint gets no farther from the axis group's origin [m].
    """

    link: int
    joint: int
    T_axis_group_link: FloatArray
    shapes: tuple[Shape, ...]
    pivot: FloatArray
    arm: float


@dataclass(frozen=True, eq=False)
class AxisGroup:
    """The parallel curl planes that consecutive joints share.

    Args:
        T_palm_axis_group: at the open posture, shape (4, 4); y is normal to the planes.
        offsets: of the planes along y [m], shape (P,).
        moved: the links that the planes cut.
    """

    T_palm_axis_group: FloatArray
    offsets: FloatArray
    moved: tuple[MovedLink, ...]

    @cached_property
    def outlines(self) -> tuple[tuple[LinkOutline, ...], ...]:
        """Per plane, the outlines of every moved link; cut when first read."""
        return tuple(tuple(o for moved in self.moved for o in _cut(moved, float(y))) for y in self.offsets)

    @cached_property
    def reach(self) -> float:
        """No moved point on a plane gets farther from the axis group's origin in the plane [m]."""
        arms, reach = {moved.joint: moved.arm for moved in self.moved}, 0.0
        for o in (o for row in self.outlines for o in row):
            far = float(np.linalg.norm(o.outline.vertices, axis=1).max()) + o.outline.radius
            reach = max(reach, arms[o.joint] + far)
        return reach

    def pivot_in_palm(self, pivot: FloatArray) -> FloatArray:
        """Return a pivot of its joints in the palm frame at the open posture [m], shape (3,)."""
        T = self.T_palm_axis_group
        return np.asarray(T[:3, 3] + T[:3, 0] * pivot[0] + T[:3, 2] * pivot[1])


def axis_group_frame(axis: FloatArray, origin: FloatArray, towards: FloatArray) -> FloatArray:
    """Return the curl-plane frame of a joint, right-handed, shape (4, 4).

    Args:
        axis: closing axis, unit: closing turns x towards z, so y is minus the axis.
        origin: a point on the axis [m]. towards: the point that x points to [m].
    """
    y = -axis
    x = towards - origin
    x = x - y * (x @ y)
    size = np.linalg.norm(x)
    if size < 1e-9:
        x = np.eye(3)[np.argmin(np.abs(y))]
        x = x - y * (x @ y)
        size = np.linalg.norm(x)
    # Once more, now that it is long: the little that is left of a target almost on the axis is mostly rounding.
    x = x / size - y * ((x / size) @ y)
    x = x / np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3] = x, y, np.cross(x, y), origin
    return frame


def plane_offsets(extents: list[tuple[float, float]], count: int) -> FloatArray:
    """Place curl planes across a finger, shape (P,), ascending [m].

    One plane lies in the middle. Two lie at both edges, inset by 1e-4 of the width. Three or more lie at the edges,
    evenly between them, and at the edges of every narrower shape. The edge of a narrower shape is left out if it is
    nearer to another edge than 2 % of the width or half the spacing.

    Args:
        extents: least and greatest y of every shape of every link [m]. count: at least 1.
    """
    low, high = min(e[0] for e in extents), max(e[1] for e in extents)
    width = high - low
    if count == 1 or width <= 0.0:
        return np.array([0.5 * (low + high)])
    offsets = np.linspace(low + EDGE_INSET * width, high - EDGE_INSET * width, count)
    if count < 3:
        return offsets
    near = min(_SAME * width, 0.5 * (offsets[1] - offsets[0]))
    edges = sorted(y for a, b in extents for y in (a + EDGE_INSET * (b - a), b - EDGE_INSET * (b - a)))
    groups: list[list[float]] = []
    for y in edges:
        if np.abs(offsets - y).min() > near:
            if not groups or y - groups[-1][-1] > near:
                groups.append([])
            groups[-1].append(y)
    # The middle of each group, so that a mirrored hand gets mirrored planes.
    return np.sort([*offsets, *(0.5 * (g[0] + g[-1]) for g in groups)])


def refined(offsets: FloatArray, count: int) -> FloatArray:
    """Return `count` planes: the given ones, and as many evenly spaced ones as are missing.

    All axis groups of a finger have as many, so that plane k means the same part of the width in each. A plane that
    comes up twice is harmless.
    """
    missing = count - len(offsets)
    between = np.linspace(offsets[0], offsets[-1], missing + 2)[1:-1]
    return np.sort(np.concatenate([offsets, between]))


def _cut(moved: MovedLink, offset: float) -> list[LinkOutline]:
    cut = (cut_shape(shape, moved.T_axis_group_link, offset) for shape in moved.shapes)
    return [LinkOutline(moved.link, moved.joint, o.about(moved.pivot)) for o in cut if o is not None]
