"""Fingers that move at the same time hold each other where they meet (docs/method.md sections 4 and 5, *together*)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from itertools import combinations
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .candidates import FingerCandidate, Touch, closed_anew
from .closing import ClosedHand, HandPlan
from .exact import HandBodies
from .lanes import links_that_may_meet
from .plan import last_closing_joint
from .scene import PackedObject

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays

#: Postures that the search for one meeting looks at; a pass that needs more is taken for a meeting, which is safe.
_LOOKS: Final = 20_000
#: The kind of a touch of two links' surfaces that lie on no plane.
_FACE: Final = 5
#: How far off the gap of two links may be while they are apart [-].
_SLACK: Final = 2.0
#: They are no longer below this gap [m].
_NEAR: Final = 1e-4
#: Gap at which they meet [m].
_TOUCH: Final = 1e-9
#: Places of the motion that differ by less are one [-].
_ROUNDING: Final = 1e-12


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
    moving = [k for k, c in enumerate(sets) if c.plane is None]
    # How fast joints move links is a matter of the plan; where they are held changes nothing of it.
    speeds = {k: _link_speeds(hand, sets[k], bodies) for k in moving}
    meetings: dict[tuple[int, int], Meeting | None] = {}
    overlapping: set[int] = set()
    since = 0.0
    while True:
        for a, b in combinations(moving, 2):
            if (a, b) not in meetings:
                meetings[a, b] = _meeting(hand, (sets[a], sets[b]), (speeds[a], speeds[b]), bodies, apart, since)
        found = [(m, a, b) for (a, b), m in meetings.items() if m is not None]
        overlapping |= {k for m, a, b in found if m.at == 0.0 for k in (a, b)}
        later = [row for row in found if row[0].at > 0.0]
        if not later:
            return [_finished(c, held[c.item], c.exact and k not in overlapping) for k, c in enumerate(sets)]
        first, a, b = min(later, key=lambda row: (row[0].at, row[0].links))
        # Until there all move as they did.
        since = first.at
        meetings = {
            pair: m for pair, m in meetings.items() if not {a, b} & set(pair) or (m is not None and m.at == 0.0)
        }
        # Two links that met rest from there on: they do not meet again.
        apart[first.links[0], first.links[1]] = apart[first.links[1], first.links[0]] = 0
        for k, own, other, sign in ((a, 0, 1, 1.0), (b, 1, 0, -1.0)):
            c = sets[k]
            joint = _hold(hand, plan, c, first.links[own], first.at, until[c.item])
            if joint is None:
                continue
            held[c.item].append(_touch(first, first.links[own], first.links[other], joint, sign))
            sets[k] = _closed_again(hand, plan, exact, closed, packed, c, until[c.item])


def _finished(c: FingerCandidate, held: list[Touch], exact: bool) -> FingerCandidate:
    if not held and exact == c.exact:
        return c
    return replace(c, exact=exact, touches=(*c.touches, *held))


def _hold(hand: Hand, plan: HandPlan, c: FingerCandidate, link: int, at: float, until: FloatArray) -> int | None:
    """Hold the joints of a finger up to a link from a place of the motion on; return the last of them in the hand.

    None is returned for a link that rests, and where nothing of the finger moves.
    """
    first = plan.joints_of(int(plan.items.entry[c.item])).start
    moved_by = last_closing_joint(hand, c.plan.finger, [p.joint for p in c.plan.joints])
    if link not in moved_by or c.overlap is not None:
        return None
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
    return closed_anew(hand, bound, one, closed, packed, c, 1)


def _meeting(
    hand: Hand,
    pair: tuple[FingerCandidate, FingerCandidate],
    speeds: tuple[dict[int, FloatArray], dict[int, FloatArray]],
    bodies: HandBodies,
    apart: np.ndarray,
    since: float,
) -> Meeting | None:
    """Return where two fingers first meet that are free of each other up to `since`, or overlap at the start.

    Steps as long as the gap of two links allows, at the fastest that any of their points approach each other, cannot
    pass a meeting. The pair that has come least far is looked at next.
    """
    from clench.kernels.nearness import link_gap

    ends = [_joint_ends(c) for c in pair]
    # What rests on both sides is judged with the whole hand.
    lasts = [{link: _last_end(own, e) for link, own in found.items()} for found, e in zip(speeds, ends, strict=True)]
    paths = [{link: s * e for link, s in found.items()} for found, e in zip(speeds, ends, strict=True)]
    near = links_that_may_meet(hand, (pair[0].plan, pair[1].plan), (paths[0], paths[1]), bodies)
    last = {(m, r): max(lasts[0][m], lasts[1][r]) for m, r in near if apart[m, r]}
    waiting = [(since, m, r, np.inf) for (m, r), end in last.items() if end > since]
    heapify(waiting)
    out = np.empty(6)
    for looks in range(_LOOKS):
        if not waiting:
            return None
        at, m, r, away = heappop(waiting)
        # Only joints that move still count.
        end, speed = last[m, r], float(speeds[0][m] @ (ends[0] > at) + speeds[1][r] @ (ends[1] > at))
        slack = _SLACK if away > _NEAR else 1.0
        # A gap that is not below the bound may be smaller by the slack, and is enough for what is left of the motion.
        bound = slack * ((end - at) * speed + 2.0 * _TOUCH)
        gap = link_gap(bodies.links, m, r, _poses(hand, pair, at), bound, slack, out)
        if gap <= _TOUCH or looks == _LOOKS - 1:
            return Meeting(at, (m, r), out[:3].copy(), out[3:].copy(), gap)
        # Links that are held where they met touch at the end of their motion.
        step = gap / (slack * speed)
        if gap < bound and at + step < (1.0 - _ROUNDING) * end:
            heappush(waiting, (at + step, m, r, gap))
    return None


def _poses(hand: Hand, pair: tuple[FingerCandidate, FingerCandidate], at: float) -> FloatArray:
    """Return `T_palm_link` of every link after so much motion of two fingers, shape (L, 3, 4)."""
    q = pair[0].plan.posture.copy()
    for c in pair:
        own = [p.joint for p in c.plan.joints]
        q[own] = c.on_the_way(hand, np.array(c.plan.speeds) * at)[own]
    return np.ascontiguousarray(hand.link_poses(q)[:, :3])


def _link_speeds(hand: Hand, c: FingerCandidate, bodies: HandBodies) -> dict[int, FloatArray]:
    """Return bounds on how fast each joint of a plan moves the points of links that can touch [m per motion], (n,)."""
    moved_by = last_closing_joint(hand, c.plan.finger, [p.joint for p in c.plan.joints])
    poses = hand.link_poses(c.plan.posture)
    pivots = [c.plan.families[p.family].pivot_in_palm(p.pivot) for p in c.plan.joints]
    rates = [abs(p.rate) * c.plan.speeds[p.group] for p in c.plan.joints]
    order = [p.joint for p in c.plan.joints]
    speeds = {}
    for link in c.plan.finger.links:
        if bodies.links.root[link] < 0:
            continue
        ball = bodies.links.node[bodies.links.root[link]]
        speeds[link] = np.zeros(len(order))
        if link in moved_by:
            last = order.index(moved_by[link])
            middle = poses[link][:3, :3] @ ball[:3] + poses[link][:3, 3]
            reach = float(np.linalg.norm(middle - pivots[last])) + ball[3]
            for j in range(last, -1, -1):
                speeds[link][j] = rates[j] * reach
                reach += float(np.linalg.norm(pivots[j] - pivots[j - 1])) if j else 0.0
    return speeds


def _joint_ends(c: FingerCandidate) -> FloatArray:
    """Return after how much motion each joint of a set's plan is at rest, shape (n,); 0 for one that never moves."""
    ends = []
    for p in c.plan.joints:
        turn = abs(c.q[p.joint] - c.plan.posture[p.joint])
        ends.append((p.start + turn / abs(p.rate)) / c.plan.speeds[p.group] if turn > 0.0 else 0.0)
    return np.array(ends)


def _last_end(speeds: FloatArray, ends: FloatArray) -> float:
    """Return after how much motion a link is at rest that joints move so fast."""
    return float(ends[speeds > 0.0].max(initial=0.0))


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
