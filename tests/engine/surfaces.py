"""Distances of points to surfaces by python-fcl and by formulas of primitives: nothing of the project's kernels."""

from collections.abc import Sequence

import fcl
import numpy as np
import numpy.typing as npt

from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource, Shape, ShapeKind

Floats = npt.NDArray[np.float64]


def volume_tree(vertices: Floats, triangles: npt.NDArray[np.int64]) -> fcl.BVHModel:
    """Return a bounding-volume hierarchy over triangles."""
    model = fcl.BVHModel()
    model.beginModel(len(vertices), len(triangles))
    model.addSubModel(vertices, triangles)
    model.endModel()
    return model


#: A point as a triangle without size: triangle-triangle distance is exact to rounding, sphere-triangle is not.
_POINT = volume_tree(np.zeros((3, 3)), np.array([[0, 1, 2]]))


def distance_to_tree(model: fcl.BVHModel, point: Floats) -> float:
    """Return how far a point is from a triangle surface [m]."""
    return float(
        fcl.distance(
            fcl.CollisionObject(_POINT, fcl.Transform(np.eye(3), point)),
            fcl.CollisionObject(model, fcl.Transform()),
            fcl.DistanceRequest(),
            fcl.DistanceResult(),
        )
    )


def brute_distance(vertices: Floats, triangles: npt.NDArray[np.int64], point: Floats) -> float:
    """Return how far a point is from a triangle surface by looking at every triangle [m]."""
    a, b, c = (vertices[triangles[:, k]] - point for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    real = area > 0.0
    unit = normal[real] / area[real, None]
    best = np.inf
    height = np.einsum("ij,ij->i", unit, a[real])
    foot = unit * height[:, None]
    corners = [a[real], b[real], c[real]]
    within = np.ones(len(foot), dtype=bool)
    for k in range(3):
        p, q = corners[k], corners[(k + 1) % 3]
        within &= np.einsum("ij,ij->i", np.cross(q - p, foot - p), unit) >= 0.0
    if within.any():
        best = float(np.abs(height[within]).min())
    for p, q in ((a, b), (b, c), (c, a)):
        run = q - p
        square = np.maximum(np.einsum("ij,ij->i", run, run), 1e-300)
        t = np.clip(-np.einsum("ij,ij->i", p, run) / square, 0.0, 1.0)
        best = min(best, float(np.linalg.norm(p + t[:, None] * run, axis=1).min()))
    return best


class ShapeSurface:
    """The surface of one shape of a link, in the link's frame; a mesh is its convex hull, as MuJoCo collides it."""

    def __init__(self, shape: Shape) -> None:
        self.shape = shape
        self.tree: fcl.BVHModel | None = None
        if shape.kind is ShapeKind.MESH:
            import trimesh

            assert shape.mesh is not None
            hull = trimesh.convex.convex_hull(shape.mesh.vertices)
            self.tree = volume_tree(np.asarray(hull.vertices), np.asarray(hull.faces))

    def distance(self, point: Floats) -> float:
        """Return how far a point of the link's frame is from the surface, from inside or outside [m]."""
        local = self.shape.pose.inverse().apply(point)
        if self.tree is not None:
            return distance_to_tree(self.tree, local)
        return abs(_signed(self.shape, local))


def _signed(shape: Shape, p: Floats) -> float:
    a, b, c = shape.size
    if shape.kind is ShapeKind.SPHERE:
        return float(np.linalg.norm(p)) - a
    if shape.kind is ShapeKind.CAPSULE:
        return float(np.linalg.norm(p - [0.0, 0.0, np.clip(p[2], -b, b)])) - a
    if shape.kind is ShapeKind.CYLINDER:
        return _outside_box(np.array([np.hypot(p[0], p[1]) - a, abs(p[2]) - b]))
    if shape.kind is ShapeKind.BOX:
        return _outside_box(np.abs(p) - [a, b, c])
    raise NotImplementedError(f"no distance to a {shape.kind}")


def _outside_box(excess: Floats) -> float:
    return float(np.linalg.norm(np.maximum(excess, 0.0)) + min(excess.max(), 0.0))


class HandSurface:
    """The surfaces of every link of a hand, made when first asked for."""

    def __init__(self, hand: Hand, source: CollisionSource) -> None:
        self.hand, self.source = hand, source
        self._links: dict[int, Sequence[ShapeSurface]] = {}

    def distance(self, link: int, point: Floats) -> float:
        """Return how far a point of the link's frame is from the nearest surface of its shapes [m]."""
        if link not in self._links:
            self._links[link] = [ShapeSurface(s) for s in self.hand.links[link].shapes[self.source]]
        return min(surface.distance(point) for surface in self._links[link])
