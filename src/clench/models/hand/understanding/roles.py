"""Decide the role, closing direction and open value of every joint, with reasons (docs/method.md section 1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from clench.core.exceptions import FileError, HandError, UnknownNameError
from clench.core.showing.visible_text import visible
from clench.core.tolerances import CLOSING_ANGLE
from clench.models.hand.findings import Finding, FindingCode, in_hand_file, quoted
from clench.models.hand.hand import Finger, Hand, Joint, JointRole
from clench.models.hand.hand_file import HandFile, JointOverride

from .closing_sense import FingerPlan, contradicting, decide_senses, note_limits
from .finger_geometry import axis_angle, bends, finger_line

#: A model's zero is taken as straight when the links say so within this [rad].
_ZERO_TRUST = np.deg2rad(25.0)
#: The angle in the model's reference posture is taken as straight when the links say so within this [rad].
_REFERENCE_TRUST = np.deg2rad(10.0)


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
    findings = [*hand.findings, *decide_senses(replace(hand, joints=tuple(joints)), plans)]
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
    """Find a finger's closing joints, its straight posture, and the sense that its limits suggest."""
    plan = FingerPlan(finger)
    followers = {c.follower for c in hand.couplings}
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
        if closing and override.role is None and finger.is_thumb:
            turner, away = _turned_away(hand, finger, k, mobile)
            closing = away <= CLOSING_ANGLE
            reason = reason if closing else _base_reason(hand.joints[turner].name, away)
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
        if j not in followers:
            note_limits(plan, n, hand.joints[j], overrides.joints.get(hand.joints[j].name, JointOverride()))
    return plan


def _turned_away(hand: Hand, finger: Finger, place: int, mobile: list[int]) -> tuple[int, float]:
    """Return which later joint turns a joint farthest from the last one's axis, and how far that is [rad].

    An axis that is parallel to the closing ones in one posture alone does not close: turned away, it swings the thumb.
    """
    start = np.array([j.reference for j in hand.joints])
    worst = (finger.joints[mobile[-1]], 0.0)
    line = finger_line(hand, finger, start)
    swings = [k for k in mobile if place < k and axis_angle(line.axes[k], line.axes[mobile[-1]]) > CLOSING_ANGLE]
    for between in (finger.joints[k] for k in swings):
        for limit in (hand.joints[between].lower, hand.joints[between].upper):
            q = start.copy()
            q[between] = limit
            axes = finger_line(hand, finger, q).axes
            worst = max(worst, (between, axis_angle(axes[place], axes[mobile[-1]])), key=lambda found: found[1])
    return worst


def _base_reason(turner: str, away: float) -> str:
    degrees = np.rad2deg(away)
    return (
        "the base of a thumb, parallel to its most distal joint only at the model's zero: "
        f"'{turner}' turns it {degrees:.0f} deg away"
    )


def _role_reason(angle: float, most_distal: bool, given: JointRole | None) -> str:
    if given is not None:
        return "hand file"
    if most_distal:
        return "the finger's most distal joint"
    degrees = np.rad2deg(angle)
    return f"its axis is {degrees:.1f} deg from that of the finger's most distal joint"


def _straight(joint: Joint, sign: int, bend: float | None, *, first: bool) -> tuple[float, str]:
    """Return the angle at which a finger is straight at a joint [rad], and how that is known.

    A piece before the first closing joint may be a metacarpal or a bracket of any shape: alone it decides nothing.
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


def _apply(plan: FingerPlan, joints: list[Joint], findings: list[Finding]) -> None:
    """Write a plan into the joints."""
    against = contradicting(plan)
    for n, j in enumerate(plan.closing):
        direction, reason = plan.direction(n, plan.sense or 1), plan.sense_reason
        if j in plan.given:
            reason = "hand file"
        elif j in against:
            reason = f"like the other joints of the finger, though {plan.votes[j].reason}"
        elif j in plan.votes and not plan.shut_when_straight:
            reason = plan.votes[j].reason
        value, where = _open_value(plan, n, joints[j], direction)
        joints[j] = replace(
            joints[j], direction=direction, direction_reason=reason, open_value=value, open_reason=where
        )
    if against:
        findings.append(_contradiction(joints, against))


def _open_value(plan: FingerPlan, n: int, joint: Joint, direction: int) -> tuple[float, str]:
    """Return the angle of an open finger at a joint [rad], and why."""
    if plan.shut_when_straight and plan.closing[n] in plan.votes:
        value = joint.lower if direction > 0 else joint.upper
        return value, "the limit away from straight, where the finger is closed"
    value, where = nearest_inside(plan.straight[n], joint), plan.straight_reason[n]
    if value == plan.straight[n]:
        return value, f"straight: {where}"
    return value, f"limit nearest to straight: {where}"


def _contradiction(joints: list[Joint], against: list[int]) -> Finding:
    names = tuple(joints[j].name for j in against)
    left = [(joints[j].upper if joints[j].direction > 0 else joints[j].lower) - joints[j].open_value for j in against]
    degrees = ", ".join(f"{abs(np.rad2deg(angle)):.0f} deg" for angle in left)
    text = (
        f"The limits of {quoted(names)} contradict those of the other joints of the finger about the way it closes. "
        f"All joints of a finger close one way, which leaves {degrees} here."
    )
    line = in_hand_file("joints", names[-1], f"direction = {-joints[against[-1]].direction}")
    advice = f"Correct the limits or the axis. If the finger is built like this, write in the hand file, {line}."
    return Finding(FindingCode.DIRECTIONS_OPPOSED, text, advice, joints=names)


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
                advice = f'Give the direction of "{visible(leader.name)}" in the hand file.'
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
