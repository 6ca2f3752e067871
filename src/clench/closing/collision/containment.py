"""Whether a part of a link lies wholly inside the object, or a part of the object inside a link.

Surfaces that do not cross leave only this to be asked, and for each connected part one of its points answers it.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from clench.closing.linkage import placed_links
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes
from clench.models.shapes import CollisionSource

from .depths import link_mesh_arrays, mesh_mask, object_mesh
from .packed_object import PackedObject


def contained_link(
    hand: Hand,
    q: FloatArray,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource,
    links: Collection[int],
) -> int | None:
    """Return a link that has a part inside the object or around a part of it, or None.

    Args:
        hand: the hand. q: angles of all its joints [rad], shape (J,). packed: the object.
        T_palm_object: pose of the object, shape (4, 4). source: geometry of the hand. links: which links.
    """
    from clench.kernels.geometry.link_meshes import find_contained
    from clench.kernels.runtime.by_reference import kept

    meshes = link_mesh_arrays(hand, source)
    T = np.ascontiguousarray(np.asarray(T_palm_object, dtype=np.float64)[:3])
    poses = placed_links(hand, q)
    found = int(find_contained(kept(meshes), mesh_mask(meshes, links), poses, kept(object_mesh(packed)), T))
    return None if found < 0 else found


def link_within_link(hand: Hand, q: FloatArray, source: CollisionSource, checked: np.ndarray) -> tuple[int, int] | None:
    """Return a link that has a part inside another one, and that one, or None.

    Args:
        hand: the hand. q: angles of all its joints [rad], shape (J,). source: geometry of the hand.
        checked: which links may not overlap which, shape (L, L).
    """
    from clench.kernels.geometry.mesh_distance import is_inside

    meshes = link_meshes(hand, source)
    links = np.array([mesh.link for mesh in meshes], dtype=np.int64)
    poses = placed_links(hand, q)[links]
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.points) for mesh in meshes])
    centers = np.einsum("mij,mj->mi", poses[:, :3, :3], np.reshape([m.center for m in meshes], (-1, 3)))
    centers += poses[:, :3, 3]
    points = np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in meshes)])
    points = np.einsum("pij,pj->pi", poses[owner, :3, :3], points) + poses[owner, :3, 3]
    # Most points are outside of the balls around the other links.
    near = np.linalg.norm(centers[:, None] - points, axis=2) <= np.reshape([m.radius for m in meshes], (-1, 1))
    near &= checked[np.ix_(links[owner], links)].T != 0
    for m, k in zip(*np.nonzero(near), strict=True):
        p = (points[k] - poses[m, :3, 3]) @ poses[m, :3, :3]
        if is_inside(meshes[m].kept_tree, (p[0], p[1], p[2]), meshes[m].closed):
            return int(links[owner[k]]), int(links[m])
    return None
