"""The criteria of one finger's candidate (docs/method.md section 6)."""

from __future__ import annotations

from typing import ClassVar, Final

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.closing.collision.reach import nearest_link, obstacle_body
from clench.closing.finger_plan import FingerPlan
from clench.core.pose import Pose
from clench.models.hand.hand import DEFAULT_SPEED, Hand
from clench.models.objects.grasp_object import BodyRole

from .closing_stages import closing_stages
from .criterion_types import ScoringContext, own_angles
from .pose_change import PoseChange

#: More clearance than this is no better [m].
MOST_CLEARANCE: Final = 0.05


class RangeOfMotion:
    """Sum |Δq| from the start over the finger's own joints, weighted per joint: least motion is best."""

    name: ClassVar[str] = "range_of_motion"
    unit: ClassVar[str] = "rad"
    source: ClassVar[str] = "US 9,067,319 B2: least range of motion"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float:
        """Return Σ |Δq| [rad]."""
        moved = np.abs(own_angles(candidate, candidate.q - context.start))
        if context.joint_weights is not None:
            moved = moved * own_angles(candidate, context.joint_weights)
        return float(moved.sum())


class TouchingLinks:
    """Count the links that touch the object at the end: more links share the load."""

    name: ClassVar[str] = "touching_links"
    unit: ClassVar[str] = "links"
    source: ClassVar[str] = "docs/method.md section 6"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = True

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float:
        """Return the number of touching links."""
        return float(len({t.link for t in candidate.holding}))


class LimitDistance:
    """Measure the distance of the nearest closing joint from its limits, as a fraction of its range."""

    name: ClassVar[str] = "limit_distance"
    unit: ClassVar[str] = "fraction of the range"
    source: ClassVar[str] = "docs/method.md section 6"
    scale: ClassVar[float] = 0.5
    larger_is_better: ClassVar[bool] = True

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float:
        """Return the least distance to a limit in the closing direction, 0 to 1."""
        q = candidate.q
        return min([1.0, *(abs(end - q.item(j)) / span for j, end, span in _ranges(context.hand, candidate.plan))])


def _ranges(hand: Hand, plan: FingerPlan) -> list[tuple[int, float, float]]:
    """Return each closing joint that has a range, the limit in its closing direction [rad], and the range [rad]."""
    joints = [(p.joint, hand.joints[p.joint]) for p in plan.joints]
    ends = [(j, joint.upper if joint.direction > 0 else joint.lower, joint.upper - joint.lower) for j, joint in joints]
    return [(j, float(end), float(span)) for j, end, span in ends if span > 0.0]


class NextStepTime:
    """Time of the finger's slowest joint from the candidate to the next steps of the work, at its velocity limit."""

    name: ClassVar[str] = "next_step_time"
    unit: ClassVar[str] = "s"
    source: ClassVar[str] = "US 9,067,319 B2: most efficient motion towards the next step of the work"
    scale: ClassVar[float] = 0.5
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return Σ over the steps of max |Δq| / velocity [s]; None without next steps."""
        joints = candidate.plan.finger.joints
        speeds = np.array([context.hand.joints[j].velocity or DEFAULT_SPEED for j in joints])
        moves = _moves(candidate, context)
        return None if moves is None else float((moves / speeds).max(axis=1, initial=0.0).sum())


class NextStepDistance:
    """Motion from the candidate to the next steps of the work, over the finger's own joints."""

    name: ClassVar[str] = "next_step_distance"
    unit: ClassVar[str] = "rad"
    source: ClassVar[str] = "US 9,067,319 B2: most efficient motion towards the next step of the work"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return Σ |Δq| over steps and joints [rad]; None without next steps."""
        moves = _moves(candidate, context)
        return None if moves is None else float(moves.sum())


def _moves(candidate: FingerCandidate, context: ScoringContext) -> np.ndarray | None:
    """Return |Δq| of the finger's joints in every step, shape (S, joints) [rad]; joints not named stay."""
    if not context.steps:
        return None
    at = own_angles(candidate, candidate.q)
    moves = []
    for step in context.steps:
        named = own_angles(candidate, step)
        then = np.where(np.isnan(named), at, named)
        moves.append(np.abs(then - at))
        at = then
    return np.array(moves)


class Clearance:
    """Smallest gap between the finger's links and the obstacles at the candidate; farther than 5 cm is no better."""

    name: ClassVar[str] = "clearance"
    unit: ClassVar[str] = "m"
    source: ClassVar[str] = "docs/method.md section 6"
    scale: ClassVar[float] = 0.01
    larger_is_better: ClassVar[bool] = True

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return the gap [m]; None without obstacles."""
        if context.obj is None or context.T_palm_object is None or context.source is None:
            return None
        if all(body.role is BodyRole.GRASPABLE for body in context.obj.bodies):
            return None
        links, there = candidate.plan.finger.links, context.T_palm_object
        body = obstacle_body(context.obj)
        gap, _ = nearest_link(context.hand, candidate.q, links, context.source, body, there)
        return min(gap, MOST_CLEARANCE)


class PoseSensitivity:
    """Largest change of a closing joint when the object is shifted, in the worst direction: errors of a camera."""

    name: ClassVar[str] = "pose_sensitivity"
    unit: ClassVar[str] = "rad/m"
    source: ClassVar[str] = "docs/method.md section 5: sensitivity"
    scale: ClassVar[float] = 50.0
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return max |dq/dx| [rad/m]; None where a joint's is not known, and for other closing orders."""
        s = context
        in_stages = s.in_stages and not any(candidate.plan.breaks)
        if s.packed is None or s.T_palm_object is None or s.source is None or not in_stages or candidate.overlap:
            return None
        opened = candidate.plan.posture
        stages = closing_stages(s.hand, [candidate.plan.finger], opened, candidate.q)
        rows = PoseChange(s.hand, s.packed, s.source, Pose.identity(), Pose.from_matrix(s.T_palm_object), stages)
        for number, stage in enumerate(stages):
            rows.add(number, stage, opened[stage.leader])
        if not rows.known[:, :3].all():
            return None
        return float(np.linalg.norm(rows.change[:, :3], axis=1).max())


class PadIndentation:
    """Measure how deep the finger's pads are pressed in, where that was measured: hard parts come first without."""

    name: ClassVar[str] = "pad_indentation"
    unit: ClassVar[str] = "m"
    source: ClassVar[str] = "docs/method.md section 5: pad allowance"
    scale: ClassVar[float] = 1e-3
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return the depth along path and at the end [m]; None when not measured (`check_candidates`)."""
        return candidate.penetration
