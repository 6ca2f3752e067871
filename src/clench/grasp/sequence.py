"""Close the chosen sets again one finger after another, each with the others in its way (docs/method.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .candidates import FingerCandidate, closed_anew
from .closing import ClosedHand, HandPlan, close_items_again
from .exact import HandBodies
from .linkage import placed_postures
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
    if len(hand.fingers) == 1:
        return list(chosen)
    result, first = list(chosen), 0
    while True:
        waiting, placed = _placed(hand, plan, exact, result, start, first)
        among = exact._replace(link_pose=placed, checked=bodies.across - bodies.within)
        meets = _meeting(plan, among, closed, [result[k] for k in waiting], rounds)
        k = next((k for k, met in zip(waiting, meets, strict=True) if met), None)
        if k is None:
            return result
        among = among._replace(checked=bodies.across, wanted=np.ones(1, dtype=np.int64))
        result[k] = closed_anew(hand, plan, among, closed, packed, result[k], rounds)
        first = k + 1


def _placed(
    hand: Hand,
    plan: HandPlan,
    exact: ExactArrays,
    sets: Sequence[FingerCandidate],
    start: FloatArray,
    first: int,
) -> tuple[list[int], FloatArray]:
    """Return which fingers may have to close anew, from the `first` on, and where links are when each begins to close.

    Returns:
        indices of the sets; poses of the links for every entry, shape (E, L, 3, 4).
    """
    waiting, postures, q = [], [], start.copy()
    for k, candidate in enumerate(sets):
        own = candidate.plan.finger.own
        if k >= first and candidate.plane is None and candidate.overlap is None:
            waiting.append(k)
            postures.append(q.copy())
            postures[-1][own] = candidate.plan.posture[own]
        q[own] = candidate.q[own]
    placed = exact.link_pose.copy()
    if waiting:
        placed[plan.items.entry[[sets[k].item for k in waiting]]] = placed_postures(hand, np.array(postures))
    return waiting, placed


def _meeting(
    plan: HandPlan, exact: ExactArrays, closed: ClosedHand, sets: Sequence[FingerCandidate], rounds: int
) -> list[bool]:
    """Say which fingers meet another one's links on the path to their sets; the object plays no part."""
    if rounds > 1 or not sets:
        return [True] * len(sets)
    length = np.zeros(len(plan.arrays.chain.group_length))
    for candidate in sets:
        entry = int(plan.items.entry[candidate.item])
        first, last = plan.arrays.entry_group[entry : entry + 2]
        length[first:last] = candidate.travel
    bounded = replace(plan, arrays=plan.arrays._replace(chain=plan.arrays.chain._replace(group_length=length)))
    exact = exact._replace(wanted=np.ones(len(sets), dtype=np.int64))
    answer = close_items_again(bounded, exact, None, closed, [c.item for c in sets], rounds).answer
    met = (answer.contacts > 0) | (answer.skipped > 0)
    return [bool(m) or any(c.plan.breaks) for m, c in zip(met.tolist(), sets, strict=True)]
