"""Compute the mass properties of an object: centre, volume, and largest distance of the surface from the centre."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.models.shapes import Shape, ShapeKind

from .grasp_object import Body, BodyRole, GraspObject


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass properties of an object of uniform density, without its obstacles.

    Args:
        center: centre of mass in the object's frame [m], shape (3,).
        volume: [m³].
        length: largest distance of its surface from the centre of mass [m], the length scale of grasp wrenches.
        exact: every body is closed; open bodies are replaced by their convex hulls.
    """

    center: FloatArray
    volume: float
    length: float
    exact: bool


def mass_properties(obj: GraspObject) -> MassProperties:
    """Return centre of mass, volume and length scale of an object of uniform density."""
    first, *others = bodies = tuple(body for body in obj.bodies if body.role is BodyRole.GRASPABLE)
    # Objects at other poses have the same bodies.
    return first.kept(("mass", *others), lambda: _of_bodies(bodies))


def _of_bodies(bodies: tuple[Body, ...]) -> MassProperties:
    solids = [_solid(shape, body.closed) for body in bodies for shape in body.shapes]
    volumes = np.array([volume for _, volume, _ in solids])
    centers = np.array([center for center, _, _ in solids])
    weights = volumes if volumes.sum() > 0.0 else np.ones(len(volumes))
    center = weights @ centers / weights.sum()
    vertices = np.vstack([vertices for _, _, vertices in solids])
    length = float(np.linalg.norm(vertices - center, axis=1).max())
    return MassProperties(center, float(volumes.sum()), length, all(body.closed for body in bodies))


def _solid(shape: Shape, closed: bool) -> tuple[FloatArray, float, FloatArray]:
    """Return centroid, volume and vertices of a shape; of its convex hull if it is a mesh that does not close."""
    mesh = shape.to_mesh()
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    vertices = mesh.vertices[used]
    if shape.kind is not ShapeKind.MESH:
        return shape.pose.position, _primitive_volume(shape), vertices
    middle = vertices.mean(axis=0)
    if closed:
        a, b, c = (mesh.vertices[mesh.triangles[:, k]] - middle for k in range(3))
        volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        if volumes.sum() > 0.0:
            moment = (volumes[:, None] * (a + b + c) / 4.0).sum(axis=0)
            return middle + moment / volumes.sum(), float(volumes.sum()), vertices
    return (*_hull_solid(vertices, middle), vertices)


def _primitive_volume(shape: Shape) -> float:
    a, b, c = shape.size
    match shape.kind:
        case ShapeKind.BOX:
            return 8.0 * a * b * c
        case ShapeKind.CYLINDER:
            return 2.0 * math.pi * a * a * b
        case ShapeKind.ELLIPSOID:
            return 4.0 / 3.0 * math.pi * a * b * c
        case _:  # a ball, or a capsule, whose core has the half length b
            return 4.0 / 3.0 * math.pi * a**3 + (2.0 * math.pi * a * a * b if shape.kind is ShapeKind.CAPSULE else 0.0)


def _hull_solid(vertices: FloatArray, middle: FloatArray) -> tuple[FloatArray, float]:
    """Return centroid and volume of a convex hull; of flat vertices their mean, and no volume."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return middle, 0.0
    a, b, c = (vertices[hull.simplices[:, k]] - middle for k in range(3))
    volumes = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c))) / 6.0
    moment = (volumes[:, None] * (a + b + c) / 4.0).sum(axis=0)
    return middle + moment / volumes.sum(), float(volumes.sum())
