"""Pairs of places on an object that oppose each other (docs/method.md section 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.approach import GraspableSurface
from clench.closing.collision.packed_object import PackedObject
from clench.core.exceptions import ObjectError
from clench.core.pose import FloatArray
from clench.models.objects.grasp_object import GraspObject

from .regions import Region

#: Places on the surface that are drawn, and pairs that are kept.
_PLACES = 700
_PAIRS = 6000
#: Largest angle between the normals and the line between two places, as a part of the friction angle; the next value
#: applies if this one gives too few pairs [-].
_LEAN = (0.75, 1.25, 2.0)
_ENOUGH = 40
#: Pairs are farther apart than this [m].
_NEAREST = 1e-3
#: Radius around a place within which the object's extent is measured [m].
_AROUND = 0.06


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of places on an object, each in both senses, in the object's frame, narrow ones first.

    Args:
        middle: between both [m], shape (P, 3). way: unit vector from the first to the second, shape (P, 3).
        width: their distance [m], shape (P,).
        along: unit vector across `way` in which the object extends most around both places, shape (P, 3).
        longer: how much more it extends there than across, 0 to 1, shape (P,).
    """

    middle: FloatArray
    way: FloatArray
    width: FloatArray
    along: FloatArray
    longer: FloatArray

    def __len__(self) -> int:
        return len(self.width)


def opposing_pairs(
    obj: GraspObject, packed: PackedObject, friction: float, widest: float, touch: Region | None, avoid: Region | None
) -> Pairs:
    """Return pairs of places whose outward normals oppose each other within the friction cones.

    Args:
        obj, packed: the object. friction: [-]. widest: pairs farther apart are left out [m].
        touch, avoid: both places lie in the one and neither in the other, if given.

    Raises:
        ObjectError: no graspable surface, or none in the regions.
    """
    points, normals = draw_surface(obj, packed, np.random.default_rng(0), _PLACES)
    usable = np.ones(len(points), dtype=np.bool_)
    if touch is not None:
        usable &= touch.contains(points)
    if avoid is not None:
        usable &= ~avoid.contains(points)
    points, normals = points[usable], normals[usable]
    if len(points) < 2:
        raise ObjectError(f"object '{obj.name}': expected surface to touch in the regions, found next to none.")
    squares = _squares(points)
    width = np.sqrt(squares)
    # How far each place lies beyond each other one along the normal of this one. Few columns: threads would only wait.
    beyond = np.einsum("ak,bk->ab", normals, points)
    beyond -= beyond.diagonal()[:, None].copy()
    opposed = -np.maximum(beyond, beyond.T) / np.maximum(width, 1e-9)
    fits = (width > _NEAREST) & (width < widest)
    for lean in _LEAN:
        first, second = np.nonzero(fits & (opposed > np.cos(min(lean * np.arctan(friction), 1.3))))
        if len(first) >= _ENOUGH:
            break
    if len(first) > _PAIRS:
        some = np.sort(np.random.default_rng(1).choice(len(first), _PAIRS, replace=False))
        first, second = first[some], second[some]
    order = np.argsort(width[first, second], kind="stable")
    first, second = first[order], second[order]
    spread = _spread(points, squares < _AROUND**2)
    way = (points[second] - points[first]) / width[first, second, None]
    along, longer = _extent(spread[first] + spread[second], way)
    return Pairs(0.5 * (points[first] + points[second]), way, width[first, second], along, longer)


def _squares(points: FloatArray) -> FloatArray:
    """Return the squared distances of points from each other [m²], shape (N, N)."""
    total = np.zeros((len(points), len(points)))
    for column in points.T:
        between = column[None] - column[:, None]
        between *= between
        total += between
    return total


def _spread(points: FloatArray, near: NDArray[np.bool_]) -> FloatArray:
    """Return the second moments of the points near each point about it, shape (N, 3, 3).

    Args:
        points: shape (N, 3). near: which of them (column) are near which (row), shape (N, N).
    """
    # About their middle, sums of points near each other lose nothing to rounding that counts.
    about = points - points.mean(axis=0)
    outer = about[:, :, None] * about[:, None, :]
    sums = np.einsum("kb,ab->ak", np.vstack([about.T, outer.reshape(-1, 9).T]), near.astype(np.float64))
    mixed = about[:, :, None] * sums[:, None, :3]
    moments: FloatArray = sums[:, 3:].reshape(-1, 3, 3) + near.sum(axis=1)[:, None, None] * outer
    moments -= mixed + mixed.transpose(0, 2, 1)
    return moments


def _extent(moments: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the direction across a way of the largest moment, (P, 3), and how much larger it is, 0 to 1, (P,)."""
    across = np.eye(3) - way[:, :, None] * way[:, None, :]
    values, vectors = np.linalg.eigh(across @ moments @ across)
    # The smallest moment is that along the way, which is 0.
    return vectors[:, :, 2], 1.0 - np.sqrt(np.maximum(values[:, 1], 0.0) / np.maximum(values[:, 2], 1e-18))


def draw_surface(
    obj: GraspObject, packed: PackedObject, rng: np.random.Generator, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return places on the graspable surface drawn by area [m], and the outward unit normals there, (N, 3) each.

    Raises:
        ObjectError: no graspable surface.
    """
    tree, surface = packed.full_tree, GraspableSurface(obj, packed)
    # One draw per equal share of the area spreads the places more evenly than independent draws.
    shares = (np.arange(count) + rng.random(count)) / count
    drawn = np.minimum(np.searchsorted(surface.shares, shares, side="right"), len(surface.shares) - 1)
    chosen = surface.triangles[drawn]
    a, b, c = tree.vertices[tree.triangles[chosen]].transpose(1, 0, 2)
    root, other = np.sqrt(rng.random(count)), rng.random(count)
    points = (1.0 - root)[:, None] * a + (root * (1.0 - other))[:, None] * b + (root * other)[:, None] * c
    return points, tree.normals[chosen]
