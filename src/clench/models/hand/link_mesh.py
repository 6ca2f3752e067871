"""The triangles of every link of a hand, ready for the kernels, and how deep two links overlap."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.caching.kept_arrays import Arrays, arrays_of
from clench.core.pose import FloatArray, invert
from clench.models.mesh import TriangleMesh, is_closed
from clench.models.parts import part_points
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import shape_mesh

from .hand import Hand
from .shapes_key import shapes_key

if TYPE_CHECKING:
    from clench.kernels.trees.bvh import MeshTree

#: A link's mesh on disk has so many arrays besides those of its tree.
_OTHERS: Final = 4


@dataclass(frozen=True, eq=False)
class LinkMesh:
    """The triangles of one link, in the link's frame.

    Args:
        link: index of the link in the hand.
        tree: all its shapes as triangles, round ones inscribed.
        owners: `feature_owners` of the tree.
        closed: every shape is watertight with outward normals.
        center, radius: of a ball around it [m], in the link's frame. points: one of every connected part, (N, 3).
    """

    link: int
    tree: MeshTree
    owners: NDArray[np.uint8]
    closed: bool
    center: FloatArray
    radius: float
    points: FloatArray

    @cached_property
    def kept_tree(self) -> MeshTree:
        """The tree where kernels find it by one pointer."""
        from clench.kernels.runtime.by_reference import kept

        return kept(self.tree)


def link_meshes(hand: Hand, source: CollisionSource | None = None) -> tuple[LinkMesh, ...]:
    """Return the meshes of all links of the hand that have a shape; they are made once and live as long as the hand."""
    source = hand.default_source if source is None else CollisionSource(source)
    return hand.kept(("link meshes", source), lambda: _meshes(hand, source))


def _meshes(hand: Hand, source: CollisionSource) -> tuple[LinkMesh, ...]:
    def make() -> Arrays:
        made = (_link_mesh(n, hand.links[n].shapes.get(source, ()), source) for n in hand.solid_links)
        return [array for mesh in made if len(mesh.tree.triangles) for array in _as_arrays(mesh)]

    from clench.kernels.trees.bvh import MeshTree

    found, each = arrays_of(shapes_key(hand, source, "link meshes", __file__), make), _OTHERS + len(MeshTree._fields)
    return tuple(_from_arrays(found[k : k + each]) for k in range(0, len(found), each))


def _as_arrays(mesh: LinkMesh) -> Arrays:
    return [np.array([mesh.link, mesh.closed, mesh.radius]), mesh.owners, mesh.center, mesh.points, *mesh.tree]


def _from_arrays(arrays: Arrays) -> LinkMesh:
    from clench.kernels.trees.bvh import MeshTree

    (link, closed, radius), owners, center, points, *tree = arrays
    return LinkMesh(int(link), MeshTree(*tree), owners, bool(closed), center, float(radius), points)


def _link_mesh(link: int, shapes: tuple[Shape, ...], source: CollisionSource) -> LinkMesh:
    from clench.kernels.trees.bvh import build_tree, feature_owners

    meshes = [shape_mesh(shape, source) for shape in shapes]
    mesh = TriangleMesh.joined(meshes)
    closed = all(s.kind is not ShapeKind.MESH or is_closed(m) for s, m in zip(shapes, meshes, strict=True))
    tree = build_tree(mesh.vertices, mesh.triangles, is_open=not closed)
    corners = tree.vertices[tree.triangles].reshape(-1, 3)
    center = 0.5 * (corners.min(axis=0) + corners.max(axis=0)) if len(corners) else np.zeros(3)
    return LinkMesh(
        link,
        tree,
        feature_owners(tree),
        closed,
        center,
        float(np.linalg.norm(corners - center, axis=1).max(initial=0.0)),
        part_points(tree),
    )


def overlap_depth(a: LinkMesh, b: LinkMesh, poses: FloatArray) -> float:
    """Return how deep two links overlap [m], 0 when they do not.

    Args:
        a, b: the links. poses: of all links in the palm frame, shape (L, 4, 4).
    """
    from clench.kernels.geometry.penetration import CROSSINGS, penetration
    from clench.kernels.trees.bvh import STACK_SIZE

    centers = [poses[m.link][:3, :3] @ m.center + poses[m.link][:3, 3] for m in (a, b)]
    if np.linalg.norm(centers[0] - centers[1]) > a.radius + b.radius:
        return 0.0
    T_b_a = invert(poses[b.link]) @ poses[a.link]
    depth, *_ = penetration(
        a.kept_tree,
        a.owners,
        a.closed,
        b.kept_tree,
        b.owners,
        b.closed,
        np.ascontiguousarray(T_b_a[:3]),
        np.ascontiguousarray(invert(T_b_a)[:3]),
        np.inf,
        (np.empty(CROSSINGS), np.empty(STACK_SIZE, dtype=np.int32)),
    )
    return float(depth)
