"""Triangles for round shapes, surfaces of revolution, and convex hulls."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import ObjectError
from clench.core.pose import FloatArray

from .mesh import IntArray, TriangleMesh
from .shapes import CollisionSource, Shape, ShapeKind

#: Largest distance of triangles inside a round shape, as a fraction of its size [-] ...
TESSELLATION_FRACTION: Final = 2e-3
#: ... and in metres.
TESSELLATION_DEVIATION: Final = 2e-5
#: Facets around a round shape, at least and at most; beyond the upper bound a smaller deviation changes nothing.
MIN_SEGMENTS: Final = 12
MAX_SEGMENTS: Final = 512

#: Corners of a box in units of its half extents; bit 2 of the index is x, bit 1 is y, bit 0 is z.
BOX_CORNERS: Final = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
#: Two triangles for each side: -x, +x, -y, +y, -z, +z.
BOX_TRIANGLES: Final = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
        *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
        *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def tessellation_deviation(shape: Shape) -> float:
    """Return how far the triangles of a shape may be off [m]; 0 for meshes and boxes, which are exact."""
    if shape.kind in (ShapeKind.MESH, ShapeKind.BOX):
        return 0.0
    return min(TESSELLATION_DEVIATION, TESSELLATION_FRACTION * max(shape.size))


def shape_mesh(shape: Shape, source: CollisionSource) -> TriangleMesh:
    """Return a shape's triangles in its body's or link's frame; with `engine`, a mesh is its convex hull."""
    if shape.kind is ShapeKind.MESH and source is CollisionSource.ENGINE:
        assert shape.mesh is not None
        return convex_hull(shape.mesh).transformed(shape.pose)
    return shape.to_mesh(tessellation_deviation(shape) or TESSELLATION_DEVIATION)


def tessellate(shape: Shape, deviation: float) -> TriangleMesh:
    """Return a closed mesh inscribed in a shape, in the shape's own frame.

    Vertices lie on the surface; facets are off by at most `deviation` [m]. No shape gets more than `MAX_SEGMENTS`
    facets around (deviation 2e-5 of its radius). A mesh is returned as it is.

    Raises:
        ObjectError: the deviation is not positive, or the shape has no size.
    """
    if not (math.isfinite(deviation) and deviation > 0):
        raise ObjectError(f"tessellation: expected a deviation above 0 m, got {deviation!r}.")
    if shape.kind is ShapeKind.MESH:
        assert shape.mesh is not None
        return shape.mesh
    a, b, _ = shape.size
    if shape.kind in (ShapeKind.BOX, ShapeKind.ELLIPSOID) and not all(v > 0 for v in shape.size):
        raise ObjectError(f"{shape.kind}: expected three half sizes above 0 m, got {shape.size}.")
    match shape.kind:
        case ShapeKind.BOX:
            return TriangleMesh(BOX_CORNERS * shape.size, BOX_TRIANGLES)
        case ShapeKind.CYLINDER:
            around = segments_around(a, deviation)
            return revolve([(0.0, -b), (a, -b), (a, b), (0.0, b)], circle(around))
        case ShapeKind.SPHERE | ShapeKind.CAPSULE:
            around = segments_around(a, deviation, doubly_curved=True)
            half = 0.0 if shape.kind is ShapeKind.SPHERE else b
            return revolve(_capsule_profile(a, half, around // 4), circle(around))
        case ShapeKind.ELLIPSOID:
            # An affine map of the unit ball: its deviation grows by the largest semi-axis at most.
            around = segments_around(1.0, deviation / max(shape.size), doubly_curved=True)
            ball = revolve(_capsule_profile(1.0, 0.0, around // 4), circle(around))
            return TriangleMesh(ball.vertices * shape.size, ball.triangles)


def segments_around(radius: float, deviation: float, *, doubly_curved: bool = False) -> int:
    """Return how many facets around a circle keep them within a deviation [m]: a multiple of 4.

    A facet of a circle deviates by its sagitta `r (1 - cos(step / 2))`. On a ball, a triangle whose two legs are
    one step long has its middle `step / sqrt(2)` from its corners.

    Raises:
        ObjectError: a radius that is not positive.
    """
    if not (math.isfinite(radius) and radius > 0):
        raise ObjectError(f"tessellation: expected a radius above 0 m, got {radius!r}.")
    angle = math.acos(max(1.0 - deviation / radius, -1.0))
    step = math.sqrt(2.0) * angle if doubly_curved else 2.0 * angle
    wanted = MAX_SEGMENTS if step <= 2.0 * math.pi / MAX_SEGMENTS else math.ceil(2.0 * math.pi / step)
    return min(4 * math.ceil(max(wanted, MIN_SEGMENTS) / 4), MAX_SEGMENTS)


def circle(count: int) -> FloatArray:
    """Return points of the unit circle, counter-clockwise from +x, shape (count, 2); symmetric to the last bit."""
    quarter = np.arange(count // 4) * (2.0 * math.pi / count)
    first = np.column_stack([np.cos(quarter), np.sin(quarter)])
    turned = [first]
    for _ in range(3):
        turned.append(np.column_stack([-turned[-1][:, 1], turned[-1][:, 0]]))
    return np.vstack(turned)


def revolve(profile: ArrayLike, directions: FloatArray) -> TriangleMesh:
    """Turn a profile about z into a closed mesh.

    Args:
        profile: radius and height [m] from the lower pole to the upper, shape (P, 2); radius 0 at both ends only.
        directions: the section at radius 1, counter-clockwise, shape (N, 2); `circle(n)` for round bodies.
    """
    rows = np.asarray(profile, dtype=np.float64)
    count = len(directions)
    radius, height = rows[1:-1, 0], rows[1:-1, 1]
    rings = np.empty((len(radius), count, 3))
    rings[:, :, :2] = radius[:, None, None] * directions
    rings[:, :, 2] = height[:, None]
    poles = np.array([[0.0, 0.0, rows[0, 1]], [0.0, 0.0, rows[-1, 1]]])
    vertices = np.vstack([rings.reshape(-1, 3), poles])

    i = np.arange(count)
    j = (i + 1) % count
    lower, upper = len(vertices) - 2, len(vertices) - 1
    top = (len(radius) - 1) * count
    triangles = [np.column_stack([np.full(count, lower), j, i]), grid_triangles(len(radius), count)]
    triangles.append(np.column_stack([np.full(count, upper), top + i, top + j]))
    return TriangleMesh(vertices, np.vstack(triangles))


def grid_triangles(rows: int, columns: int) -> IntArray:
    """Return the triangles between rows of a grid that closes on itself along its columns, shape (2 (R - 1) C, 3).

    Vertex `(r, c)` has index `r * columns + c`; columns run counter-clockwise when seen from above the last row.
    """
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    low, low_next = r * columns + c, r * columns + (c + 1) % columns
    high, high_next = low + columns, low_next + columns
    first = np.stack([low, low_next, high_next], axis=-1)
    second = np.stack([low, high_next, high], axis=-1)
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)]).astype(np.int64)


def convex_hull(mesh: TriangleMesh) -> TriangleMesh:
    """Return the convex hull of a mesh's vertices, closed and wound outwards.

    Raises:
        ObjectError: fewer than four points, or all of them in one plane.
    """
    from scipy.spatial import ConvexHull, QhullError

    points = mesh.vertices
    if len(points) < 4:
        raise ObjectError(f"convex hull: expected at least 4 vertices, got {len(points)}.")
    # Qhull's tolerances are absolute for small coordinates, so it gets points of size 1 about the origin.
    center = (points.min(axis=0) + points.max(axis=0)) / 2.0
    size = float(np.abs(points - center).max())
    try:
        hull = ConvexHull((points - center) / size if size > 0 else points)
    except QhullError:
        raise ObjectError(
            "convex hull: the mesh is flat, all its vertices lie in one plane; expected a solid, "
            "or collision_source='raw' to use the triangles as they are."
        ) from None
    triangles = hull.simplices.astype(np.int64)
    a, b, c = (hull.points[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, compact = np.unique(triangles, return_inverse=True)
    return TriangleMesh(points[used], compact.reshape(-1, 3))


def _capsule_profile(radius: float, half: float, quarter: int) -> FloatArray:
    """Return the profile of a capsule whose core reaches from -half to half; a ball for half = 0."""
    angle = np.arange(quarter + 1) * (math.pi / 2.0 / quarter)
    upper = np.column_stack([radius * np.cos(angle), half + radius * np.sin(angle)])
    upper[-1] = (0.0, half + radius)
    lower = (upper * (1.0, -1.0))[::-1]
    return np.vstack([lower, upper if half > 0 else upper[1:]])
