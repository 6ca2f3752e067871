"""Close the chosen sets again one finger after another, each with the others in its way (METHOD.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .candidates import FingerCandidate, closed_anew
from .closing import ClosedHand, HandPlan, close_item_again
from .exact import HandBodies
from .linkage import placed_links
from .scene import PackedObject

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays


def close_in_sequence(
    hand: Hand,
    plan: HandPlan,
    exact: ExactArrays,
    closed: ClosedHand,
    packed: PackedObject,
    chosen: Sequence[FingerCandidate],
    start: FloatArray,
    rounds: int,
    bodies: HandBodies,
) -> list[FingerCandidate]:
    """Return the chosen sets, closed anew where an earlier finger, or one still open, is in the way.

    A finger that meets no other on the path that it has already keeps its set. Sets of a single plane, and those of
    fingers that overlap the object before they move, stay as they are.

    Args:
        hand: the hand. plan, exact, closed: of its fingers, as closed without each other. packed: the object.
        chosen: one set per finger, in closing order. start: posture before closing [rad], shape (J,).
        rounds: how often all degrees of freedom are gone through. bodies: see `hand_bodies`.
    """
    others = bodies.across - bodies.within
    q = start.copy()
    result = []
    for candidate in chosen:
        if candidate.plane is None and candidate.overlap is None and len(hand.fingers) > 1:
            entry = int(plan.items.entry[candidate.item])
            posture = q.copy()
            own = list(candidate.plan.finger.joints)
            posture[own] = candidate.plan.posture[own]
            placed = exact.link_pose.copy()
            placed[entry] = placed_links(hand, posture)
            among = exact._replace(link_pose=placed, wanted=np.ones(1, dtype=np.int64))
            if _meets_another(plan, among._replace(checked=others), closed, candidate, entry, rounds):
                among = among._replace(checked=bodies.across)
                candidate = closed_anew(hand, plan, among, closed, packed, candidate, rounds)
        own = list(candidate.plan.finger.joints)
        q[own] = candidate.q[own]
        result.append(candidate)
    return result


def _meets_another(
    plan: HandPlan, exact: ExactArrays, closed: ClosedHand, candidate: FingerCandidate, entry: int, rounds: int
) -> bool:
    """Say whether a finger meets another one's links on the path to a set; the object plays no part."""
    if rounds > 1 or any(candidate.plan.breaks):
        return True
    first, last = plan.arrays.entry_group[entry : entry + 2]
    length = np.zeros(len(plan.arrays.chain.group_length))
    length[first:last] = candidate.travel
    chain = plan.arrays.chain._replace(group_length=length)
    bounded = replace(plan, arrays=plan.arrays._replace(chain=chain))
    answer = close_item_again(bounded, exact, None, closed, candidate.item, rounds).answer
    return bool(answer.contacts[0] or answer.skipped[0])
