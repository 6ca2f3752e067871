"""Decide what every joint does: role, closing direction, open value, each with its reason (METHOD.md section 1)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from clench.base.errors import FileError, HandError, UnknownNameError
from clench.base.tolerances import CLOSING_ANGLE

from .findings import Finding, FindingCode, Severity, in_hand_file, quoted
from .finger_geometry import axis_angle, bends, finger_line
from .hand import Finger, Hand, Joint, JointRole
from .hand_file import HandFile, JointOverride

#: A model's zero is taken as straight when the links say so within this [rad].
_ZERO_TRUST = np.deg2rad(25.0)
#: The angle in the model's reference posture is taken as straight when the links say so within this [rad].
_REFERENCE_TRUST = np.deg2rad(10.0)
#: Limits are equally far when their distances differ by less than this share of the range [-].
_EQUALLY_FAR = 0.05
#: How far the fingers are curled to see on which side they meet [rad].
_CURL = np.deg2rad(60.0)
#: Sides whose mean tip distances differ by less than this share cannot be told apart [-].
_UNDECIDED = 0.02


@dataclass
class FingerPlan:
    """Collect what is decided about one finger.

    Args:
        finger: which. closing: joint indices, palm side first. signs: of each closing axis against the most
            distal one. straight: angle of each closing joint at which the finger is straight [rad].
        sense: +1 or -1 about the most distal axis, None while undecided.
    """

    finger: Finger
    closing: list[int] = field(default_factory=list)
    signs: list[int] = field(default_factory=list)
    straight: list[float] = field(default_factory=list)
    straight_reason: list[str] = field(default_factory=list)
    votes: dict[int, tuple[int, float, str]] = field(default_factory=dict)
    sense: int | None = None
    sense_reason: str = ""


def assign_roles(hand: Hand, overrides: HandFile, held: Mapping[int, float]) -> Hand:
    """Return the hand with role, direction and open value of every joint.

    Args:
        hand: with links, joints, couplings and fingers. overrides: the hand file.
        held: joints that the model holds at an angle [rad].

    Raises:
        UnknownNameError: the hand file names an unknown joint. FileError: a value that does not fit.
        HandError: no finger has a closing joint.
    """
    for name in overrides.joints:
        if name not in hand.joint_names:
            raise UnknownNameError("joint", name, f"hand '{hand.name}' (named by {overrides.path})", hand.joint_names)
    joints = _default_joints(hand, held)
    hand = replace(hand, joints=tuple(joints))
    plans = [_plan(hand, finger, overrides, joints) for finger in hand.fingers]
    if not any(p.closing for p in plans):
        raise HandError(f"{hand.name}: has no closing joint: all joints of its fingers are posture joints.")
    findings = [*hand.findings, *_decide_senses(replace(hand, joints=tuple(joints)), plans)]
    for plan in plans:
        _apply(plan, joints, findings)
    _override(hand, joints, overrides)
    _follow(hand, joints, overrides, findings)
    return replace(hand, joints=tuple(joints), findings=tuple(findings))


def nearest_inside(value: float, joint: Joint) -> float:
    """Return the angle inside a joint's limits nearest to a value [rad]."""
    return min(max(value, joint.lower), joint.upper)


def _default_joints(hand: Hand, held: Mapping[int, float]) -> list[Joint]:
    """Return all joints as posture or upstream joints at the model's zero."""
    own = {j for f in hand.fingers for j in f.joints}
    below = _below_palm(hand)
    joints = []
    for i, joint in enumerate(hand.joints):
        if i in held:
            joint = replace(joint, lower=held[i], upper=held[i])
        role, reason = JointRole.POSTURE, "its axis is turned against the finger's most distal joint"
        if i in held:
            reason = "the model holds it at one angle"
        elif i not in below:
            role, reason = JointRole.UPSTREAM, "lies between the model's root and the palm"
        elif i not in own:
            reason = "several fingers share it"
        zero = nearest_inside(0.0, joint)
        text = "the model's zero" if zero == 0.0 else "the limit nearest to the model's zero"
        joints.append(replace(joint, role=role, role_reason=reason, open_value=zero, open_reason=text))
    return joints


def _below_palm(hand: Hand) -> set[int]:
    below: set[int] = set()
    inside = {hand.palm}
    for i, link in enumerate(hand.links):
        if link.parent in inside:
            inside.add(i)
            if link.joint >= 0:
                below.add(link.joint)
    return below


def _plan(hand: Hand, finger: Finger, overrides: HandFile, joints: list[Joint]) -> FingerPlan:
    """Find a finger's closing joints, where it is straight, and what the limits say about its sense."""
    plan = FingerPlan(finger)
    line = finger_line(hand, finger, np.array([j.reference for j in hand.joints]))
    mobile = [k for k, j in enumerate(finger.joints) if hand.joints[j].upper - hand.joints[j].lower > 1e-9]
    for k, j in enumerate(finger.joints):
        if k not in mobile and hand.joints[j].role is JointRole.POSTURE:
            joints[j] = replace(joints[j], role_reason=f"its limits leave no motion ({joints[j].role_reason})")
    if not mobile:
        return plan
    axis = line.axes[mobile[-1]]
    places = []
    for k in mobile:
        j = finger.joints[k]
        angle = axis_angle(line.axes[k], axis)
        override = overrides.joints.get(hand.joints[j].name, JointOverride())
        closing = angle <= CLOSING_ANGLE if override.role is None else override.role is JointRole.CLOSING
        reason = _role_reason(angle, k == mobile[-1], override.role)
        joints[j] = replace(joints[j], role=JointRole.CLOSING if closing else JointRole.POSTURE, role_reason=reason)
        if closing:
            places.append(k)
            plan.closing.append(j)
            plan.signs.append(1 if line.axes[k] @ axis >= 0.0 else -1)
    bent = bends(line, places, axis) if places else []
    for n, j in enumerate(plan.closing):
        straight, reason = _straight(hand.joints[j], plan.signs[n], bent[n], first=n == 0)
        plan.straight.append(straight)
        plan.straight_reason.append(reason)
        _vote(plan, n, hand.joints[j], overrides.joints.get(hand.joints[j].name, JointOverride()))
    return plan


def _role_reason(angle: float, most_distal: bool, given: JointRole | None) -> str:
    if given is not None:
        return "hand file"
    if most_distal:
        return "the finger's most distal joint"
    degrees = np.rad2deg(angle)
    return f"its axis is {degrees:.1f} deg from that of the finger's most distal joint"


def _straight(joint: Joint, sign: int, bend: float | None, *, first: bool) -> tuple[float, str]:
    """Return the angle at which a finger is straight at a joint [rad], and how that is known.

    What precedes the first closing joint may be a metacarpal or a bracket of any shape: alone it decides nothing.
    """
    if bend is None:
        return 0.0, "the model's zero (nothing in the finger tells)"
    stretched = joint.reference - sign * bend
    degrees = np.rad2deg(stretched)
    if abs(stretched) <= _ZERO_TRUST:
        return 0.0, f"the model's zero (links in line at {degrees:.0f} deg)"
    if abs(stretched - joint.reference) <= _REFERENCE_TRUST:
        return joint.reference, f"the model's reference posture (links in line at {degrees:.0f} deg)"
    if first:
        return 0.0, f"the model's zero (what precedes it would be in line at {degrees:.0f} deg)"
    return stretched, f"links in line at {degrees:.0f} deg"


def _vote(plan: FingerPlan, n: int, joint: Joint, override: JointOverride) -> None:
    """Record which way a joint says that its finger closes, from its limits or the hand file."""
    j = plan.closing[n]
    if override.direction is not None:
        plan.votes[j] = (override.direction, np.inf, "hand file")
        return
    up, down = joint.upper - plan.straight[n], plan.straight[n] - joint.lower
    if abs(up - down) <= _EQUALLY_FAR * (joint.upper - joint.lower):
        return
    far = "upper" if up > down else "lower"
    angles = f"{np.rad2deg(max(up, down)):.0f} deg against {np.rad2deg(min(up, down)):.0f}"
    plan.votes[j] = (1 if up > down else -1, abs(up - down), f"the {far} limit is farther from straight ({angles})")


def _decide_senses(hand: Hand, plans: list[FingerPlan]) -> list[Finding]:
    """Give every finger its sense: from its joints' limits, else the side on which the fingertips meet."""
    for plan in plans:
        weight = sum(
            plan.signs[n] * plan.votes[j][0] * min(plan.votes[j][1], 1e3)
            for n, j in enumerate(plan.closing)
            if j in plan.votes
        )
        if weight != 0.0:
            plan.sense = 1 if weight > 0.0 else -1
            plan.sense_reason = "limits equally far; closes like the other joints of the finger"
    open_plans = [p for p in plans if p.sense is None and p.closing]
    if not open_plans:
        return []
    if len(plans) == 1:
        open_plans[0].sense, open_plans[0].sense_reason = 1, "limits equally far and no other finger: assumed"
        text = f"Finger '{plans[0].finger.name}': closing direction could not be told; set it in a hand file."
        return [_uncertain(hand, open_plans, text, Severity.WARNING)]
    scores = []
    for senses in itertools.product((1, -1), repeat=len(open_plans)):
        scores.append((_tip_spread(hand, plans, dict(zip(map(id, open_plans), senses, strict=True))), senses))
    scores.sort(key=lambda s: s[0])
    for plan, sense in zip(open_plans, scores[0][1], strict=True):
        plan.sense = sense
        plan.sense_reason = "limits equally far; closes to the side where the fingertips meet"
    if scores[1][0] - scores[0][0] < _UNDECIDED * scores[0][0]:
        text = "Closing directions could hardly be told from limits or fingertips; check them, or set a hand file."
        return [_uncertain(hand, open_plans, text, Severity.WARNING)]
    names = quoted([plan.finger.name for plan in open_plans])
    text = f"The limits of {names} are equally far from straight; these fingers close to where the fingertips meet."
    return [_uncertain(hand, open_plans, text, Severity.NOTE)]


def _uncertain(hand: Hand, plans: list[FingerPlan], text: str, severity: Severity) -> Finding:
    names = tuple(hand.joints[j].name for plan in plans for j in plan.closing)
    return Finding(
        FindingCode.DIRECTION_UNCERTAIN,
        text,
        "Look at the picture (--figure). Where it is wrong, write in the hand file, "
        f"{in_hand_file('joints', names[0], 'direction = 1')} (or -1), and so for each of the others.",
        severity,
        joints=names,
    )


def _tip_spread(hand: Hand, plans: list[FingerPlan], senses: Mapping[int, int]) -> float:
    """Return the mean distance between fingertips [m] when all fingers curl, for given senses."""
    q = np.array([j.open_value for j in hand.joints])
    for plan in plans:
        sense = plan.sense if plan.sense is not None else senses.get(id(plan), 1)
        for n, j in enumerate(plan.closing):
            way = plan.votes[j][0] if j in plan.votes else sense * plan.signs[n]
            q[j] = nearest_inside(plan.straight[n] + way * _CURL, hand.joints[j])
    tips = [finger_line(hand, p.finger, q).tip for p in plans]
    return float(np.mean([np.linalg.norm(a - b) for a, b in itertools.combinations(tips, 2)]))


def _apply(plan: FingerPlan, joints: list[Joint], findings: list[Finding]) -> None:
    """Write a plan into the joints."""
    turns = set()
    for n, j in enumerate(plan.closing):
        direction, reason = (plan.sense or 1) * plan.signs[n], plan.sense_reason
        if j in plan.votes:
            direction, reason = plan.votes[j][0], plan.votes[j][2]
        turns.add(direction * plan.signs[n])
        value = nearest_inside(plan.straight[n], joints[j])
        where = plan.straight_reason[n]
        joints[j] = replace(
            joints[j],
            direction=direction,
            direction_reason=reason,
            open_value=value,
            open_reason=f"straight: {where}" if value == plan.straight[n] else f"limit nearest to straight: {where}",
        )
    if len(turns) > 1:
        names = tuple(joints[j].name for j in plan.closing)
        text = f"Joints {quoted(names)} of one finger close in opposite senses; check the limits."
        line = in_hand_file("joints", names[-1], "direction = 1")
        advice = f"Correct the limits, or write in the hand file, {line} (or -1)."
        findings.append(Finding(FindingCode.DIRECTIONS_OPPOSED, text, advice, joints=names))


def _follow(hand: Hand, joints: list[Joint], overrides: HandFile, findings: list[Finding]) -> None:
    """Let followers share role and direction of their leaders, and their open values agree with them."""
    for c in hand.couplings:
        leader, follower = joints[c.leader], joints[c.follower]
        if follower.role is not leader.role and JointRole.UPSTREAM not in (leader.role, follower.role):
            if leader.role is JointRole.CLOSING:
                text = (
                    f"Joint '{follower.name}' follows closing joint '{leader.name}' though its axis is not parallel to "
                    "that of the finger's most distal joint."
                )
                line = in_hand_file("joints", follower.name, 'follows = ""')
                advice = f"If it should not, write in the hand file, {line}."
                names = (follower.name, leader.name)
                findings.append(Finding(FindingCode.FOLLOWER_NOT_PARALLEL, text, advice, joints=names))
            follower = replace(follower, role=leader.role, role_reason=f"follows {leader.role} joint '{leader.name}'")
        direction = leader.direction * (1 if c.ratio > 0 else -1)
        if follower.role is JointRole.CLOSING:
            if direction != follower.direction and follower.name in overrides.joints:
                text = f"Joint '{follower.name}' follows '{leader.name}'; its direction comes from there."
                advice = f'Give the direction of "{leader.name}" in the hand file.'
                names = (follower.name, leader.name)
                findings.append(Finding(FindingCode.DIRECTION_IGNORED, text, advice, joints=names))
            follower = replace(follower, direction=direction, direction_reason=f"follows '{leader.name}' ({c.reason})")
        value = nearest_inside(c.ratio * leader.open_value + c.offset, follower)
        joints[c.follower] = replace(follower, open_value=value, open_reason=f"follows '{leader.name}'")


def _override(hand: Hand, joints: list[Joint], overrides: HandFile) -> None:
    """Write the open values of the hand file, each checked against the limits."""
    for name, override in overrides.joints.items():
        if override.open_value is None:
            continue
        i = hand.joint_index(name)
        joint = joints[i]
        leader = next((hand.joints[c.leader].name for c in hand.couplings if c.follower == i), None)
        if leader is not None:
            raise FileError(overrides.path, f"joints.{name}.open: it follows '{leader}'; give the open value of that.")
        if not joint.lower <= override.open_value <= joint.upper:
            raise FileError(
                overrides.path,
                f"joints.{name}.open: expected an angle inside [{joint.lower:.6g}, {joint.upper:.6g}] rad, "
                f"got {override.open_value:.6g}.",
            )
        joints[i] = replace(joint, open_value=override.open_value, open_reason="hand file")
