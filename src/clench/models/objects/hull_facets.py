"""Flat facets of a convex hull: their planes, their edges, and how large they look from a point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import ObjectError
from clench.core.pose import FloatArray
from clench.models.mesh import IntArray

#: Triangles of the hull share a facet when their corners are this near to one plane, as a fraction of the size [-].
COPLANAR: Final = 1e-6


@dataclass(frozen=True, eq=False)
class HullFacets:
    """Describe the convex hull of points by its F flat facets, the largest first, K triangles and E directed edges.

    Args:
        points: corners of the hull [m], shape (P, 3).
        size: half of the longest side of the bounding box [m].
        normals: unit, out of the hull, shape (F, 3). offsets: `normal · p` of the points p of a facet [m], shape (F,).
        triangles: corners of the triangles [m], shape (K, 3, 3). facet: of every triangle, shape (K,).
        edge_start: a point of every edge [m], shape (E, 3). edge_out: unit, in the plane of the facet, away from it,
            shape (E, 3). edge_facet: the facet it bounds, edge_other: the facet on its other side, shape (E,).
    """

    points: FloatArray
    size: float
    normals: FloatArray
    offsets: FloatArray
    triangles: FloatArray
    facet: IntArray
    edge_start: FloatArray
    edge_out: FloatArray
    edge_facet: IntArray
    edge_other: IntArray

    def heights(self, point: FloatArray) -> FloatArray:
        """Return the distance of a point from the plane of every facet [m], shape (F,); below 0 outside of the hull."""
        return np.asarray(self.offsets - self.normals @ point)

    def overhangs(self, point: FloatArray) -> FloatArray:
        """Return how far the projection of a point onto each edge's facet lies beyond the edge [m], shape (E,)."""
        return np.asarray(np.einsum("ij,ij->i", point - self.edge_start, self.edge_out))

    def shares(self, point: FloatArray) -> FloatArray:
        """Return the part of all directions from a point that meets each facet, shape (F,) [-].

        The point lies inside. Van Oosterom and Strackee (1983) give the solid angle of a triangle.
        """
        a, b, c = (self.triangles[:, k] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
        dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
        angle = 2.0 * np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
        return np.bincount(self.facet, weights=angle, minlength=len(self.normals)) / (4.0 * np.pi)

    def joined(self, one: IntArray, other: IntArray) -> HullFacets:
        """Return the hull with pairs of facets joined; the larger facet of a pair gives the plane.

        Args:
            one, other: facets, shape (N,).
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count = len(self.normals)
        graph = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(count, count))
        label = np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
        _, first = np.unique(label, return_index=True)  # facets are sorted by size
        outer = label[self.edge_facet] != label[self.edge_other]
        return replace(
            self,
            normals=self.normals[first],
            offsets=self.offsets[first],
            facet=label[self.facet],
            edge_start=self.edge_start[outer],
            edge_out=self.edge_out[outer],
            edge_facet=label[self.edge_facet[outer]],
            edge_other=label[self.edge_other[outer]],
        )


def hull_facets(points: FloatArray, name: str) -> HullFacets:
    """Return the facets of the convex hull of points.

    Args:
        points: [m], shape (P, 3). name: of the object, for messages.

    Raises:
        ObjectError: all points lie in one plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    # Qhull's tolerances are absolute for small coordinates, so it gets points of size 1 about the origin.
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = float(np.abs(points - middle).max())
    try:
        hull = ConvexHull((points - middle) / size if size > 0.0 else points)
    except (QhullError, ValueError):
        raise _flat(name) from None
    label, seeds = _coplanar(hull.points, hull.simplices, hull.equations, hull.neighbors)
    corners = hull.points[hull.simplices]
    normals, offsets = hull.equations[seeds, :3], -hull.equations[seeds, 3]
    start, out, edge_facet, edge_other = _edges(corners, hull.neighbors, label, normals)
    if 2.0 * hull.volume <= COPLANAR * hull.area:
        raise _flat(name)
    return HullFacets(
        points=hull.points[np.unique(hull.simplices)] * size + middle,
        size=size,
        normals=normals,
        offsets=offsets * size + normals @ middle,
        triangles=corners * size + middle,
        facet=label,
        edge_start=start * size + middle,
        edge_out=out,
        edge_facet=edge_facet,
        edge_other=edge_other,
    )


def _flat(name: str) -> ObjectError:
    """Return the error of an object whose points lie in one plane."""
    return ObjectError(f"{name}: expected a solid, but the object is flat: all of its points lie in one plane.")


def _coplanar(
    points: FloatArray, triangles: NDArray[np.int32], planes: FloatArray, neighbors: NDArray[np.int32]
) -> tuple[IntArray, IntArray]:
    """Grow facets from the largest triangles over neighbours that lie in their planes.

    Returns:
        Facet of every triangle, shape (K,), and the triangle that gives each facet its plane, shape (F,).
    """
    # Only a neighbour whose far corner is near the plane can join: on round objects this excludes nearly all.
    across = _far_corner(triangles, neighbors)
    gap = np.abs(np.einsum("kij,kj->ki", points[across], planes[:, :3]) + planes[:, 3:])
    joins = gap <= 10.0 * COPLANAR
    a, b, c = points[triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    label, seeds = np.full(len(triangles), -1, dtype=np.int64), list[int]()
    for seed in np.argsort(-area, kind="stable").tolist():
        if label[seed] >= 0:
            continue
        label[seed], pending = len(seeds), [seed]
        normal, offset = planes[seed, :3], planes[seed, 3]
        while pending:
            k = pending.pop()
            for other in neighbors[k, joins[k]].tolist():
                near = np.abs(points[triangles[other]] @ normal + offset).max() <= COPLANAR
                if label[other] < 0 and near and planes[other, :3] @ normal > 0.0:
                    label[other] = len(seeds)
                    pending.append(other)
        seeds.append(seed)
    return label, np.array(seeds, dtype=np.int64)


def _far_corner(triangles: NDArray[np.int32], neighbors: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the corner of each neighbour that lies opposite the common edge, shape (K, 3)."""
    here = np.arange(len(triangles))[:, None, None]
    place = (neighbors[neighbors] == here).argmax(axis=2)
    return np.asarray(triangles[neighbors, place])


def _edges(
    corners: FloatArray, neighbors: NDArray[np.int32], label: IntArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray, IntArray]:
    """Return start, outward direction, own facet and other facet of the edges between facets."""
    triangle, opposite = np.nonzero(label[:, None] != label[neighbors])
    start, end = corners[triangle, (opposite + 1) % 3], corners[triangle, (opposite + 2) % 3]
    own, other = label[triangle], label[neighbors[triangle, opposite]]
    out = np.cross(end - start, normals[own])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    # A sliver has no clear side; the middle of its whole facet is farther from the edge.
    count = np.bincount(label, minlength=len(normals))
    middles = np.stack([np.bincount(label, corners[:, :, i].mean(axis=1)) for i in range(3)], axis=1) / count[:, None]
    inward = np.einsum("ij,ij->i", middles[own] - start, out) > 0.0
    out[inward] *= -1.0
    return start, out, own, other
