"""Parts of an object's surface that grasps are to touch, or to keep off."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, checked_vector
from clench.core.showing.short_repr import short_repr


@dataclass(frozen=True, eq=False)
class Region:
    """A part of an object, in the object's frame: make one with `box`, `sphere` or `vertices`.

    Args:
        low, high: corners of a box [m], shape (3,). radius: a ball around the middle of the box counts [m].
        points: vertices of a mesh [m]; a place counts when the vertex nearest to it is marked, shape (V, 3).
        marked: which vertices, shape (V,).
    """

    low: FloatArray
    high: FloatArray
    radius: float | None = None
    points: FloatArray | None = None
    marked: NDArray[np.bool_] | None = None
    __repr__ = short_repr

    @classmethod
    def box(cls, low: ArrayLike, high: ArrayLike) -> Region:
        """Return a box with its edges along the axes of the object's frame.

        Args:
            low, high: its corners [m], shape (3,).

        Raises:
            CommandError: not three numbers, or a corner is not above the other.
        """
        a, b = (
            checked_vector(v, 3, f"region.{key}", "[x, y, z] in metres") for v, key in ((low, "low"), (high, "high"))
        )
        if not (a < b).all():
            raise CommandError(f"region: expected low below high along every axis, got {a.tolist()} and {b.tolist()}.")
        return cls(a, b)

    @classmethod
    def sphere(cls, center: ArrayLike, radius: float) -> Region:
        """Return a ball.

        Args:
            center: [m], shape (3,). radius: [m].

        Raises:
            CommandError: not three numbers, or a radius that is not above 0.
        """
        middle = checked_vector(center, 3, "region.center", "[x, y, z] in metres")
        if isinstance(radius, bool) or not isinstance(radius, Real) or not 0.0 < float(radius) < np.inf:
            raise CommandError(f"region.radius: expected a finite number above 0 m, got {radius!r}.")
        return cls(middle - radius, middle + radius, float(radius))

    @classmethod
    def vertices(cls, points: ArrayLike, marked: ArrayLike) -> Region:
        """Return the surface around some vertices of a mesh.

        Args:
            points: all vertices in the object's frame [m], shape (V, 3). marked: which count, shape (V,).

        Raises:
            CommandError: shapes do not fit, or no vertex is marked.
        """
        try:
            p, chosen = np.asarray(points, dtype=np.float64), np.asarray(marked)
        except (TypeError, ValueError):
            raise CommandError("region.points: expected finite vertices [m] of shape (V, 3).") from None
        if p.ndim != 2 or p.shape[1:] != (3,) or not np.isfinite(p).all():
            raise CommandError(f"region.points: expected finite vertices [m] of shape (V, 3), got shape {p.shape}.")
        if chosen.shape != (len(p),) or chosen.dtype.kind != "b":
            raise CommandError(f"region.marked: expected {len(p)} truth values, one per vertex, got {chosen.shape}.")
        if not chosen.any():
            raise CommandError("region.marked: expected at least one marked vertex.")
        return cls(p[chosen].min(axis=0), p[chosen].max(axis=0), None, p, chosen)

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points of the object's frame [m], shape (N, 3), lie in the region, shape (N,)."""
        if self.points is not None and self.marked is not None:
            from scipy.spatial import KDTree

            nearest = KDTree(self.points).query(points)[1] if len(points) else np.empty(0, dtype=np.int64)
            return np.asarray(self.marked[nearest], dtype=np.bool_)
        if self.radius is not None:
            return np.asarray(np.linalg.norm(points - 0.5 * (self.low + self.high), axis=1) <= self.radius)
        return np.asarray(((points >= self.low) & (points <= self.high)).all(axis=1))
