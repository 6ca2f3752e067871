"""The triangles of hand and object at the poses of a solution, coloured by kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand, JointRole
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource, ShapeKind
from clench.solver.solution import GraspSolution

from . import style

#: Meshes of more triangles are thinned out before they are drawn.
MOST_TRIANGLES: Final = 120_000
#: The same while looking for viewpoints.
MOST_COARSE: Final = 6_000
#: Round shapes are drawn with facets off by at most this [m].
_DEVIATION: Final = 5e-5
OBSTACLE_COLOR: Final = "#c4c4c4"
#: The same while looking for viewpoints [m].
COARSE: Final = 5e-4
#: Groups of triangles from this on are bodies of the object, those below are links.
OBJECT_GROUP: Final = 10_000
OBJECT_COLOR: Final = "#e3cf92"
PALM_COLOR: Final = "#a9b0b7"


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles of a picture.

    Args:
        corners: in the world [m], shape (T, 3, 3). normals: unit, shape (T, 3). colors: shape (T, 3).
        groups: number of the body of each triangle, shape (T,).
    """

    corners: FloatArray
    normals: FloatArray
    colors: FloatArray
    groups: NDArray[np.int64]

    def taken(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Surface:
        """Return some of the triangles."""
        return Surface(self.corners[rows], self.normals[rows], self.colors[rows], self.groups[rows])

    def coarse(self, cell: float) -> FloatArray:
        """Return corners of fewer triangles, moved to the points of a grid of this width [m], shape (T, 3, 3)."""
        cells = np.round(self.corners / cell).astype(np.int64)
        a, b, c = cells.transpose(1, 0, 2)
        proper = (a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)
        found: FloatArray = np.unique(cells[proper].reshape(-1, 9), axis=0).reshape(-1, 3, 3) * cell
        return found


def hand_surface(hand: Hand, solution: GraspSolution, deviation: float = _DEVIATION) -> Surface:
    """Return the hand's geometry at the chosen joint angles, each finger's links in the colours of their joints."""
    q = np.array([solution.joint_angles.get(j.name, j.open_value) for j in hand.joints])
    return posed_surface(hand, q, CollisionSource(solution.collision_source), solution.hand_pose.matrix, deviation)


def posed_surface(
    hand: Hand, q: FloatArray, source: CollisionSource, T_world_palm: FloatArray, deviation: float = _DEVIATION
) -> Surface:
    """Return the hand's geometry at a posture, shape (J,) [rad], each finger's links in the colours of their joints."""
    poses = T_world_palm @ hand.link_poses(q)
    colors = link_colors(hand)
    parts = []
    for i, link in enumerate(hand.links):
        for shape in link.shapes.get(source, ()):
            parts.append((_placed(shape.to_mesh(deviation), poses[i]), colors[i], i))
    return _surface(parts)


def without_forearm(hand: Hand, surface: Surface) -> Surface:
    """Return the triangles of the palm and of everything that the palm carries, of a surface of the hand."""
    carried = [False] * len(hand.links)
    for i, link in enumerate(hand.links):  # parents come first
        carried[i] = i == hand.palm or (link.parent >= 0 and carried[link.parent])
    return surface.taken(np.array(carried)[surface.groups])


def link_colors(hand: Hand) -> list[str]:
    """Return the colour of every link: of the closing joint that moves it, as in the planar figures, or grey."""
    colors = [PALM_COLOR] * len(hand.links)
    for finger in hand.fingers:
        closing = [j for j in finger.joints if hand.joints[j].role is JointRole.CLOSING]
        for i in finger.links:
            k = i
            while k >= 0 and hand.links[k].joint not in closing:
                k = hand.links[k].parent
            if k >= 0:
                color = style.joint_color(closing.index(hand.links[k].joint))
                colors[i] = style.mixed(color, style.PAPER, 0.3)
    return colors


def object_surface(obj: GraspObject, solution: GraspSolution, deviation: float = _DEVIATION) -> Surface:
    """Return the geometry of the object and its obstacles where the solution has it."""
    engine = solution.object_collision_source == CollisionSource.ENGINE.value
    return placed_object(obj, solution.object_pose.matrix, engine, deviation)


def placed_object(obj: GraspObject, T: FloatArray, engine: bool = False, deviation: float = _DEVIATION) -> Surface:
    """Return the geometry of an object and its obstacles at a pose, shape (4, 4); meshes as their hulls for an engine.

    The groups of its triangles are `OBJECT_GROUP` and the number of the body.
    """
    from clench.models.tessellation import convex_hull

    most = MOST_TRIANGLES if deviation < COARSE else MOST_COARSE
    parts = []
    for number, body in enumerate(obj.bodies):
        color = OBSTACLE_COLOR if body.role is BodyRole.OBSTACLE else OBJECT_COLOR
        for shape in body.shapes:
            if shape.kind is ShapeKind.MESH and engine and shape.mesh is not None:
                mesh = convex_hull(shape.mesh).transformed(shape.pose)
            else:
                mesh = shape.to_mesh(deviation)
            parts.append((_placed(thinned(mesh, most), T), color, OBJECT_GROUP + number))
    return _surface(parts)


def thinned(mesh: TriangleMesh, most: int) -> TriangleMesh:
    """Return a mesh with fewer triangles: vertices of the same cell of a grid become one, until it is small enough."""
    cells = 512
    while len(mesh.triangles) > most and cells >= 16:
        low = mesh.vertices.min(axis=0)
        size = float(np.ptp(mesh.vertices, axis=0).max()) or 1.0
        cell = np.floor((mesh.vertices - low) / size * cells).astype(np.int64)
        _, kept, index = np.unique(cell, axis=0, return_index=True, return_inverse=True)
        triangles = index.ravel()[mesh.triangles]
        a, b, c = triangles.T
        mesh = TriangleMesh(mesh.vertices[kept], triangles[(a != b) & (b != c) & (c != a)])
        cells //= 2
    return mesh


def _placed(mesh: TriangleMesh, T: FloatArray) -> FloatArray:
    corners: FloatArray = (mesh.vertices @ T[:3, :3].T + T[:3, 3])[mesh.triangles]
    return corners


def _surface(parts: Sequence[tuple[FloatArray, str, int]]) -> Surface:
    counts = [len(corners) for corners, _, _ in parts]
    corners = np.concatenate([c for c, _, _ in parts]) if parts else np.empty((0, 3, 3))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    rgb = np.array([[int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)] for _, color, _ in parts]).reshape(-1, 3)
    groups = np.array([g for _, _, g in parts], dtype=np.int64)
    return Surface(
        corners,
        normals / np.where(sizes > 0.0, sizes, 1.0)[:, None],
        np.repeat(rgb, counts, axis=0),
        np.repeat(groups, counts),
    )
