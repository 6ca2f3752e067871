"""Measure how deep every link of a posed hand overlaps an object, and the retreat that frees the hand."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from clench.closing.linkage import placed_links
from clench.core.pose import FloatArray, invert
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import LinkMesh, link_meshes
from clench.models.shapes import CollisionSource

from .packed_object import PackedObject

if TYPE_CHECKING:
    from clench.kernels.geometry.link_meshes import LinkMeshArrays, ObjectMesh

#: Depths below this fraction of the object's size are rounding of a touch [-].
_TOUCHING: Final = 1e-12


@dataclass(frozen=True)
class LinkDepth:
    """The penetration of one link into the object.

    Args:
        link: index of the link in the hand.
        depth: [m], 0 when disjoint or just touching.
        place: the deepest point in the object's frame [m], shape (3,); None when the depth is 0.
        at_least: the link lies inside completely; the further depth is not measured.
    """

    link: int
    depth: float
    place: FloatArray | None
    at_least: bool = False

    @property
    def text(self) -> str:
        """The depth in words, e.g. "by 1.25 mm"."""
        return f"by {'at least ' if self.at_least else ''}{self.depth * 1e3:.2f} mm"


def hand_depths(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource | None = None,
    *,
    links: Collection[int] | None = None,
) -> tuple[LinkDepth, ...]:
    """Return the depth of penetration of every link that has a shape (docs/method.md section 5).

    Round shapes are inscribed polyhedra, so their depth is too small by at most `TESSELLATION_DEVIATION` for each side.
    Depths up to the size of the link (the diameter of a ball around it) are exact. A deeper link gets the depth of its
    size, and a point at that depth: far inside an object of metres, an exact depth takes seconds.

    Args:
        hand: the hand.
        q: angles of all its joints [rad], shape (J,).
        packed: the object.
        T_palm_object: shape (4, 4).
        source: which geometry of the hand; None is its default.
        links: only these links; None is all of the hand.
    """
    from clench.kernels.geometry.link_meshes import measure_depths

    meshes = link_mesh_arrays(hand, source)
    wanted = np.ones(len(meshes.link), dtype=np.int64) if links is None else mesh_mask(meshes, links)
    T = np.ascontiguousarray(np.asarray(T_palm_object, dtype=np.float64)[:3])
    deepest = np.empty((len(meshes.link), 4))
    measure_depths(meshes, wanted, placed_links(hand, q), object_mesh(packed), T, deepest)
    found = []
    for k in np.flatnonzero(wanted):
        (depth, *place), link = deepest[k].tolist(), int(meshes.link[k])
        if depth > _TOUCHING * packed.radius:
            found.append(LinkDepth(link, depth, np.array(place), depth >= 2.0 * meshes.radius[k]))
        else:
            found.append(LinkDepth(link, 0.0, None))
    return tuple(found)


def mesh_mask(meshes: LinkMeshArrays, links: Collection[int]) -> NDArray[np.int64]:
    """Return a mask of the meshes that belong to the given links, shape (M,)."""
    wanted = set(links)
    return np.array([link in wanted for link in meshes.link.tolist()], dtype=np.int64)


def object_mesh(packed: PackedObject) -> ObjectMesh:
    """Return an object's surface as the kernels that measure depths take it."""
    from clench.kernels.geometry.link_meshes import ObjectMesh

    return ObjectMesh(packed.full_tree, packed.full_owners, packed.closed, packed.points)


def link_mesh_arrays(hand: Hand, source: CollisionSource | None = None) -> LinkMeshArrays:
    """Return the meshes of all links of the hand that have a shape in one piece; made once per hand and source."""
    return _joined_meshes(hand, hand.default_source if source is None else CollisionSource(source))


def travel_to_touch(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    direction: FloatArray,
    source: CollisionSource | None = None,
) -> float:
    """Return how far the hand moves along a direction until a link first touches the object.

    Args:
        hand: the hand.
        q: angles of all its joints [rad], shape (J,).
        packed: the object.
        T_palm_object: where the object is at the start, shape (4, 4); nothing may overlap there.
        direction: unit vector in the palm's frame, shape (3,).
        source: which geometry of the hand; None is its default.

    Returns:
        distance [m], infinite when the hand passes the object.
    """
    return first_touch(hand, q, packed, T_palm_object, direction, source)[0]


def first_touch(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    direction: FloatArray,
    source: CollisionSource | None = None,
) -> tuple[float, int]:
    """Return how far the hand moves along a direction until it touches, and the number of the body that it touches.

    Args:
        hand, q, packed, T_palm_object, direction, source: as for `travel_to_touch`.

    Returns:
        distance [m], infinite when the hand passes; index into the packed bodies, then -1.
    """
    from clench.kernels.toi.passing_planes import COLUMNS, PLANES
    from clench.kernels.toi.toi_translation import PAIRS, first_contact

    stack, planes = np.empty((PAIRS, 2), dtype=np.int32), np.empty((PLANES, COLUMNS))
    T_object_palm = invert(np.asarray(T_palm_object, dtype=np.float64))
    along = T_object_palm[:3, :3] @ direction
    placed = [(mesh, T_object_palm @ T) for mesh, T in _placed(hand, q, source)]
    best, touched = np.inf, -1
    for mesh, T_object_link in sorted(placed, key=lambda pair: -float(pair[1][:3, 3] @ along)):
        # Links that are ahead come first: they bound the search of those behind.
        T = np.ascontiguousarray(T_object_link[:3])
        distance, _, triangle = first_contact(
            mesh.tree, mesh.owners, T, packed.full_tree, packed.full_owners, along, best, stack, planes
        )
        if distance < best:
            best, touched = distance, int(packed.full_tree.body[triangle])
    return best, touched


def retreat_distance(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource | None = None,
) -> float:
    """Return the retreat along the palm normal from which on the hand is free [m].

    The search starts outside: the hand comes in along the normal from a clear position, up to its first touch. The
    distance is 0 if the hand reaches its pose without touching.
    """
    T = np.array(T_palm_object, dtype=np.float64)
    outside = clear_distance(hand, q, packed, T, source)
    T[:3, 3] += outside * hand.palm_normal
    travel = travel_to_touch(hand, q, packed, T, hand.palm_normal, source)
    return max(outside - travel, 0.0)


def clear_distance(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource | None = None,
) -> float:
    """Return a retreat along the palm normal that takes all links off the ball around the object [m], at least 0."""
    normal = hand.palm_normal
    ahead = max(
        (float(normal @ (T[:3, :3] @ mesh.center + T[:3, 3])) + mesh.radius for mesh, T in _placed(hand, q, source)),
        default=0.0,
    )
    center = T_palm_object[:3, :3] @ packed.center + T_palm_object[:3, 3]
    return max(ahead - (float(normal @ center) - packed.radius), 0.0)


def _joined_meshes(hand: Hand, source: CollisionSource) -> LinkMeshArrays:
    return hand.kept(("joined meshes", source), lambda: _joined(link_meshes(hand, source)))


def _joined(meshes: Sequence[LinkMesh]) -> LinkMeshArrays:
    from clench.kernels.geometry.link_meshes import LinkMeshArrays
    from clench.kernels.trees.bvh import build_tree

    def firsts(counts: list[int]) -> NDArray[np.int64]:
        return np.cumsum([0, *counts]).astype(np.int64)

    none = build_tree(np.empty((0, 3)), np.empty((0, 3)))
    trees = [none, *(mesh.tree for mesh in meshes)]
    return LinkMeshArrays(
        link=np.array([mesh.link for mesh in meshes], dtype=np.int64),
        closed=np.array([mesh.closed for mesh in meshes], dtype=np.int64),
        center=np.array([mesh.center for mesh in meshes]).reshape(-1, 3),
        radius=np.array([mesh.radius for mesh in meshes], dtype=np.float64),
        point_first=firsts([len(mesh.points) for mesh in meshes]),
        points=np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in meshes)]),
        vertex_first=firsts([len(mesh.tree.vertices) for mesh in meshes]),
        triangle_first=firsts([len(mesh.tree.triangles) for mesh in meshes]),
        node_first=firsts([len(mesh.tree.low) for mesh in meshes]),
        moment_first=firsts([len(mesh.tree.moments) for mesh in meshes]),
        tree=type(none)(*(np.concatenate(columns) for columns in zip(*trees, strict=True))),
        owners=np.concatenate([np.empty(0, dtype=np.uint8), *(mesh.owners for mesh in meshes)]),
    )


def _placed(hand: Hand, q: FloatArray, source: CollisionSource | None) -> list[tuple[LinkMesh, FloatArray]]:
    poses = hand.link_poses(q)
    return [(mesh, poses[mesh.link]) for mesh in link_meshes(hand, source)]
