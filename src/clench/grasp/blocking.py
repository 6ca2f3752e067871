"""Find the fingers that overlap the object before anything moves (METHOD.md section 3, *overlap at the start*)."""

from __future__ import annotations

from clench.base.pose import FloatArray
from clench.base.tolerances import ALLOWED_PENETRATION
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .closing import ClosedHand, HandPlan
from .containment import may_hold_part
from .depths import LinkDepth, hand_depths
from .plan import resting_links
from .scene import PackedObject


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
    result: list[LinkDepth | None] = []
    around = may_hold_part(hand, link_pose, packed, T_palm_object, source)
    for entry, finger in enumerate(plan.plans):
        crossed = _crossed_link(plan, closed, entry)
        # Links that closing moves are judged on the planes; those that only the posture moves lie on none, and a part
        # of the object inside a link may lie between them.
        everything = crossed >= 0 or around[entry]
        links = finger.finger.links if everything else resting_links(hand, finger)
        depths = hand_depths(hand, finger.posture, packed, T_palm_object, source, links=links) if links else ()
        deepest = max(depths, key=lambda d: d.depth, default=None)
        if deepest is not None and deepest.depth > ALLOWED_PENETRATION:
            result.append(deepest)
        elif crossed >= 0:
            result.append(LinkDepth(crossed, 0.0, None))
        else:
            result.append(None)
    return result


def _crossed_link(plan: HandPlan, closed: ClosedHand, entry: int) -> int:
    """Return a moving link that overlaps the object at the start, or -1."""
    if closed.overlaps[entry] >= 0:
        return int(plan.arrays.outlines.link[closed.overlaps[entry]])
    return int(closed.answer.overlap[plan.items.entry == entry].max(initial=-1))
