"""Decide which way every finger closes: from its joints' limits, the other fingers, and where the fingertips meet.

A finger has one sense, about the axis of its most distal joint. Every joint that follows no other has one vote, from
its limits. If votes are even, the side on which the other fingers close decides, or else the place where the fingertips
meet.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.findings import Finding, FindingCode, Severity, in_hand_file, quoted
from clench.models.hand.hand import Finger, Hand, Joint
from clench.models.hand.hand_file import JointOverride

from .finger_geometry import finger_line, tip_motion
from .jaws import open_apart

#: Limits are equally far when their distances differ by less than this share of the range [-].
_EQUALLY_FAR = 0.05
#: Curl of the fingers at which their meeting side is tested [rad].
_CURL = np.deg2rad(60.0)
#: Sides whose mean tip distances differ by less than this share cannot be told apart [-].
_UNDECIDED = 0.02
#: Tips close to the same side when the cosine between their motions is at least this [-].
_SAME_SIDE = 0.4


@dataclass(frozen=True)
class Vote:
    """The closing direction of a finger according to the limits of one joint.

    Args:
        direction: +1 when the angle grows. share: how uneven the limits are, 1 when one is straight [-]. reason: why.
    """

    direction: int
    share: float
    reason: str


@dataclass
class FingerPlan:
    """The decisions about one finger.

    Args:
        finger: which. closing: joint indices, palm side first. signs: of each closing axis against the most
            distal one. straight: angle of each closing joint at which the finger is straight [rad].
        given: directions of the hand file, by joint. votes: by joint that leads.
        sense: +1 or -1 about the most distal axis, None while undecided; `sense_reason` says why.
        shut_when_straight: the finger is closed when straight, and opens at its limits.
    """

    finger: Finger
    closing: list[int] = field(default_factory=list)
    signs: list[int] = field(default_factory=list)
    straight: list[float] = field(default_factory=list)
    straight_reason: list[str] = field(default_factory=list)
    given: dict[int, int] = field(default_factory=dict)
    votes: dict[int, Vote] = field(default_factory=dict)
    sense: int | None = None
    sense_reason: str = ""
    shut_when_straight: bool = False

    def direction(self, n: int, sense: int) -> int:
        """Return the direction of its n-th closing joint when the finger closes in a sense."""
        return self.given.get(self.closing[n], sense * self.signs[n])

    def senses(self) -> list[int]:
        """Return the sense for which each joint votes."""
        return [self.signs[n] * self.votes[j].direction for n, j in enumerate(self.closing) if j in self.votes]


def note_limits(plan: FingerPlan, n: int, joint: Joint, override: JointOverride) -> None:
    """Record the statement of the hand file or the limits about the n-th closing joint of a finger."""
    j = plan.closing[n]
    if override.direction is not None:
        plan.given[j] = override.direction
        return
    up, down = joint.upper - plan.straight[n], plan.straight[n] - joint.lower
    uneven = abs(up - down) / (joint.upper - joint.lower)
    if uneven <= _EQUALLY_FAR:
        return
    far = "upper" if up > down else "lower"
    angles = f"{np.rad2deg(max(up, down)):.0f} deg against {np.rad2deg(min(up, down)):.0f}"
    reason = f"the {far} limit is farther from straight ({angles})"
    plan.votes[j] = Vote(1 if up > down else -1, min(1.0, uneven), reason)


def decide_senses(hand: Hand, plans: list[FingerPlan]) -> list[Finding]:
    """Give every finger its sense and return the uncertain points.

    Args:
        hand: with roles; its joints open at straight. plans: with votes.
    """
    for plan in plans:
        _count(plan)
    findings = _turn_round(hand, plans)
    for plan in plans:
        _side_with_others(hand, plan, plans)
    return [*findings, *_by_tips(hand, plans)]


def contradicting(plan: FingerPlan) -> list[int]:
    """Return the joints whose limits say that they close the other way than their finger does."""
    if plan.shut_when_straight:
        return []
    return [
        j
        for n, j in enumerate(plan.closing)
        if j in plan.votes and plan.votes[j].direction != plan.direction(n, plan.sense or 1)
    ]


def _count(plan: FingerPlan) -> None:
    """Let most of a finger's joints decide; the hand file decides where no limits tell."""
    senses = plan.senses()
    if not senses:
        senses = [plan.signs[n] * plan.given[j] for n, j in enumerate(plan.closing) if j in plan.given]
    if sum(senses) != 0:
        plan.sense = 1 if sum(senses) > 0 else -1
        plan.sense_reason = "limits equally far; closes like the other joints of the finger"


def _turn_round(hand: Hand, plans: list[FingerPlan]) -> list[Finding]:
    """Reverse senses if limits lead all fingertips apart: these fingers are closed when straight."""
    moving = [plan for plan in plans if plan.closing]
    leading = [plan for plan in moving if plan.votes]
    if not leading or any(plan.given or (plan.sense is None and _leads(hand, plan)) for plan in moving):
        return []
    if not open_apart(hand, [plan.finger for plan in moving], _towards(hand, leading)):
        return []
    for plan in leading:
        assert plan.sense is not None
        plan.sense, plan.shut_when_straight = -plan.sense, True
        plan.sense_reason = "the fingers are together where they are straight, and apart at the other limit"
    names = quoted([plan.finger.name for plan in leading])
    joints = [j for plan in leading for j in plan.closing if j in plan.votes]
    text = f"The model's zero is closed: the limits of {names} lead their tips apart, so they close towards zero."
    return [_advised(hand, joints, text, Severity.NOTE)]


def _towards(hand: Hand, plans: Sequence[FingerPlan]) -> dict[int, tuple[float, float]]:
    """Return where the leading joints are straight, and their limits in the sense of their fingers [rad]."""
    found = {}
    for plan in plans:
        for n, j in enumerate(plan.closing):
            joint = hand.joints[j]
            far = joint.upper if plan.direction(n, plan.sense or 1) > 0 else joint.lower
            found[j] = (min(max(plan.straight[n], joint.lower), joint.upper), far)
    return found


def _side_with_others(hand: Hand, plan: FingerPlan, plans: Sequence[FingerPlan]) -> None:
    """Let a finger whose limits contradict each other close to the side of the fingers that are decided."""
    others = [p for p in plans if p is not plan and p.sense is not None and p.senses() and not p.finger.is_thumb]
    if plan.sense is not None or not plan.votes or plan.finger.is_thumb or not others:
        return
    side = np.mean([_way(hand, p, p.sense or 1) for p in others], axis=0)
    agreement = float(side @ _way(hand, plan, 1))
    if abs(agreement) >= _SAME_SIDE:
        plan.sense = 1 if agreement > 0.0 else -1
        plan.sense_reason = "limits of the finger contradict each other; closes to the side of the other fingers"


def _way(hand: Hand, plan: FingerPlan, sense: int) -> FloatArray:
    """Return the unit direction in which a fingertip moves while its finger closes in a sense, from straight."""
    line = finger_line(hand, plan.finger, hand.open_angles())
    directions = {j: plan.direction(n, sense) for n, j in enumerate(plan.closing)}
    motion = tip_motion(line, np.array([directions.get(j, 0) for j in plan.finger.joints], dtype=np.float64))
    size = float(np.linalg.norm(motion))
    return motion / size if size > 0.0 else motion


def _by_tips(hand: Hand, plans: list[FingerPlan]) -> list[Finding]:
    """Close the fingers that are still undecided to the side where the fingertips meet."""
    open_plans = [p for p in plans if p.sense is None and _leads(hand, p)]
    if not open_plans:
        return []
    if len(plans) == 1:
        _most_uneven(open_plans[0])
        text = f"Finger '{plans[0].finger.name}': closing direction could not be told; set it in a hand file."
        return [_uncertain(hand, open_plans, text, Severity.WARNING)]
    scores = []
    for senses in itertools.product((1, -1), repeat=len(open_plans)):
        scores.append((_tip_spread(hand, plans, dict(zip(map(id, open_plans), senses, strict=True))), senses))
    scores.sort(key=lambda s: s[0])
    for plan, sense in zip(open_plans, scores[0][1], strict=True):
        plan.sense = sense
        limits = "limits of the finger contradict each other" if plan.votes else "limits equally far"
        plan.sense_reason = f"{limits}; closes to the side where the fingertips meet"
    if scores[1][0] - scores[0][0] < _UNDECIDED * scores[0][0]:
        for plan in open_plans:
            _most_uneven(plan)
        text = "Closing directions could hardly be told from limits or fingertips; check them, or set a hand file."
        return [_uncertain(hand, open_plans, text, Severity.WARNING)]
    names = quoted([plan.finger.name for plan in open_plans])
    how = "contradict each other" if any(plan.votes for plan in open_plans) else "are equally far from straight"
    text = f"The limits of {names} {how}; these fingers close to where the fingertips meet."
    return [_uncertain(hand, open_plans, text, Severity.NOTE)]


def _leads(hand: Hand, plan: FingerPlan) -> bool:
    """Return whether a finger has a closing joint of its own choice."""
    followers = {c.follower for c in hand.couplings}
    return any(j not in followers for j in plan.closing)


def _most_uneven(plan: FingerPlan) -> None:
    """Let the most uneven limits of a finger decide, when nothing else does."""
    weight = sum(
        plan.signs[n] * plan.votes[j].direction * plan.votes[j].share
        for n, j in enumerate(plan.closing)
        if j in plan.votes
    )
    if weight != 0.0:
        plan.sense = 1 if weight > 0.0 else -1
        plan.sense_reason = "limits of the finger contradict each other; the most uneven ones decide"
    elif plan.sense is None:
        plan.sense, plan.sense_reason = 1, "limits equally far and no other finger: assumed"


def _uncertain(hand: Hand, plans: list[FingerPlan], text: str, severity: Severity) -> Finding:
    return _advised(hand, [j for plan in plans for j in plan.closing], text, severity)


def _advised(hand: Hand, joints: Sequence[int], text: str, severity: Severity) -> Finding:
    names = tuple(hand.joints[j].name for j in joints)
    return Finding(
        FindingCode.DIRECTION_UNCERTAIN,
        text,
        "Look at the picture (--figure). Where it is wrong, write in the hand file, "
        f"{in_hand_file('joints', names[0], 'direction = 1')} (or -1), and so for each of the others.",
        severity,
        joints=names,
    )


def _tip_spread(hand: Hand, plans: list[FingerPlan], senses: Mapping[int, int]) -> float:
    """Return the mean distance between fingertips [m] when all fingers curl, for given senses.

    Limits that contradict each other carry no information, so limits of undecided fingers do not apply here.
    """
    q = np.array([j.open_value for j in hand.joints])
    for plan in plans:
        sense = plan.sense if plan.sense is not None else senses.get(id(plan), 1)
        for n, j in enumerate(plan.closing):
            joint = hand.joints[j]
            curled = plan.straight[n] + plan.direction(n, sense) * _CURL
            q[j] = curled if plan.sense is None else min(max(curled, joint.lower), joint.upper)
    for c in hand.couplings:
        q[c.follower] = c.ratio * q[c.leader] + c.offset
    tips = [finger_line(hand, p.finger, q).tip for p in plans]
    return float(np.mean([np.linalg.norm(a - b) for a, b in itertools.combinations(tips, 2)]))
