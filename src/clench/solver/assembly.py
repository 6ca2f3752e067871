"""Assemble the solution: the computed candidates, the choice and the judgement, in names and world coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.closing.candidates import FingerCandidate, LinkContact
from clench.closing.collision.depths import LinkDepth, retreat_distance
from clench.closing.collision.object_surface import nearest_body
from clench.closing.collision.packed_object import hash_hand
from clench.closing.collision.sizes import far_away
from clench.closing.motion import asked_fingers, decompose
from clench.core.caching.deferring import DeferredMapping
from clench.core.pose import FloatArray, Pose
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.recent_scenes import remember_scene

from .causes import finger_cause, no_closing_joint, what_is_there
from .certificate import Certificate
from .solution import (
    Candidate,
    Contact,
    ContactKind,
    FingerResult,
    FingerStatus,
    GraspSolution,
    SolutionStatus,
)

if TYPE_CHECKING:
    from .problem import Problem

_KINDS = (
    ContactKind.SIDE,
    ContactKind.TIP,
    ContactKind.EDGE,
    ContactKind.VERTEX,
    ContactKind.EDGE,
    ContactKind.FACE,
)
_Places = dict[int, tuple[FloatArray, FloatArray]]
#: Contacts of thumb and finger oppose each other when their normals do: the cosine is below this [-]. Normals of faces
#: at right angles do not oppose each other, however their product is rounded.
_OPPOSED = -1e-9


@dataclass(frozen=True, eq=False)
class Answer:
    """Everything computed and chosen that a solution is built from.

    Args:
        candidates: returns the candidates of a finger that closes, by number, as closed without the other fingers.
        chosen: index of the chosen one of each. best: the chosen ones. final: posture of the hand, shape (J,) [rad].
        at_start: depths of the links that no finger moves, before closing. at_end: of all links, at the end; None when
            not measured. certificate: the guarantee. choice: why these candidates, see `explain_choice`.
    """

    candidates: Callable[[int], Sequence[FingerCandidate]]
    chosen: Sequence[int]
    best: Sequence[FingerCandidate]
    final: FloatArray
    at_start: Sequence[LinkDepth]
    at_end: Sequence[LinkDepth] | None
    certificate: Certificate
    choice: Mapping[str, Any]


def assemble(answer: Answer, problem: Problem, timing: Mapping[str, float]) -> GraspSolution:
    """Return the solution in names and world coordinates."""
    from clench import __version__

    hand, command, packed = problem.hand, problem.command, problem.packed
    placed = _placed(answer.best, problem.T_world_palm)
    made = [_finger(answer, k, problem, placed) for k in range(len(answer.best))]
    results = {result.name: result for _, result in made}
    for finger in asked_fingers(hand, command):
        if finger.name not in results:
            text = f"{finger.name} has no closing joint."
            cause = no_closing_joint(finger.name)
            results[finger.name] = FingerResult(finger.name, FingerStatus.NO_MOTION, text, 0, (), cause)
    status, reason = _status(answer, results, problem)
    names = hand.joint_names
    geometry_hash = f"{hash_hand(hand, problem.source)}+{packed.geometry_hash}"
    remember_scene(geometry_hash, hand, problem.obj)
    return GraspSolution(
        clench_version=__version__,
        hand=hand.name,
        object=problem.obj.name,
        hand_model=str(hand.path) if hand.path else hand.name,
        object_model=str(problem.obj.path) if problem.obj.path else problem.obj.name,
        object_scale=problem.obj.scale,
        obstacles=problem.obj.obstacles,
        geometry_hash=geometry_hash,
        seed=command.seed,
        status=status,
        reason=reason,
        hand_pose=problem.T_world_palm,
        object_pose=problem.T_world_object,
        decomposition=decompose(hand, answer.final),
        joint_angles=dict(zip(names, answer.final.tolist(), strict=True)),
        open_angles=dict(zip(names, _opened(answer, problem).tolist(), strict=True)),
        certified=answer.certificate.holds,
        certificate=answer.certificate.to_dict(),
        collision_source=str(problem.source),
        object_collision_source=str(problem.obj.collision_source),
        max_penetration=None if answer.at_end is None else max((d.depth for d in answer.at_end), default=0.0),
        fingers=results,
        contacts=tuple(contact for best, _ in made for contact in best.contacts),
        choice=answer.choice,
        timing=dict(timing),
        speeds=dict(command.speeds),
        rounds=command.rounds,
        next_steps=plain_steps(command),
        joint_limits=joint_limits(hand),
    )


def joint_limits(hand: Hand) -> dict[str, tuple[float, float]]:
    """Return lower and upper limit of every joint [rad], by name."""
    return {joint.name: (joint.lower, joint.upper) for joint in hand.joints}


def plain_steps(command: GraspCommand) -> tuple[dict[str, float], ...]:
    """Return the postures that the hand goes to after the grasp, as plain numbers."""
    return tuple({name: float(angle) for name, angle in step.items()} for step in command.next_steps)


def _opened(answer: Answer, problem: Problem) -> FloatArray:
    """Return the posture from which the chosen candidates close, shape (J,) [rad]."""
    q = problem.start.copy()
    for c in answer.best:
        own = c.plan.finger.own
        q[own] = c.plan.posture[own]
    return q


def _placed(candidates: Sequence[FingerCandidate], T_world_palm: Pose) -> _Places:
    """Return position and normal of every touch of some candidates in the world, by the touch's identity."""
    touches = [t for c in candidates for t in c.touches]
    # A single row would be rounded differently from many rows.
    rows = touches * 2 if len(touches) == 1 else touches
    positions = T_world_palm.apply(np.array([t.position for t in rows]).reshape(-1, 3))
    normals = np.array([t.normal for t in rows]).reshape(-1, 3) @ T_world_palm.rotation.T
    return {id(t): (p, n) for t, p, n in zip(rows, positions, normals, strict=True)}


def _finger(answer: Answer, k: int, problem: Problem, placed: _Places) -> tuple[Candidate, FingerResult]:
    """Return the chosen candidate of a finger, and its result, whose other candidates are made when they are read."""
    c, chosen = answer.best[k], answer.chosen[k]
    best = _candidate(c, problem, placed)

    def candidates() -> tuple[Candidate, ...]:
        group = answer.candidates(k)
        places = _placed(group, problem.T_world_palm)
        return tuple(best if i == chosen else _candidate(other, problem, places) for i, other in enumerate(group))

    cause = None
    if best.status is not FingerStatus.TOUCH:
        cause = DeferredMapping(partial(finger_cause, c, best.status, problem))
    return best, FingerResult.deferred(c.plan.finger.name, best, chosen, candidates, cause)


def _candidate(c: FingerCandidate, problem: Problem, placed: _Places) -> Candidate:
    joints = problem.hand.joint_names
    status, reason = _finger_status(c, problem)
    return Candidate(
        plane=c.plane,
        offset=c.offset,
        order=str(problem.command.order),
        posture=c.posture,
        joint_angles={joints[j]: float(c.q[j]) for j in c.plan.finger.joints},
        status=status,
        reason=reason,
        feasible=c.feasible,
        penetration=c.penetration,
        scores=dict(c.scores),
        contacts=tuple(_contact(c, t, problem, placed) for t in c.touches if t.body >= 0),
    )


def _contact(c: FingerCandidate, t: LinkContact, problem: Problem, placed: _Places) -> Contact:
    position, normal = placed[id(t)]
    return Contact(
        finger=c.plan.finger.name,
        link=problem.hand.links[t.link].name,
        body=problem.packed.body_names[t.body],
        stops_joint=problem.hand.joints[t.joint].name,
        plane=t.plane,
        offset=t.offset,
        kind=_KINDS[t.kind],
        passed=t.passed,
        position=position,
        normal=normal,
        gap=t.gap,
        curve_angle=t.curve_angle,
        link_angle=t.link_angle,
    )


def _body_name(t: LinkContact, problem: Problem) -> str:
    """Return the name of a touched body, or of a touched link of the hand itself."""
    return problem.packed.body_names[t.body] if t.body >= 0 else problem.hand.links[-1 - t.body].name


def _finger_status(c: FingerCandidate, problem: Problem) -> tuple[FingerStatus, str]:
    hand, name = problem.hand, c.plan.finger.name
    if c.overlap is not None:
        when = "on this plane, where joints about another axis would bring it" if c.late else f"before {name} moves"
        return FingerStatus.BLOCKED, f"{_overlap_text(c.overlap, problem)} {when}."
    if problem.command.order.is_of_tips and c.missed:
        first, tip = hand.links[c.touches[0].link].name, hand.links[c.plan.finger.tip_link].name
        return FingerStatus.MISSED, f"{first} touches {_body_name(c.touches[0], problem)} before the tip {tip} does."
    if c.holding:
        links = list(dict.fromkeys(hand.links[t.link].name for t in c.holding))
        return FingerStatus.TOUCH, f"{', '.join(links)} touches {_body_name(c.holding[0], problem)}."
    if max(c.plan.lengths, default=0.0) <= 0.0:
        return FingerStatus.NO_MOTION, f"Every closing joint of {name} is at its limit before it moves."
    stopped = [t for t in c.touches if not t.passed]
    if stopped:
        what = "the hand's own" if stopped[0].body < 0 else "the obstacle"
        body = _body_name(stopped[0], problem)
        return FingerStatus.LIMIT, f"{name} is stopped by {what} {body} and does not reach the object."
    if c.touches:
        return FingerStatus.LIMIT, f"{name} touched on its way and was carried off again by a later joint."
    angles = ", ".join(f"{hand.joints[j].name} {c.q[j]:.3f}" for j in c.plan.leaders)
    return FingerStatus.LIMIT, f"{name} closes to its limits without touching ({angles} rad)."


def _status(
    answer: Answer, results: Mapping[str, FingerResult], problem: Problem
) -> tuple[SolutionStatus, Mapping[str, Any]]:
    """Return the status and its reason, which is made when it is first read."""
    deepest = max(answer.at_start, key=lambda d: d.depth, default=None)
    if deepest is not None and deepest.depth > ALLOWED_PENETRATION:
        return SolutionStatus.BLOCKED, DeferredMapping(partial(_overlap_reason, deepest, problem))
    stuck = [c.overlap for c in answer.best if c.overlap is not None and not c.late]
    if len(stuck) == len(results):
        worst = max(stuck, key=lambda d: d.depth)
        return SolutionStatus.BLOCKED, DeferredMapping(partial(_overlap_reason, worst, problem))
    touching = [r.name for r in results.values() if r.status is FingerStatus.TOUCH]
    if not touching:
        text = "No finger touches: " + " ".join(r.reason for r in results.values())
        return SolutionStatus.NO_CONTACT, _with_causes("no_contact", _far_text(problem) + text, results)
    listed = ", ".join(touching)
    if len(touching) == len(results):
        return SolutionStatus.GRASP, {"code": "all_touch", "text": f"Every finger touches: {listed}."}
    pair = _opposition(answer)
    if pair:
        text = f"{pair[0]} and {pair[1]} oppose each other; touching: {listed}."
        return SolutionStatus.GRASP, _with_causes("opposed", text, results)
    text = f"Only some fingers touch: {listed}."
    return SolutionStatus.PARTIAL, _with_causes("some_touch", text, results)


def _far_text(problem: Problem) -> str:
    """Return a question where the hand is so far from the object that lengths are probably in millimetres."""
    away = float(far_away(problem.hand, problem.packed, problem.T_palm_object[None])[0])
    if not away:
        return ""
    return f"The hand is {away:.3g} m away from {problem.obj.name}: are the lengths of its pose in millimetres? "


def _with_causes(code: str, text: str, results: Mapping[str, FingerResult]) -> Mapping[str, Any]:
    return DeferredMapping(lambda: {"code": code, "text": text, **_causes(results)})


def _causes(results: Mapping[str, FingerResult]) -> dict[str, Any]:
    """Return why fingers do not touch, by name; and which of them ends nearest to the object, and how far."""
    causes = {name: r.cause for name, r in results.items() if r.cause is not None}
    found: dict[str, Any] = {"fingers": {name: cause["code"] for name, cause in causes.items()}}
    away = {name: cause["distance"] for name, cause in causes.items() if cause.get("distance") is not None}
    if away:
        nearest = min(away, key=lambda name: away[name])
        link = causes[nearest]["nearest_link"]
        found["nearest"] = {"finger": nearest, "link": link, "distance": away[nearest]}
    return found


def _overlap_reason(found: LinkDepth, problem: Problem) -> dict[str, Any]:
    retreat = _retreat(problem)
    place = None if found.place is None else problem.T_world_object.apply(found.place).tolist()
    text = (
        f"{_overlap_text(found, problem)} before anything moves; moving the hand back along its palm normal "
        f"by {retreat * 1e3:.2f} mm frees it."
    )
    link = problem.hand.links[found.link].name
    return {"code": "overlap", "text": text, "link": link, "depth": found.depth, "place": place, "retreat": retreat}


def _overlap_text(found: LinkDepth, problem: Problem) -> str:
    link = problem.hand.links[found.link].name
    if found.place is None:
        return f"{link} overlaps {what_is_there(problem)}"
    x, y, z = problem.T_world_object.apply(found.place)
    body = problem.packed.body_names[nearest_body(problem.packed, found.place)]
    return f"{link} overlaps {body} {found.text} at [{x:.4f}, {y:.4f}, {z:.4f}] m"


def _retreat(problem: Problem) -> float:
    return retreat_distance(problem.hand, problem.start, problem.packed, problem.T_palm_object, problem.source)


def _opposition(answer: Answer) -> tuple[str, str] | None:
    """Return a thumb and a finger whose contact normals oppose each other most, or None."""
    best, pair = _OPPOSED, None
    thumbs = [c for c in answer.best if c.plan.finger.is_thumb]
    others = [c for c in answer.best if not c.plan.finger.is_thumb]
    for thumb in thumbs:
        for finger in others:
            for a in thumb.holding:
                for b in finger.holding:
                    cosine = float(np.dot(a.normal, b.normal))
                    if cosine < best:
                        best, pair = cosine, (thumb.plan.finger.name, finger.plan.finger.name)
    return pair
