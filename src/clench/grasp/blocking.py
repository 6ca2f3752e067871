"""Find the fingers that overlap the object before anything moves (docs/method.md section 3, *overlap at the start*)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.base.keeping import kept_by_identity
from clench.base.pose import FloatArray
from clench.base.tolerances import ALLOWED_PENETRATION
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .closing import ClosedHand, HandPlan
from .depths import LinkDepth, hand_depths, link_mesh_arrays, mesh_mask, object_mesh
from .plan import FingerPlan, resting_links
from .scene import PackedObject

_KEPT_PLANS = 64


class LinkMasks(NamedTuple):
    """Say which meshes are those of each entry's finger, and which of them closing does not move, (E, M) each."""

    own: NDArray[np.int64]
    resting: NDArray[np.int64]


@kept_by_identity(_KEPT_PLANS)
def link_masks(hand: Hand, plans: tuple[FingerPlan, ...], source: CollisionSource) -> LinkMasks:
    """Return the masks of a hand's plans, found once."""
    meshes = link_mesh_arrays(hand, source)
    return LinkMasks(
        np.array([mesh_mask(meshes, p.finger.links) for p in plans]),
        np.array([mesh_mask(meshes, resting_links(hand, p)) for p in plans]),
    )


def start_overlaps(
    hand: Hand,
    plan: HandPlan,
    link_pose: FloatArray,
    closed: ClosedHand,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource,
) -> list[LinkDepth | None]:
    """Return, for every entry, the link that overlaps the object deepest at the start, or None.

    Args:
        hand: the hand. plan: of its fingers. link_pose: see `ExactArrays`.
        closed: which entries overlap, on a plane or anywhere over their width.
        packed, T_palm_object: the object, shape (4, 4). source: geometry of the hand.
    """
    from clench.kernels.start_overlap import RESTING_LINK, find_start_overlaps

    masks, T = link_masks(hand, plan.plans, source), np.ascontiguousarray(T_palm_object[:3])
    blocked = np.empty(len(plan.plans), dtype=np.int64)
    whole = any(plan.whole)
    find_start_overlaps(link_pose, link_mesh_arrays(hand, source), *masks, object_mesh(packed), T, whole, blocked)
    crossed = _crossed_links(plan, closed)
    result: list[LinkDepth | None] = []
    for finger, link, code in zip(plan.plans, crossed, blocked.tolist(), strict=True):
        found = None
        if code or link >= 0:
            links = resting_links(hand, finger) if code == RESTING_LINK and link < 0 else finger.finger.links
            depths = hand_depths(hand, finger.posture, packed, T_palm_object, source, links=links)
            found = max(depths, key=lambda d: d.depth, default=None)
            if found is None or found.depth <= ALLOWED_PENETRATION:
                found = LinkDepth(link, 0.0, None) if link >= 0 else None
        result.append(found)
    return result


def _crossed_links(plan: HandPlan, closed: ClosedHand) -> list[int]:
    """Return, for every entry, a moving link that overlaps the object at the start, or -1."""
    links = [-1] * len(plan.plans)
    for entry, link in zip(plan.items.entry.tolist(), closed.answer.overlap.tolist(), strict=True):
        links[entry] = max(links[entry], link)
    for entry, outline in enumerate(closed.overlaps.tolist()):
        if outline >= 0:
            links[entry] = int(plan.arrays.outlines.link[outline])
    return links
