"""Convex hulls around the parts of a body, and their points that lie farthest along a direction.

Of a hull with many corners, a table tells which corners can lie farthest along any of a small cone of directions. A
corner v is left out of a cone about the unit vector d if `d·(u - v) > ε |u - v|`: u is the corner that lies farthest
along d, and no direction of the cone differs from d by more than ε.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import kernel

Whole = NDArray[np.int64]

#: Hulls with more corners than this have a table.
FEW: Final = 16
#: From so many corners on a table is finer; cones along an edge of the cube of directions in either case.
MANY: Final = 1500
COARSE: Final = 8
FINE: Final = 12
#: A part with more points, or more corners of its hull, has no hull.
MOST_POINTS: Final = 60_000
MOST_CORNERS: Final = 8_000
#: Distances of points from faces that are in memory at once.
AT_ONCE: Final = 2_000_000
#: More than rounding, as a fraction of a hull's size [-].
ROUNDING: Final = 1e-12
#: Points are taken to lie in a plane if their box is thinner than this fraction of its size [-].
THIN: Final = 1e-6
#: By which a cone is widened [-].
SLACK: Final = 1e-6


class HullArrays(NamedTuple):
    """Hulls of the parts of several bodies; H hulls, B bodies, C cones of all tables.

    Args:
        points: corners of all hulls, in the bodies' frames [m], (P, 3). first: first corner of each hull, (H + 1,).
        radius: by which each hull is grown to enclose its part [m], (H,). body: first hull of each body, (B + 1,).
        box: pose of a box around the corners of each hull, and half its sizes [m], (H, 3, 5).
        side: cones along an edge of the cube of directions, 0 without a table, (H,). cone: first cone of each, (H,).
        begin: first entry of each cone in `corner`, (C + 1,). corner: those that a cone has to be searched for, (N,).
    """

    points: Floats
    first: Whole
    radius: Floats
    body: Whole
    box: Floats
    side: Whole
    cone: Whole
    begin: Whole
    corner: NDArray[np.int32]


def pack_hulls(bodies: Sequence[Sequence[tuple[Floats, float]]]) -> HullArrays:
    """Enclose the parts of bodies in hulls.

    Args:
        bodies: of each body the parts: points [m], (P, 3), and the radius by which their hull is grown [m].
    """
    parts = [[_corners(points, radius) for points, radius in body] for body in bodies]
    # A body whose parts are too large has no hulls.
    enclosed = [[hull for hull in found if hull] if all(found) else [] for found in parts]
    hulls = [hull for found in enclosed for hull in found]
    first = np.cumsum([0, *(len(points) for points, _ in hulls)])
    sides = [0 if len(p) <= FEW else COARSE if len(p) <= MANY else FINE for p, _ in hulls]
    listed = [
        found + at for (p, _), side, at in zip(hulls, sides, first, strict=False) if side for found in _table(p, side)
    ]
    return HullArrays(
        np.concatenate([np.empty((0, 3)), *(points for points, _ in hulls)]),
        first.astype(np.int64),
        np.array([radius for _, radius in hulls], dtype=np.float64),
        np.cumsum([0, *map(len, enclosed)]).astype(np.int64),
        np.array([_box(points) for points, _ in hulls], dtype=np.float64).reshape(-1, 3, 5),
        np.array(sides, dtype=np.int64),
        np.cumsum([0, *(6 * side * side for side in sides)])[:-1].astype(np.int64),
        np.cumsum([0, *(len(found) for found in listed)]).astype(np.int64),
        np.concatenate([np.empty(0, np.int32), *listed]).astype(np.int32),
    )


def _corners(points: Floats, radius: float) -> tuple[Floats, float] | None:
    """Return the points that can be corners of their hull, and the radius by which that is grown to hold all of them.

    None stands for too many points or corners: a hull would take longer to make than it saves.

    Of points that nearly lie in a plane all are kept: rounding does not tell there which ones lie inside.
    """
    points = np.unique(points, axis=0)
    if len(points) > MOST_POINTS:
        return None
    radius += ROUNDING * float(np.abs(points).max(initial=0.0))
    if len(points) <= FEW:
        return points, radius
    everything = (points, radius) if len(points) <= MOST_CORNERS else None
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
    return points[outside], radius


def _box(points: Floats) -> Floats:
    """Return the pose of a box around points along their principal axes, and half its sizes [m], (3, 5)."""
    # Three rows at least, so that there are three axes.
    about = np.vstack([points - points.mean(axis=0), np.zeros((3, 3))])
    axes = np.linalg.svd(about, full_matrices=False)[2]
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return np.column_stack([axes.T, axes.T @ middle, half + ROUNDING * np.abs(points).max(initial=0.0)])


def _table(points: Floats, side: int) -> list[Whole]:
    """Return the corners that can lie farthest along the directions of each cone, in the order of `cone_of`."""
    directions, width = _cones(side)
    found = []
    for d, epsilon in zip(directions, width, strict=True):
        along = points @ d
        top = int(np.argmax(along))
        away = np.sqrt(((points - points[top]) ** 2).sum(axis=1))
        found.append(np.flatnonzero(along[top] - along <= (epsilon * (1.0 + SLACK) + SLACK) * away))
    return found


def _cones(side: int) -> tuple[Floats, Floats]:
    """Return the middle of each cone and how far a direction of the cone is from it at most."""
    middle, half = (2.0 * np.arange(side) + 1.0) / side - 1.0, 1.0 / side

    def directions(shift: tuple[float, float]) -> Floats:
        a, b = np.meshgrid(middle + shift[0], middle + shift[1], indexing="ij")
        out = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                d = np.empty((side, side, 3))
                d[..., axis], d[..., (axis + 1) % 3], d[..., (axis + 2) % 3] = sign, a, b
                out.append(d.reshape(-1, 3))
        found: Floats = np.concatenate(out)
        unit: Floats = found / np.linalg.norm(found, axis=1)[:, None]
        return unit

    center = directions((0.0, 0.0))
    ends = [directions((x, y)) for x in (-half, half) for y in (-half, half)]
    return center, np.max([np.linalg.norm(end - center, axis=1) for end in ends], axis=0)


@kernel
def place_on_edge(a: float, side: int) -> int:
    """Return the number of the interval that a coordinate from -1 to 1 is in."""
    return int(min(max(int(0.5 * (a + 1.0) * side), 0), side - 1))


@kernel
def cone_of(x: float, y: float, z: float, side: int) -> int:
    """Return the cone that a direction is in."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        axis, top, a, b, size = 0, x, y, z, ax
    elif ay >= az:
        axis, top, a, b, size = 1, y, z, x, ay
    else:
        axis, top, a, b, size = 2, z, x, y, az
    if not size > 0.0:
        return 0
    face = 2 * axis + (0 if top > 0.0 else 1)
    return (face * side + place_on_edge(a / size, side)) * side + place_on_edge(b / size, side)


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
    points, side = hulls.points, hulls.side[hull]
    if side == 0:
        return lowest_point(points, hulls.first[hull], hulls.first[hull + 1], x, y, z)
    cone = hulls.cone[hull] + cone_of(-x, -y, -z, side)
    best, found = math.inf, -1
    for n in range(hulls.begin[cone], hulls.begin[cone + 1]):
        k = hulls.corner[n]
        at = x * points[k, 0] + y * points[k, 1] + z * points[k, 2]
        if at < best:
            best, found = at, k
    return best, found
