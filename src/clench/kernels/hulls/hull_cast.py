"""How far a convex hull moves along a line before it touches a body at rest (docs/method.md section 9).

A plane between a hull and a part of the body tells how far the hull moves before it passes the plane. From there the
next plane is looked for. The latest planes keep the hull off other parts as well.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.toi_work import PAIRS
from clench.kernels.trees.bvh import Ints as Stack
from clench.kernels.trees.obb import slab_top

from .enclosing_hulls import HullArrays
from .gjk import widest_gap
from .hull_motion import HullMotion, height
from .hull_window import top_along

#: A hull touches what is nearer than this [m].
NEAR = 1e-6
#: Planes to one element at most.
STEPS = 64
#: How near to the best direction the planes are [-].
FINE = 0.01
#: Planes that are kept; columns: the normal, the hull's height where the motion begins, and how fast it comes down.
PLANES, HEIGHT, DOWN = 6, 3, 4


class CastWork(NamedTuple):
    """Scratch space for a hull that moves along a line.

    Args:
        T: its pose where it is looked at, (3, 4). corners: of an element, (3, 3). simplex: see `widest_gap`, (5, 6).
        direction: of the latest plane, (3,). planes: the latest first, (PLANES, 5). stack: nodes that wait, (PAIRS, 3).
    """

    T: Floats
    corners: Floats
    simplex: Floats
    direction: Floats
    planes: Floats
    stack: Stack


class Cast(NamedTuple):
    """A hull that moves along a line.

    Args:
        hulls, hull: the hull. T: its pose where the motion begins, in the frame of the body at rest, (3, 4).
        along: unit vector, (3,). start: a travel before which the hull touches nothing [m].
    """

    hulls: HullArrays
    hull: int
    T: Floats
    along: Floats
    start: float


@kernel(allocates=True)
def make_cast_work() -> CastWork:
    """Allocate the scratch space of a cast."""
    return CastWork(
        np.empty((3, 4)),
        np.empty((3, 3)),
        np.empty((5, 6)),
        np.empty(3),
        np.empty((PLANES, 5)),
        np.empty((PAIRS, 3), dtype=np.int32),
    )


@kernel
def cast_hull(cast: Cast, body: BodyArrays, limit: float, work: CastWork) -> tuple[float, int]:
    """Return how far a hull moves until it is nearer than `NEAR` to an element of a body, and the element.

    Args:
        body: one body. limit: touches that are not before this travel are of no interest [m].

    Returns:
        distance [m], or `limit`; the element, or -1.
    """
    best, found, stack = limit, -1, work.stack
    for k in range(PLANES):
        work.planes[k, DOWN] = math.nan
    if body.root[0] < 0:
        return limit, -1
    for c in range(3):
        work.direction[c] = -cast.along[c]
    keep_plane(cast, 1.0, work)
    stack[0, 0], waiting = body.root[0], 1
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        if passes_node(cast, body, n, best, work):
            continue
        if body.count[n] == 0:
            right = body.right[n]
            k = 1 if ahead_of(cast, body.node[n + 1]) < ahead_of(cast, body.node[right]) else 0
            stack[waiting + k, 0], stack[waiting + 1 - k, 0] = n + 1, right
            waiting += 2
            continue
        for e in range(body.first[n], body.first[n] + body.count[n]):
            s = cast_to_element(cast, body, e, best, work)
            if s < best:
                best, found = s, e
    return best, found


@kernel
def ahead_of(cast: Cast, ball: Floats) -> float:
    """Return how far along the line a ball begins [m]."""
    return float(cast.along[0] * ball[0] + cast.along[1] * ball[1] + cast.along[2] * ball[2] - ball[3])


@kernel
def passes_node(cast: Cast, body: BodyArrays, n: int, best: float, work: CastWork) -> bool:
    """Say whether a plane tells that the hull touches nothing in a node before `best`."""
    slab: Any = body.slab[n]
    for k in range(PLANES):
        plane = work.planes[k]
        if math.isnan(plane[DOWN]):
            break
        if passes(cast, plane, slab_top(slab, plane[0], plane[1], plane[2]), best):
            return True
    return False


@kernel
def passes(cast: Cast, plane: Floats, top: float, best: float) -> bool:
    """Say whether the hull stays above a height over a plane until `best`."""
    return bool(plane[HEIGHT] - NEAR - max(plane[DOWN] * cast.start, plane[DOWN] * best) >= top)


@kernel
def cast_to_element(cast: Cast, body: BodyArrays, e: int, best: float, work: CastWork) -> float:
    """Return how far the hull moves until it touches an element; infinite if not before `best`.

    It is less where `STEPS` planes do not lead to the touch.
    """
    count, radius = body.corners[e], body.radius[e]
    for k in range(count):
        for c in range(3):
            work.corners[k, c] = body.vertices[body.elements[e, k], c]
    corners, hulls, n = work.corners[:count], cast.hulls, work.direction
    for k in range(PLANES):
        plane = work.planes[k]
        if math.isnan(plane[DOWN]):
            break
        top = top_along(hulls, -1, corners, radius, (plane[0], plane[1], plane[2]))
        if passes(cast, plane, top, best):
            return math.inf
    grown, s, along = hulls.radius[cast.hull] + radius, cast.start, cast.along
    copy_pose(cast.T, work.T)
    work.simplex[4, 5] = 0.0
    for c in range(3):
        n[c] = -along[c]
    for _ in range(STEPS):
        for c in range(3):
            work.T[c, 3] = cast.T[c, 3] + s * along[c]
        gap = widest_gap(hulls, cast.hull, work.T, hulls, -1, corners, (FINE, grown), work.simplex, n) - grown
        down = -(n[0] * along[0] + n[1] * along[1] + n[2] * along[2])
        if gap <= NEAR:
            keep_plane(cast, down, work)
            return s
        if down <= 0.0 or down * (best - s) <= gap - NEAR:
            keep_plane(cast, down, work)
            return math.inf
        s += (gap - 0.5 * NEAR) / down
    return s


@kernel
def keep_plane(cast: Cast, down: float, work: CastWork) -> None:
    """Put the latest plane before the others, and forget the last one."""
    planes, n, hull = work.planes, work.direction, cast.hull
    for k in range(PLANES - 1, 0, -1):
        for c in range(5):
            planes[k, c] = planes[k - 1, c]
    motion, across = HullMotion(hull, cast.hulls.radius[hull], 1.0, 0.0, 0.0, 0.0, 0.0), (n[0], n[1], n[2])
    planes[0, 0], planes[0, 1], planes[0, 2] = n[0], n[1], n[2]
    planes[0, HEIGHT], planes[0, DOWN] = height(cast.hulls, motion, cast.T, across), down
