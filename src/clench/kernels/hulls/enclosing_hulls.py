"""Convex hulls around the parts of a body, and their points that lie farthest along a direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import kernel

from .corner_tables import Small, Whole, cone_of, make_table

#: Hulls with more corners than this have a table.
FEW: Final = 16
#: A part with more points, or more corners of its hull, has no hull.
MOST_POINTS: Final = 60_000
MOST_CORNERS: Final = 8_000
#: Distances of points from faces that are in memory at once.
AT_ONCE: Final = 2_000_000
#: More than rounding, as a fraction of a hull's size [-].
ROUNDING: Final = 1e-12
#: Points are taken to lie in a plane if their box is thinner than this fraction of its size [-].
THIN: Final = 1e-6
#: The balls that cover a hull are so many at most, and those that cover a body; a body of more hulls has none.
HULL_BALLS: Final = 8
BODY_BALLS: Final = 64
#: Cells of a hull that is grown need not be shorter than this multiple of the radius [-].
SMALL: Final = 1.5


class HullPart(NamedTuple):
    """A part of a body.

    Args:
        points: [m], (P, 3). radius: by which their hull is grown to enclose the part [m].
        convex: whether the part fills its hull, see `is_convex`.
    """

    points: Floats
    radius: float
    convex: bool = False


class HullArrays(NamedTuple):
    """Hulls of the parts of several bodies; H hulls, B bodies, C cones of all tables.

    Args:
        points: corners of all hulls, in the bodies' frames [m], (P, 3). first: first corner of each hull, (H + 1,).
        radius: by which each hull is grown to enclose its part [m], (H,). body: first hull of each body, (B + 1,).
        box: pose of a box around the corners of each hull, and half its sizes [m], (H, 3, 5).
        ball: centre and radius of balls that cover a body together [m], (K, 4). cover: first ball of each hull,
            (H + 1,).
        convex: whether each part fills its hull, (H,).
        table: first cone of each hull, or -1 without a table, (H,).
        cone, entry: see `CornerTable`; those of all hulls. Entries are rows of `points`.
    """

    points: Floats
    first: Whole
    radius: Floats
    body: Whole
    box: Floats
    ball: Floats
    cover: Whole
    convex: Whole
    table: Whole
    cone: Small
    entry: Small


def pack_hulls(bodies: Sequence[Sequence[HullPart]]) -> HullArrays:
    """Enclose the parts of bodies in hulls.

    Args:
        bodies: of each body the parts.
    """
    parts = [[_corners(part) for part in body] for body in bodies]
    # A body whose parts are too large has no hulls.
    enclosed = [[hull for hull in found if hull] if all(found) else [] for found in parts]
    hulls = [hull for found in enclosed for hull in found]
    first = np.cumsum([0, *(len(hull.points) for hull in hulls)])
    points, table = [hull.points for hull in hulls], np.full(len(hulls), -1)
    cones, entries = [np.empty((0, 2), np.int32)], [np.empty(0, np.int32)]
    cone_count, entry_count = 0, 0
    for h in range(len(hulls)):
        if len(points[h]) > FEW:
            cone, entry, order = make_table(points[h])
            points[h], table[h] = points[h][order], cone_count
            cones.append(cone + np.where(cone[:, 1:] < 0, [cone_count, 0], [entry_count, 0]))
            entries.append(entry + first[h])
            cone_count, entry_count = cone_count + len(cone), entry_count + len(entry)
    boxes = np.array([_box(hull.points) for hull in hulls], dtype=np.float64).reshape(-1, 3, 5)
    radius, body = np.array([hull.radius for hull in hulls], dtype=np.float64), np.cumsum([0, *map(len, enclosed)])
    covers = [cover for i, j in pairwise(body) for cover in _cover(boxes[i:j], radius[i:j])]
    return HullArrays(
        np.concatenate([np.empty((0, 3)), *points]),
        first.astype(np.int64),
        radius,
        body.astype(np.int64),
        boxes,
        np.concatenate([np.empty((0, 4)), *covers]),
        np.cumsum([0, *map(len, covers)]).astype(np.int64),
        np.array([hull.convex for hull in hulls], dtype=np.int64),
        table.astype(np.int64),
        np.concatenate(cones).astype(np.int32),
        np.concatenate(entries).astype(np.int32),
    )


def _corners(part: HullPart) -> HullPart | None:
    """Return a part with the points that can be corners of its hull, and a radius by which that holds all of them.

    None stands for too many points or corners: a hull would take longer to make than it saves.

    Of points that nearly lie in a plane all are kept: rounding does not tell there which ones lie inside.
    """
    points, radius = np.unique(part.points, axis=0), part.radius
    if len(points) > MOST_POINTS:
        return None
    radius += ROUNDING * float(np.abs(points).max(initial=0.0))
    if len(points) <= FEW:
        return HullPart(points, radius, part.convex)
    everything = HullPart(points, radius, part.convex) if len(points) <= MOST_CORNERS else None
    if _box(points)[:, 4].min() < THIN * np.ptp(points, axis=0).max():
        return everything
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError:
        return everything
    outside = np.zeros(len(points), dtype=bool)
    outside[hull.vertices] = True
    if outside.sum() > MOST_CORNERS:
        return None
    left = np.flatnonzero(~outside)
    for some in np.array_split(left, len(left) * len(hull.equations) // AT_ONCE + 1):
        outside[some] = (points[some] @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1, initial=-1.0) > 0.0
    return HullPart(points[outside], radius, part.convex)


def _box(points: Floats) -> Floats:
    """Return the pose of a box around points along their principal axes, and half its sizes [m], (3, 5)."""
    # Three rows at least, so that there are three axes.
    about = np.vstack([points - points.mean(axis=0), np.zeros((3, 3))])
    axes = np.linalg.svd(about, full_matrices=False)[2]
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return np.column_stack([axes.T, axes.T @ middle, half + ROUNDING * np.abs(points).max(initial=0.0)])


def _cover(boxes: Floats, radius: Floats) -> list[Floats]:
    """Return balls that cover each hull of one body, (K, 4); none for a body of too many hulls.

    A box is divided into cells, and each cell has a ball.

    Args:
        boxes, radius: of the hulls, see `HullArrays`.
    """
    most, balls = min(HULL_BALLS, BODY_BALLS // max(len(boxes), 1)), []
    if most == 0:
        return [np.empty((0, 4))] * len(boxes)
    for box, grown in zip(boxes, radius, strict=True):
        half, cells = box[:, 4], np.ones(3, dtype=np.int64)
        while True:
            longest = int(np.argmax(half / cells))
            more = cells + (np.arange(3) == longest)
            if 2.0 * half[longest] <= SMALL * grown * cells[longest] or more.prod() > most:
                break
            cells = more
        steps = [size * ((2.0 * np.arange(n) + 1.0) / n - 1.0) for size, n in zip(half, cells, strict=True)]
        middles = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3) @ box[:, :3].T + box[:, 3]
        reach = (np.linalg.norm(half / cells) + grown) * (1.0 + ROUNDING)
        balls.append(np.column_stack([middles, np.full(len(middles), reach)]))
    return balls


@kernel
def lowest_point(points: Floats, first: int, last: int, x: float, y: float, z: float) -> tuple[float, int]:
    """Return the smallest coordinate of points along a vector, and the point that has it."""
    best, found = x * points[first, 0] + y * points[first, 1] + z * points[first, 2], first
    for k in range(first + 1, last):
        at = x * points[k, 0] + y * points[k, 1] + z * points[k, 2]
        if at < best:
            best, found = at, k
    return best, found


@kernel
def lowest_corner(hulls: HullArrays, hull: int, x: float, y: float, z: float) -> tuple[float, int]:
    """Return the smallest coordinate of a hull's corners along a vector, and the corner that has it."""
    points = hulls.points
    if hulls.table[hull] < 0:
        return lowest_point(points, hulls.first[hull], hulls.first[hull + 1], x, y, z)
    cone = cone_of(hulls.cone, hulls.table[hull], -x, -y, -z)
    begin, best, found = hulls.cone[cone, 0], math.inf, -1
    for n in range(begin, begin + hulls.cone[cone, 1]):
        k = hulls.entry[n]
        at = x * points[k, 0] + y * points[k, 1] + z * points[k, 2]
        if at < best:
            best, found = at, int(k)
    return best, found
