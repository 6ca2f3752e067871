"""What hand and object look like: triangles and colours by link and body, for pictures, pages and scene files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand, JointRole
from clench.models.objects.grasp_object import BodyRole, GraspObject

from .mesh import TriangleMesh
from .shapes import CollisionSource, Shape, ShapeKind

#: Meshes of more triangles are thinned out before they are drawn.
MOST_TRIANGLES: Final = 120_000
#: Round shapes are drawn with facets off by at most this [m].
DEVIATION: Final = 5e-5
#: One colour per closing joint and the links that it moves, palm side first (after Okabe and Ito).
JOINT_COLORS: Final = ("#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f5539")
OBJECT_COLOR: Final = "#e3cf92"
OBSTACLE_COLOR: Final = "#e1e4e7"
PALM_COLOR: Final = "#a9b0b7"
#: Share of white in the colour of a link [-].
_WHITE: Final = 0.3


class SolidKind(StrEnum):
    """Name the kind of a solid."""

    HAND = "hand"
    """the palm, or a link that the palm carries"""
    FOREARM = "forearm"
    """a link that carries the palm, or is beside it: forearm, arm, robot"""
    OBJECT = "object"
    """a body that is grasped"""
    OBSTACLE = "obstacle"
    """a body that only stops the hand"""


@dataclass(frozen=True, eq=False)
class Solid:
    """One link or body as it is drawn.

    Args:
        kind: see `SolidKind`. name: of the link or body. index: its place in the hand's links or the object's bodies.
        color: as ``"#rrggbb"``. mesh: in the frame of the link or object [m].
    """

    kind: SolidKind
    name: str
    index: int
    color: str
    mesh: TriangleMesh

    @property
    def of_hand(self) -> bool:
        """Whether the solid is a link of the hand."""
        return self.kind in (SolidKind.HAND, SolidKind.FOREARM)


def hand_solids(
    hand: Hand, source: CollisionSource | str, deviation: float = DEVIATION, most: int = MOST_TRIANGLES
) -> list[Solid]:
    """Return the links of a hand that have a shape, each finger's in the colours of its closing joints.

    Args:
        hand: the hand. source: which geometry. deviation: of round shapes [m]. most: triangles of a shape.
    """
    colors, carried = link_colors(hand), carried_by_palm(hand)
    solids = []
    for i, link in enumerate(hand.links):
        shapes = link.shapes.get(CollisionSource(source), ())
        kind = SolidKind.HAND if carried[i] else SolidKind.FOREARM
        if shapes:
            solids.append(Solid(kind, link.name, i, colors[i], _joined(shapes, deviation, most)))
    return solids


def object_solids(
    obj: GraspObject, source: CollisionSource | str, deviation: float = DEVIATION, most: int = MOST_TRIANGLES
) -> list[Solid]:
    """Return the bodies of an object; for an engine, meshes are their convex hulls.

    Args:
        obj: object and obstacles. source: which geometry. deviation: of round shapes [m]. most: triangles of a shape.
    """
    from .tessellation import convex_hull

    solids = []
    for i, body in enumerate(obj.bodies):
        shapes: list[Shape] = []
        for shape in body.shapes:
            hull = shape.kind is ShapeKind.MESH and source == CollisionSource.ENGINE and shape.mesh is not None
            shapes.append(Shape(ShapeKind.MESH, pose=shape.pose, mesh=convex_hull(shape.mesh)) if hull else shape)  # type: ignore[arg-type]
        obstacle = body.role is BodyRole.OBSTACLE
        kind, color = (SolidKind.OBSTACLE, OBSTACLE_COLOR) if obstacle else (SolidKind.OBJECT, OBJECT_COLOR)
        solids.append(Solid(kind, body.name, i, color, _joined(shapes, deviation, most)))
    return solids


def solid_pose(solid: Solid, links: FloatArray, T_world_object: FloatArray) -> FloatArray:
    """Return where a solid is in the world, shape (4, 4).

    Args:
        solid: the solid. links: poses of all links in the world, shape (L, 4, 4). T_world_object: of the object.
    """
    pose: FloatArray = links[solid.index] if solid.of_hand else T_world_object
    return pose


def carried_by_palm(hand: Hand) -> list[bool]:
    """Say of each link whether it is the palm or moves with it; the others are forearm and arm."""
    carried = [False] * len(hand.links)
    for i, link in enumerate(hand.links):  # parents come first
        carried[i] = i == hand.palm or (link.parent >= 0 and carried[link.parent])
    return carried


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
                colors[i] = mixed(joint_color(closing.index(hand.links[k].joint)), "#ffffff", _WHITE)
    return colors


def joint_color(position: int) -> str:
    """Return the colour of a finger's joint by its place from the palm outwards."""
    return JOINT_COLORS[position % len(JOINT_COLORS)]


def mixed(color: str, other: str, share: float) -> str:
    """Return a colour with a share [-] of another one, both as ``"#rrggbb"``."""
    pairs = zip(rgb(color), rgb(other), strict=True)
    return "#" + "".join(f"{round(255 * ((1.0 - share) * a + share * b)):02x}" for a, b in pairs)


def rgb(color: str) -> tuple[float, float, float]:
    """Return red, green and blue of ``"#rrggbb"``, 0 to 1."""
    red, green, blue = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


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


def _joined(shapes: Iterable[Shape], deviation: float, most: int) -> TriangleMesh:
    return TriangleMesh.joined([thinned(shape.to_mesh(deviation), most) for shape in shapes])
