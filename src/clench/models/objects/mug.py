"""A mug with a handle: one closed surface, and its convex pieces.

The wall is a body of revolution. Two rectangles of its grid, above one another, are left out. The handle is a tube
whose first and last ring are the borders of these rectangles. Thus wall and handle are one surface without inner faces.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from clench.core.caching.deferring import DeferredSequence
from clench.core.pose import FloatArray
from clench.models.mesh import IntArray, TriangleMesh
from clench.models.shapes import Shape, ShapeKind
from clench.models.tessellation import circle, convex_hull, grid_triangles, revolve

from .grasp_object import Body

OUTER: Final = 0.041
INNER: Final = 0.0375
HEIGHT: Final = 0.095
BASE: Final = 0.005
CHAMFER: Final = 0.002

#: Facets around the wall; each wall piece spans three of them.
COLUMNS: Final = 96
COLUMNS_PER_PIECE: Final = 3
#: The handle leaves the wall over columns -3 .. 3 and the grid rows below (heights in m).
HALF_COLUMNS: Final = 3
UPPER_ROWS: Final = (0.070, 0.073, 0.076, 0.079, 0.082)
LOWER_ROWS: Final = (0.014, 0.017, 0.020, 0.023, 0.026)
OTHER_ROWS: Final = (CHAMFER, BASE, 0.037, 0.048, 0.059, HEIGHT)

#: The handle's path is half an ellipse in the xz plane; its section is an ellipse, wide along y.
HANDLE_CENTER: Final = 0.048
HANDLE_HALF_HEIGHT: Final = 0.028
HANDLE_REACH: Final = 0.034
HANDLE_HALF_WIDTH: Final = 0.0065
HANDLE_HALF_THICKNESS: Final = 0.0045
HANDLE_STEPS: Final = 24
STEPS_PER_PIECE: Final = 2


def mug() -> Body:
    """Return a mug of 82 mm diameter and 95 mm height that stands on z = 0, its handle towards +x."""
    heights = sorted({*UPPER_ROWS, *LOWER_ROWS, *OTHER_ROWS})
    wall_profile = [(OUTER, z) for z in heights]
    profile = [(0.0, 0.0), (OUTER - CHAMFER, 0.0), *wall_profile, (INNER, HEIGHT), (INNER, BASE), (0.0, BASE)]
    wall = revolve(profile, circle(COLUMNS))
    # Ring 0 of the surface is the foot of the chamfer, so the wall's rows start at 1.
    upper = _patch([1 + heights.index(z) for z in UPPER_ROWS])
    lower = _patch([1 + heights.index(z) for z in LOWER_ROWS])
    kept = ~(np.isin(wall.triangles, upper).all(axis=1) | np.isin(wall.triangles, lower).all(axis=1))

    # The path turns round on its way, so the section's outer side is up at the upper end and down at the lower one.
    first, last = _border(upper), _border(lower[::-1])
    tube = _handle_rings(wall.vertices[first])
    count = len(first)
    inner_start = len(wall.vertices)
    index = np.concatenate([first, np.arange(inner_start, inner_start + tube.size // 3), last])
    handle = index[grid_triangles(HANDLE_STEPS + 1, count)]
    vertices = np.vstack([wall.vertices, tube.reshape(-1, 3)])
    surface = _compact(vertices, np.vstack([wall.triangles[kept], handle]))

    rings = vertices[index].reshape(HANDLE_STEPS + 1, count, 3)
    # Only simulation needs the pieces: making them takes longer than all the rest.
    pieces = DeferredSequence(lambda: (_base(), *_wall_pieces(), *_handle_pieces(rings)))
    return Body("mug", (Shape(ShapeKind.MESH, mesh=surface, name="mug"),), pieces=pieces)


def _patch(rows: list[int]) -> IntArray:
    """Return the vertex indices of a rectangle of the wall's grid, rows from low to high, columns from -y to +y."""
    columns = np.arange(-HALF_COLUMNS, HALF_COLUMNS + 1) % COLUMNS
    return np.array(rows)[:, None] * COLUMNS + columns


def _border(patch: IntArray) -> IntArray:
    """Return the indices around a rectangle, once, starting with its first row."""
    return np.concatenate([patch[0, :-1], patch[:-1, -1], patch[-1, :0:-1], patch[:0:-1, 0]])


def _handle_rings(first: FloatArray) -> FloatArray:
    """Return the rings of the handle between its two ends, shape (HANDLE_STEPS - 1, n, 3).

    A vertex of a ring stands in the direction in which its partner stands on the border `first` [m], shape (n, 3).
    """
    y, n = first[:, 1], first[:, 2] - first[:, 2].mean()
    around = np.arctan2(n / np.abs(n).max(), y / np.abs(y).max())
    t = np.arange(1, HANDLE_STEPS)[:, None] * (np.pi / HANDLE_STEPS)
    tangent_x, tangent_z = HANDLE_REACH * np.cos(t), -HANDLE_HALF_HEIGHT * np.sin(t)
    speed = np.hypot(tangent_x, tangent_z)
    out = HANDLE_HALF_THICKNESS * np.sin(around)
    rings = np.empty((HANDLE_STEPS - 1, len(first), 3))
    rings[..., 0] = OUTER + HANDLE_REACH * np.sin(t) - out * tangent_z / speed
    rings[..., 1] = HANDLE_HALF_WIDTH * np.cos(around)
    rings[..., 2] = HANDLE_CENTER + HANDLE_HALF_HEIGHT * np.cos(t) + out * tangent_x / speed
    return rings


def _compact(vertices: FloatArray, triangles: IntArray) -> TriangleMesh:
    """Drop the vertices that no triangle uses."""
    used, index = np.unique(triangles, return_inverse=True)
    return TriangleMesh(vertices[used], index.reshape(-1, 3))


def _base() -> TriangleMesh:
    return revolve([(0.0, 0.0), (OUTER - CHAMFER, 0.0), (OUTER, CHAMFER), (OUTER, BASE), (0.0, BASE)], circle(COLUMNS))


def _wall_pieces() -> list[TriangleMesh]:
    """Return wedges of the wall; each bulges inwards by the sagitta of its three facets, 0.18 mm."""
    around = circle(COLUMNS)
    pieces = []
    for start in range(0, COLUMNS, COLUMNS_PER_PIECE):
        arc = around[np.arange(start, start + COLUMNS_PER_PIECE + 1) % COLUMNS]
        flat = np.vstack([OUTER * arc, INNER * arc])
        corners = [np.column_stack([flat, np.full(len(flat), z)]) for z in (BASE, HEIGHT)]
        pieces.append(convex_hull(TriangleMesh(np.vstack(corners), [])))
    return pieces


def _handle_pieces(rings: FloatArray) -> list[TriangleMesh]:
    starts = range(0, HANDLE_STEPS, STEPS_PER_PIECE)
    return [convex_hull(TriangleMesh(rings[k : k + STEPS_PER_PIECE + 1], [])) for k in starts]
