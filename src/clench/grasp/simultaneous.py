"""Fingers that move at the same time hold each other where they meet (METHOD.md sections 4 and 5, *together*)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from clench.base.pose import FloatArray
from clench.base.tolerances import TOUCH_FRACTION
from clench.models.hand.hand import Hand

from .candidates import FingerCandidate, Touch, read_candidates
from .closing import ClosedHand, HandPlan, close_item_again, only_item
from .exact import HandBodies
from .plan import last_closing_joint
from .scene import PackedObject

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays

#: Postures that the search for one meeting looks at; a pass that needs more is taken for a meeting, which is safe.
_LOOKS: Final = 20_000
#: The kind of a touch of two links' surfaces that lie on no plane.
_FACE: Final = 5


class Meeting(NamedTuple):
    """Describe where two fingers meet first.

    Args:
        at: motion so far. links: one of either finger. position: [m], normal: from the second link to the first,
            in the palm frame, shape (3,). gap: [m].
    """

    at: float
    links: tuple[int, int]
    position: FloatArray
    normal: FloatArray
    gap: float


def close_together(
    hand: Hand,
    plan: HandPlan,
    exact: ExactArrays,
    closed: ClosedHand,
    packed: PackedObject,
    chosen: Sequence[FingerCandidate],
    bodies: HandBodies,
) -> list[FingerCandidate]:
    """Return the chosen sets, with joints held from where their fingers meet.

    Fingers that overlap each other before they move are left alone; their sets are not `exact`.

    Args:
        hand: the hand. plan, exact, closed: of its fingers, as closed without each other. packed: the object.
        chosen: one set per finger. bodies: see `hand_bodies`.
    """
    sets = list(chosen)
    until = {c.item: plan.items.until[c.item].copy() for c in sets}
    held: dict[int, list[Touch]] = {c.item: [] for c in sets}
    apart = bodies.across - bodies.within
    while True:
        moving = [k for k, c in enumerate(sets) if c.plane is None and c.overlap is None]
        meetings = [(_meeting(hand, sets[a], sets[b], bodies, apart), a, b) for a, b in combinations(moving, 2)]
        found = [(m, a, b) for m, a, b in meetings if m is not None]
        for m, a, b in found:
            if m.at == 0.0:
                sets[a], sets[b] = replace(sets[a], exact=False), replace(sets[b], exact=False)
        later = [row for row in found if row[0].at > 0.0]
        if not later:
            return [replace(c, touches=(*c.touches, *held[c.item])) for c in sets]
        first, a, b = min(later, key=lambda row: (row[0].at, row[0].links))
        for k, own, other, sign in ((a, 0, 1, 1.0), (b, 1, 0, -1.0)):
            c = sets[k]
            joint = _hold(hand, plan, c, first.links[own], first.at, until[c.item])
            held[c.item].append(_touch(first, first.links[own], first.links[other], joint, sign))
            sets[k] = _closed_again(hand, plan, exact, closed, packed, c, until[c.item])


def _hold(hand: Hand, plan: HandPlan, c: FingerCandidate, link: int, at: float, until: FloatArray) -> int:
    """Hold the joints of a finger up to a link from a place of the motion on; return the last of them in the hand."""
    first = int(np.searchsorted(plan.arrays.chain.joint_group, plan.arrays.entry_group[plan.items.entry[c.item]]))
    moved_by = last_closing_joint(hand, c.plan.finger, [p.joint for p in c.plan.joints])
    last = [p.joint for p in c.plan.joints].index(moved_by[link])
    until[first : first + last + 1] = np.minimum(until[first : first + last + 1], at)
    return c.plan.joints[last].joint


def _closed_again(
    hand: Hand,
    plan: HandPlan,
    exact: ExactArrays,
    closed: ClosedHand,
    packed: PackedObject,
    c: FingerCandidate,
    until: FloatArray,
) -> FingerCandidate:
    held = plan.items.until.copy()
    held[c.item] = until
    bound = replace(plan, items=plan.items._replace(until=held))
    one = exact._replace(wanted=exact.wanted[c.item : c.item + 1])
    again = close_item_again(bound, one, packed, closed, c.item, 1)
    (found,) = read_candidates(hand, only_item(bound, c.item), packed, again, [None] * len(plan.plans))
    return replace(found, item=c.item)


def _meeting(
    hand: Hand, one: FingerCandidate, other: FingerCandidate, bodies: HandBodies, apart: np.ndarray
) -> Meeting | None:
    """Return where two fingers first meet that were free of each other, or that they overlap at the start.

    Steps as long as the gap allows at the fastest that any two points can approach each other cannot pass a meeting.
    """
    pairs = [(m, r) for m in one.plan.finger.links for r in other.plan.finger.links if apart[m, r]]
    ends = max(_duration(one), _duration(other))
    touch = TOUCH_FRACTION * min(one.plan.length, other.plan.length)
    at, meeting = 0.0, None
    for _ in range(_LOOKS):
        meeting = _closest(hand, one, other, bodies, pairs, at)
        if meeting is None:
            return None
        if meeting.gap <= touch:
            still = _still(one, at) and _still(other, at)
            return None if still else meeting
        at += meeting.gap / (_speed(one, at) + _speed(other, at) + 1e-300)
        if at >= ends:
            return None
    return meeting


def _closest(
    hand: Hand,
    one: FingerCandidate,
    other: FingerCandidate,
    bodies: HandBodies,
    pairs: list[tuple[int, int]],
    at: float,
) -> Meeting | None:
    """Return the closest pair of links where both fingers are after so much motion."""
    from clench.kernels.nearness import link_gap

    q = one.plan.posture.copy()
    for c in (one, other):
        own = [p.joint for p in c.plan.joints]
        q[own] = c.plan.turned(hand, _turn(c, at))[own]
    poses = np.ascontiguousarray(hand.link_poses(q)[:, :3])
    best, found = np.inf, None
    out = np.empty(6)
    for m, r in pairs:
        gap = link_gap(bodies.links, m, r, poses, best, out)
        if gap < best:
            best, found = gap, Meeting(at, (m, r), out[:3].copy(), out[3:].copy(), gap)
    return found


def _turn(c: FingerCandidate, at: float) -> FloatArray:
    """Return how far the joints of a set's plan have turned after so much motion [rad], shape (n,)."""
    turns = []
    for p in c.plan.joints:
        moved = min(max(c.plan.speeds[p.group] * at, p.start), p.stop) - p.start
        final = abs(c.q[p.joint] - c.plan.posture[p.joint])
        turns.append(np.sign(p.rate) * min(abs(p.rate) * moved, final))
    return np.array(turns)


def _still(c: FingerCandidate, at: float) -> bool:
    return bool(np.array_equal(_turn(c, at), _turn(c, np.inf)))


def _speed(c: FingerCandidate, at: float) -> float:
    """Return a bound on the speed of a finger's points from here on [m per motion]."""
    left = _turn(c, np.inf) != _turn(c, at)
    rates = [abs(p.rate) * c.plan.speeds[p.group] for p in c.plan.joints]
    return c.plan.length * float(np.sum(np.array(rates)[left]))


def _duration(c: FingerCandidate) -> float:
    """Return how long a finger moves."""
    ends = [
        (p.start + abs(c.q[p.joint] - c.plan.posture[p.joint]) / abs(p.rate)) / c.plan.speeds[p.group]
        for p in c.plan.joints
        if p.rate != 0.0
    ]
    return max(ends, default=0.0)


def _touch(meeting: Meeting, link: int, met: int, joint: int, sign: float) -> Touch:
    return Touch(
        link=link,
        joint=joint,
        body=-1 - met,
        graspable=False,
        plane=None,
        offset=0.0,
        kind=_FACE,
        position=meeting.position,
        normal=sign * meeting.normal,
        gap=meeting.gap,
        curve_angle=0.0,
        link_angle=None,
    )
