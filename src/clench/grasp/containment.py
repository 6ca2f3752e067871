"""Whether a part of a link lies wholly inside the object, or a part of the object inside a link.

Surfaces that do not cross leave only this to be asked, and for each connected part one of its points answers it.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from clench.base.pose import FloatArray, invert
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .depths import LinkMesh, link_meshes
from .scene import PackedObject


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
        T_palm_object: where it is, shape (4, 4). source: geometry of the hand. links: which links.
    """
    from clench.kernels.distance import is_inside

    poses = invert(T_palm_object) @ hand.link_poses(q)
    for mesh in link_meshes(hand, source):
        if mesh.link not in links:
            continue
        T = poses[mesh.link]
        for p in mesh.points @ T[:3, :3].T + T[:3, 3] if _fits(mesh, T, packed) else ():
            if is_inside(packed.full_tree, (p[0], p[1], p[2]), packed.closed):
                return mesh.link
        for p in (packed.points - T[:3, 3]) @ T[:3, :3]:
            if is_inside(mesh.tree, (p[0], p[1], p[2]), mesh.closed):
                return mesh.link
    return None


def _fits(mesh: LinkMesh, T_object_link: FloatArray, packed: PackedObject) -> bool:
    """Say whether a link of one part lies in the object's box, as it must to lie in the object; any other may."""
    if len(mesh.points) != 1 or not len(packed.full_tree.low):
        return True
    first = T_object_link[:3, :3] @ mesh.points[0] + T_object_link[:3, 3]
    if not (np.all(first >= packed.full_tree.low[0]) and np.all(first <= packed.full_tree.high[0])):
        return False  # most links end here, by one of their corners
    placed = mesh.tree.vertices @ T_object_link[:3, :3].T + T_object_link[:3, 3]
    low, high = packed.full_tree.low[0], packed.full_tree.high[0]
    return bool(np.all(placed >= low) and np.all(placed <= high))
