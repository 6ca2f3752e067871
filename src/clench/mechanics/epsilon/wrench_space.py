"""Compute the epsilon quality, the largest ball of wrenches that a grasp resists, and the volume of the resisted
wrenches.

C. Ferrari and J. Canny, "Planning optimal grasps", ICRA 1992. The grasp wrench space W holds all wrenches that contact
forces inside their cones can exert, with normal forces bounded either together or each:

- L1: the normal forces sum to at most 1 N; W is the convex hull of 0 and all edges' wrenches;
- L∞: each normal force is at most 1 N; W is the Minkowski sum of the contacts' own hulls with 0.

Epsilon is the radius of the largest ball around 0 inside W, 0 when 0 is not inside. With the wrenches of `grasp_map`
it is a force [N] per bound of 1 N; volume is that of W in six dimensions [N^6].

Epsilon is found by expansion. The hull of a few points of W lies inside W. If W's support beats the nearest facet that
is not known to belong to W, its point is added. When no such facet is left, the nearest facet is W's. For L1, the
nearest facets around a few directions are found first. They usually suffice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

#: Rounding allowed in the offset of a facet, as a fraction of the largest wrench [-].
_ROUNDING = 1e-10
#: Facets per call: fewer facets need more hulls, more facets make the hulls grow.
_BATCH = 64
#: After this many expansions, only rounding keeps them going. The result is still a lower bound.
_EXPANSIONS = 500

#: Points that lie this far below a facet are on it [N].
_SAME_FACET = 1e-9
#: Points within this fraction of the largest wrench count as 0 [-].
_NOTHING = 1e-12

#: Searches for a near facet, from the same directions every time: eight find the nearest of 12 contacts 9 times in 10.
_STARTS = 8
_SEED = 0

#: A support function: for unit directions, shape (M, D), points of the set that lie farthest along each, shape (M, D).
Support = Callable[[FloatArray], FloatArray]


class WrenchNorm(StrEnum):
    """Name how normal forces are bounded."""

    L1 = "L1"
    """their sum is at most 1 N"""
    LINF = "Linf"
    """each is at most 1 N"""


@dataclass(frozen=True, eq=False)
class Ball:
    """The largest ball around 0 inside a set of wrenches.

    Args:
        radius: 0 when 0 is not inside [N].
        weakest: unit direction in which the set reaches least far, shape (D,); None when the set is flat.
    """

    radius: float
    weakest: FloatArray | None

    __repr__ = short_repr


def epsilon_l1(wrenches: FloatArray) -> Ball:
    """Return the ball of the L1 wrench space: the convex hull of 0 and the given wrenches.

    Args:
        wrenches: of all edges of all contacts, shape (N, 6).
    """
    points = wrenches.reshape(-1, wrenches.shape[-1])
    if spanned_dimensions(points) < points.shape[1]:
        return Ball(0.0, None)
    directions, reach = weak_directions(points, _STARTS)
    least = int(reach.argmin())
    if not reach[least] > 0.0:
        return Ball(0.0, directions[least])
    along = points @ directions.T
    return largest_ball(
        lambda normals: points[(points @ normals.T).argmax(axis=0)],
        points,
        known=points[(along >= along.max(axis=0) - _SAME_FACET).any(axis=1)],
        most=float(reach[least]),
    )


def weak_directions(wrenches: FloatArray, starts: int, near: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Return unit directions in which wrenches reach less than nearby, and how far: at least 0, shapes (M, D), (M,).

    Args:
        wrenches: at least one, shape (N, D). starts: where searches start: opposite to the wrenches, then all around.
        near: where another search starts, shape (D,).
    """
    from clench.kernels.mechanics.weak_direction import nearer_facets

    size = wrenches.shape[1]
    largest = float(np.abs(wrenches).max())
    # Uneven, so that no symmetry of a grasp is kept, and no search rests half-way between two facets.
    around = np.random.default_rng(_SEED).normal(size=(starts, size))
    around[0] = 0.1 * largest * around[0] - wrenches.mean(axis=0)
    begun = around if near is None else np.vstack([around, near])
    found, reach = np.empty_like(begun), np.empty(len(begun))
    nearer_facets(np.ascontiguousarray(wrenches), begun, found, reach)
    return found, np.where(reach > _NOTHING * largest, reach, 0.0)


def epsilon_linf(wrenches: FloatArray) -> Ball:
    """Return the ball of the L∞ wrench space: the Minkowski sum of the hulls of 0 and the edges of each contact.

    Args:
        wrenches: edges by contact, shape (C, N, D).
    """

    def support(directions: FloatArray) -> FloatArray:
        along = wrenches @ directions.T
        best = along.argmax(axis=1)
        value = np.take_along_axis(along, best[:, None, :], axis=1)[:, 0]
        chosen = np.where(value[..., None] > 0.0, wrenches[np.arange(len(wrenches))[:, None], best], 0.0)
        total: FloatArray = chosen.sum(axis=0)
        return total

    return largest_ball(support, wrenches.reshape(-1, wrenches.shape[-1]))


def largest_ball(
    support: Support,
    generators: FloatArray,
    tolerance: float = _ROUNDING,
    batch: int = _BATCH,
    *,
    known: FloatArray | None = None,
    most: float = np.inf,
) -> Ball:
    """Return the largest ball around 0 inside a convex set that holds 0, given by its support function.

    Args:
        support: see `Support`. generators: points that span the set's directions, shape (N, D).
        tolerance: of the radius, as a fraction of the largest point found [-].
        batch: directions per call.
        known: points of the set that its nearest facet may have, shape (M, D). most: the set reaches no farther there.
    """
    size = generators.shape[1]
    if spanned_dimensions(generators) < size:
        return Ball(0.0, None)
    points = _first_points(support, np.empty((0, size)) if known is None else known, size)
    for _ in range(_EXPANSIONS):
        normals, offsets = _facets(points)
        nearest = np.argsort(offsets, kind="stable")[:batch]
        slack = tolerance * float(np.abs(points).max())
        asked = nearest[offsets[nearest] < most - slack]
        found = support(normals[asked])
        reach = np.einsum("md,md->m", found, normals[asked])
        most = min(most, float(reach.min(initial=np.inf)))
        fresh = _new_points(found[reach > offsets[asked] + slack], points)
        if not len(asked) or not len(fresh):
            break
        points = np.vstack([points, fresh])
    return Ball(max(0.0, float(offsets[nearest[0]])), normals[nearest[0]].copy())


def volume_l1(wrenches: FloatArray) -> float:
    """Return the volume of the convex hull of 0 and the given wrenches, shape (N, D); 0 when it is flat."""
    points = wrenches.reshape(-1, wrenches.shape[-1])
    if spanned_dimensions(points) < points.shape[1]:
        return 0.0
    return float(_hull(np.vstack([points, np.zeros((1, points.shape[1]))])).volume)


def spanned_dimensions(generators: FloatArray) -> int:
    """Return the dimension of the space that wrenches span, rounding left aside."""
    if not len(generators):
        return 0
    return int(np.linalg.matrix_rank(generators, tol=1e-9 * max(1e-300, float(np.abs(generators).max()))))


def _first_points(support: Support, known: FloatArray, size: int) -> FloatArray:
    """Return points of the set that span a body: known ones, along the axes, then along fixed other directions."""
    directions = np.vstack([np.eye(size), -np.eye(size)])
    points = np.unique(np.vstack([known, support(directions)]), axis=0)
    rng = np.random.default_rng(0)
    while len(points) <= size or spanned_dimensions(points - points[0]) < size:
        more = rng.normal(size=(2 * size, size))
        points = np.unique(
            np.vstack([points, support(more / np.linalg.norm(more, axis=1, keepdims=True)), 0.0 * points[:1]]), axis=0
        )
    return points


def _facets(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return outward unit normals (F, D) and offsets (F,) of the facets of a hull."""
    equations = _hull(points).equations
    return equations[:, :-1], -equations[:, -1]


def _hull(points: FloatArray) -> ConvexHull:
    """Return the hull of points, in triangulated facets.

    Qhull takes twice as long if it looks out for rounding. Without, it may leave points outside. Facets that close a
    surface and have all points on their inner side are those of the hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points, qhull_options="Qt Q0")
        equations = hull.equations
        beyond = (equations[:, :-1] @ points.T).max(axis=1) + equations[:, -1]
        if beyond.max() <= _ROUNDING * float(np.abs(points).max()):
            return hull
    except QhullError:
        pass
    try:
        return ConvexHull(points, qhull_options="Qt Qx")
    except QhullError:
        # Edges in one plane make facets that Qhull cannot merge; moving points by about 1e-10 of their size parts them.
        return ConvexHull(points, qhull_options="QJ")


def _new_points(found: FloatArray, points: FloatArray) -> FloatArray:
    known = {p.tobytes() for p in points}
    fresh = {p.tobytes(): p for p in found if p.tobytes() not in known}
    return np.array(list(fresh.values())).reshape(-1, points.shape[1])
