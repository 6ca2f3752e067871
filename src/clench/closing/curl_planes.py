"""Lay curl planes across a finger (docs/method.md section 1)."""

from __future__ import annotations

import numpy as np

from clench.core.pose import FloatArray
from clench.core.tolerances import EDGE_INSET

#: An edge closer than this fraction of the width to another plane gets none of its own [-].
_SAME = 0.02


def family_frame(axis: FloatArray, origin: FloatArray, towards: FloatArray) -> FloatArray:
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

    All families of a finger have as many, so that plane k means the same part of the width in each. A plane that
    comes up twice is harmless.
    """
    missing = count - len(offsets)
    between = np.linspace(offsets[0], offsets[-1], missing + 2)[1:-1]
    return np.sort(np.concatenate([offsets, between]))
