"""Say why a finger does not touch: a code, the links and joints concerned, numbers, and a sentence."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any

from clench.closing.candidates import FingerCandidate, LinkContact
from clench.closing.collision.object_surface import nearest_body
from clench.closing.collision.reach import beside, beyond_reach, graspable_body, nearest_link
from clench.closing.finger_plan import last_closing_joint
from clench.models.hand.hand import Hand, JointRole

from .solution import FingerStatus

if TYPE_CHECKING:
    from clench.core.pose import FloatArray
    from clench.kernels.geometry.bodies import BodyArrays

    from .problem import Problem

#: A follower that could turn further by less than this is at its limit, too [rad].
_AT_LIMIT = 1e-6


class CauseCode(StrEnum):
    """Name why a finger does not touch; docs/solution-format.md lists the numbers that go with each."""

    BLOCKED_AT_START = "blocked_at_start"
    """a link overlaps the object or an obstacle before the finger moves"""
    BLOCKED_ON_THE_WAY = "blocked_on_the_way"
    """on the plane alone, joints about another axis would bring a link into the object"""
    NO_CLOSING_JOINT = "no_closing_joint"
    """the finger has none"""
    NO_MOTION = "no_motion"
    """every closing joint is at its limit before it moves"""
    REACH = "reach"
    """no angle of its closing joints brings the finger to the object"""
    LIMIT = "limit"
    """the joints are at their limits before the finger gets to the object"""
    COUPLING = "coupling"
    """the joint could turn further, but it follows a joint at its limit"""
    SELF_COLLISION = "self_collision"
    """a link meets the palm, a fixed link, or another link of the same finger"""
    SHADOWED = "shadowed"
    """a link meets another finger on the way, or, where only fingertips count, touches before the tip does"""
    OBSTACLE = "obstacle"
    """a link meets an obstacle on the way"""
    CARRIED_OFF = "carried_off"
    """the finger touched on its way, and a later joint carried it off again"""


def finger_cause(c: FingerCandidate, status: FingerStatus, problem: Problem) -> dict[str, Any]:
    """Return why a finger's chosen candidate does not touch the object, as plain values.

    Args:
        c: the candidate. status: how it ended. problem: the solved problem.
    """
    if status is FingerStatus.BLOCKED:
        return _blocked(c, problem)
    if status is FingerStatus.NO_MOTION:
        return _no_motion(c, problem)
    missed = status is FingerStatus.MISSED
    counting = (c.plan.finger.tip_link,) if missed else c.plan.finger.links
    gap, link = nearest_link(problem.hand, c.q, counting, problem.source, *_target(problem))
    near: dict[str, Any] = {"distance": None, "nearest_link": None}
    if link >= 0:
        near = {"distance": gap, "nearest_link": problem.hand.links[link].name}
    if missed:
        return {**_missed(c, c.touches[0], problem), **near}
    stopped = [t for t in c.touches if not t.passed]
    met = _stopped(c, stopped[0], problem) if stopped else {}
    beyond = _out_of_reach(c, problem)
    if beyond or stopped:
        return {**met, **beyond, **near}  # what is out of reach stays so, whatever else the finger meets
    if c.touches:
        return {**_carried_off(c, problem), **near}
    return {**_at_limit(c, link, gap, problem), **near}


def what_is_there(problem: Problem) -> str:
    """Describe the overlapped thing when its body is unknown."""
    return problem.obj.name if len(problem.packed.body_names) == 1 else f"{problem.obj.name} or an obstacle"


def no_closing_joint(finger: str) -> dict[str, Any]:
    """Return the cause of a finger that nothing can close."""
    return {"code": CauseCode.NO_CLOSING_JOINT.value, "text": f"{finger} has no closing joint."}


def _blocked(c: FingerCandidate, problem: Problem) -> dict[str, Any]:
    found, name = c.overlap, c.plan.finger.name
    assert found is not None
    link = problem.hand.links[found.link].name
    place, body, depth = None, what_is_there(problem), ""
    if found.place is not None:
        place = problem.T_world_object.apply(found.place).tolist()
        body = problem.packed.body_names[nearest_body(problem.packed, found.place)]
        depth = f" {found.text}"
    if c.late:
        text = f"On the plane, joints of {name} about another axis would bring {link} into {body}"
        text = f"{text}: close over the full width."
        return {"code": CauseCode.BLOCKED_ON_THE_WAY.value, "text": text, "link": link, "other": body}
    text = f"{link} overlaps {body}{depth} before {name} moves: start farther away, or with the finger more open."
    return {
        "code": CauseCode.BLOCKED_AT_START.value,
        "text": text,
        "link": link,
        "other": body,
        "depth": found.depth,
        "place": place,
    }


def _no_motion(c: FingerCandidate, problem: Problem) -> dict[str, Any]:
    joints = {problem.hand.joints[j].name: float(c.q[j]) for j in c.plan.leaders}
    listed = ", ".join(f"{name} at {angle:.3f} rad" for name, angle in joints.items())
    text = f"{c.plan.finger.name} starts with every closing joint at its limit ({listed}): open it in the preshape."
    return {"code": CauseCode.NO_MOTION.value, "text": text, "joints": joints}


def _stopped(c: FingerCandidate, t: LinkContact, problem: Problem) -> dict[str, Any]:
    hand, name = problem.hand, c.plan.finger.name
    link, joint = hand.links[t.link].name, hand.joints[t.joint].name
    if t.body >= 0:
        code, other, owner, kind = CauseCode.OBSTACLE, problem.packed.body_names[t.body], None, "obstacle "
    else:
        met = -1 - t.body
        other, kind = hand.links[met].name, ""
        owner = next((f.name for f in hand.fingers if met in f.links), None)
        code = CauseCode.SHADOWED if owner not in (None, name) else CauseCode.SELF_COLLISION
        kind = f"{owner}'s " if code is CauseCode.SHADOWED else ""
    angle = float(c.q[t.joint])
    text = f"{link} of {name} meets {kind}{other} at {joint} = {angle:.3f} rad, before the object."
    return {
        "code": code.value,
        "text": text,
        "link": link,
        "other": other,
        "other_finger": owner,
        "joint": joint,
        "angle": angle,
    }


def _missed(c: FingerCandidate, t: LinkContact, problem: Problem) -> dict[str, Any]:
    """Name the obstruction that the link met before the tip: the object, or another body in the way."""
    if not t.graspable:
        return _stopped(c, t, problem)
    hand, tip = problem.hand, problem.hand.links[c.plan.finger.tip_link].name
    link, joint = hand.links[t.link].name, hand.joints[t.joint].name
    return {
        "code": CauseCode.SHADOWED.value,
        "text": f"{link} touches before the tip {tip} does: curl the finger less near the palm, or move the hand back.",
        "link": link,
        "other": problem.packed.body_names[t.body],
        "other_finger": None,
        "joint": joint,
        "angle": float(c.q[t.joint]),
    }


def _carried_off(c: FingerCandidate, problem: Problem) -> dict[str, Any]:
    t = min(c.touches, key=lambda touch: touch.gap)
    link = problem.hand.links[t.link].name
    text = f"{link} touched, and a later joint of {c.plan.finger.name} carried it {t.gap * 1e3:.3g} mm off again."
    return {"code": CauseCode.CARRIED_OFF.value, "text": text, "link": link, "gap": t.gap}


def _at_limit(c: FingerCandidate, link: int, gap: float, problem: Problem) -> dict[str, Any]:
    """Name the joint whose limit keeps the nearest link from the object: the last free one before it."""
    hand, name = problem.hand, c.plan.finger.name
    own = [p.joint for p in c.plan.joints]
    last = last_closing_joint(hand, c.plan.finger, own).get(link, own[-1])
    leader = next((k.leader for k in hand.couplings if k.follower == last), last)
    away = f"{hand.links[link].name} ends {gap * 1e3:.3g} mm from the object" if link >= 0 else f"{name} ends away"
    left = _range_left(hand, last, float(c.q[last]))
    limit = {"joint": hand.joints[leader].name, "angle": float(c.q[leader])}
    at = f"{limit['joint']} is at its limit ({limit['angle']:.3f} rad)"
    # No point of the finger moves farther than this when the follower uses the rest of its range.
    if leader != last and left > _AT_LIMIT and left * c.plan.length >= gap:
        follower = hand.joints[last].name
        text = f"{away}: {follower} could turn {left:.3f} rad further, but follows {limit['joint']}, and {at}."
        return {"code": CauseCode.COUPLING.value, "text": text, "follower": follower, "range_left": left, **limit}
    return {"code": CauseCode.LIMIT.value, "text": f"{away}: {at}.", **limit}


def _range_left(hand: Hand, joint: int, angle: float) -> float:
    j = hand.joints[joint]
    return max(j.upper - angle if j.direction > 0 else angle - j.lower, 0.0)


def _out_of_reach(c: FingerCandidate, problem: Problem) -> dict[str, Any]:
    """Return a cause when no closing angles would do: the object is too far away, or beside the finger."""
    ahead, reach = beyond_reach(problem.hand, c.plan, problem.source, *_target(problem))
    aside = beside(problem.hand, c.plan, problem.source, *_target(problem))
    if max(ahead, aside) <= 0.0:
        return {}
    way, short = ("ahead", ahead) if ahead >= aside else ("aside", aside)
    name, hand = c.plan.finger.name, problem.hand
    what = f"beyond its reach of {reach * 1e3:.0f} mm" if way == "ahead" else "to the side of the planes it closes in"
    turning = [hand.joints[j].name for j in c.plan.finger.joints if hand.joints[j].role is JointRole.POSTURE]
    turn = f"turn its posture joints in the preshape ({', '.join(turning)}), or " if turning and way == "aside" else ""
    return {
        "code": CauseCode.REACH.value,
        "text": f"The object is {short * 1e3:.3g} mm {what}: {name} cannot get there by closing; {turn}move the hand.",
        "shortfall": short,
        "direction": way,
        "reach": reach,
    }


def _target(problem: Problem) -> tuple[BodyArrays, FloatArray]:
    """Return the grasp target without obstacles, and its pose in the palm frame, shape (4, 4)."""
    return graspable_body(problem.obj, problem.packed), problem.T_palm_object
