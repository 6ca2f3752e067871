"""Say which link of a finger overlaps the object before anything moves (docs/method.md section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.depths import LinkDepth, hand_depths, link_mesh_arrays, mesh_mask
from clench.closing.collision.packed_object import PackedObject
from clench.core.pose import FloatArray
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .finger_plan import FingerPlan, resting_links
from .hand_plan import HandPlan


class LinkMasks(NamedTuple):
    """Masks of meshes, (E, M) each: those of the finger, and those of them that closing does not move."""

    own: NDArray[np.int64]
    resting: NDArray[np.int64]


def link_masks(hand: Hand, plans: tuple[FingerPlan, ...], source: CollisionSource) -> LinkMasks:
    """Return the masks of a hand's plans."""
    meshes = link_mesh_arrays(hand, source)
    return LinkMasks(
        np.array([mesh_mask(meshes, p.finger.links) for p in plans]),
        np.array([mesh_mask(meshes, resting_links(hand, p)) for p in plans]),
    )


def start_overlaps(
    plan: HandPlan, blocked: NDArray[np.int64], packed: PackedObject, T_palm_object: FloatArray
) -> list[LinkDepth | None]:
    """Return the link that overlaps the object deepest at the start, or None, for every finger posture.

    Args:
        plan: of the hand. blocked: blocked flags from the kernels, see `Closed`, shape (E,).
        packed, T_palm_object: the object, shape (4, 4).
    """
    from clench.kernels.closing.start_overlap import CROSSED, FREE, RESTING_LINK

    result: list[LinkDepth | None] = []
    for finger, code in zip(plan.plans, blocked.tolist(), strict=True):
        if code == FREE:
            result.append(None)
            continue
        links = resting_links(plan.hand, finger) if code == RESTING_LINK else finger.finger.links
        depths = hand_depths(plan.hand, finger.posture, packed, T_palm_object, plan.source, links=links)
        deepest = max(depths, key=lambda d: d.depth, default=None)
        if code >= CROSSED and (deepest is None or deepest.depth <= ALLOWED_PENETRATION):
            deepest = LinkDepth(code - CROSSED, 0.0, None)
        result.append(deepest or LinkDepth(links[0], 0.0, None))
    return result
