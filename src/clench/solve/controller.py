"""The controller: three inputs in, one solution out."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.base.errors import CommandError, HandError, ObjectError, UnknownNameError
from clench.base.pose import FloatArray, Pose
from clench.grasp.blocking import start_overlaps
from clench.grasp.calibration import Calibration, calibration_of
from clench.grasp.candidates import FingerCandidate, combined_posture, read_candidates
from clench.grasp.choice import choose
from clench.grasp.closing import ClosedHand, HandPlan, close_hand, make_hand_plan
from clench.grasp.criteria import Setting
from clench.grasp.criterion_registry import score_hand, score_sets
from clench.grasp.depths import hand_depths
from clench.grasp.exact import HandBodies, hand_bodies, pack_exact
from clench.grasp.explaining import explain_choice
from clench.grasp.feasibility import judge_sets
from clench.grasp.motion import alternatives, asked_fingers, next_postures, open_posture, palm_pose, task_wrenches
from clench.grasp.plan import FingerPlan, closing_joints, plan_finger
from clench.grasp.scene import PackedObject, pack_object
from clench.grasp.sequence import close_in_sequence
from clench.grasp.simultaneous import close_together
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.command_file import check_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource

from .assembly import Answer, assemble
from .certificate import certify
from .orders import best_order
from .solution import GraspSolution

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays

    from .record import Record

_KEPT_PLANS = 64
#: More rounds than any finger needs that comes to rest.
UNTIL_REST = 1000
_plans: OrderedDict[tuple[object, ...], tuple[Hand, HandPlan, ExactArrays]] = OrderedDict()


@dataclass(frozen=True, eq=False)
class Problem:
    """Hold the three inputs, checked and brought together.

    Args:
        start: posture before closing, shape (J,) [rad]. source: geometry of the hand.
        T_world_palm, T_world_object: poses. packed: the object.
    """

    hand: Hand
    obj: GraspObject
    command: GraspCommand
    start: FloatArray
    source: CollisionSource
    T_world_palm: Pose
    T_world_object: Pose
    packed: PackedObject

    @property
    def rounds(self) -> int:
        """How often all degrees of freedom are gone through."""
        return self.command.rounds or UNTIL_REST

    @property
    def together(self) -> bool:
        """Whether all joints close at once."""
        return self.command.order != ClosingOrder.PROXIMAL_FIRST

    @cached_property
    def T_palm_object(self) -> FloatArray:
        """Where the object is for the hand, shape (4, 4)."""
        from clench.kernels.frames import relate_poses

        T = np.eye(4)
        palm, there = (np.array([pose.wxyz_xyz]) for pose in (self.T_world_palm, self.T_world_object))
        relate_poses(palm, there, T[None, :3])
        return T


def solve(hand: Hand, obj: GraspObject, command: GraspCommand, *, record: Record | None = None) -> GraspSolution:
    """Close a hand around an object and return the best set of contacts and joint angles (METHOD.md).

    Args:
        hand: see `Hand.load`. obj: see `GraspObject.load`.
        command: where the hand is, how it is preshaped, what is asked for.
        record: a store that the solution is appended to.

    Raises:
        ClenchError: a command that does not fit the hand, or a hand that no plane can close.
    """
    from clench.kernels.warming import announce

    announce()
    if command.orders:
        check_command(hand, command)
        solution = best_order(command, lambda single: solve(hand, obj, single))
    else:
        solution = _solve_order(hand, obj, command)
    if record is not None:
        record.append(solution)
    return solution


def _solve_order(hand: Hand, obj: GraspObject, command: GraspCommand) -> GraspSolution:
    """Solve a command in its one closing order."""
    clock = _Clock()
    problem = make_problem(hand, obj, command)
    calibration = calibration_of(command.criteria)
    setting = make_setting(problem, calibration)
    clock.lap("read")
    plan, exact, closed, fingers = _close_fingers(problem, clock)
    choice = choose(fingers, calibration, setting)
    chosen, explained = choice.chosen, explain_choice(choice, fingers)
    clock.lap("choose")
    best = [group[i] for group, i in zip(fingers, chosen, strict=True)]
    bodies = hand_bodies(hand, problem.source)
    if plan.together:
        again = close_together(hand, plan, exact, closed, problem.packed, best, bodies)
    else:
        again = close_in_sequence(
            hand, plan, exact, closed, problem.packed, best, problem.start, problem.rounds, bodies
        )
    changed = [k for k, (old, new) in enumerate(zip(best, again, strict=True)) if new is not old]
    for k in changed:
        best[k] = fingers[k][chosen[k]] = replace(again[k], clear=best[k].clear)
        explained["fingers"][best[k].plan.finger.name]["closed_again"] = True
    if changed:
        score_sets([best[k] for k in changed], choice.used, setting)
        explained["final_hand_scores"] = score_hand(best, choice.used, setting)
    clock.lap("sequence")
    answer = judge_answer(problem, fingers, chosen, best, exact, explained)
    clock.lap("judge")
    return assemble(answer, problem, clock.stages())


def finger_sets(problem: Problem) -> list[list[FingerCandidate]]:
    """Return the sets of every finger that the choice is made of."""
    return _close_fingers(problem, _Clock())[3]


def _close_fingers(
    problem: Problem, clock: _Clock
) -> tuple[HandPlan, ExactArrays, ClosedHand, list[list[FingerCandidate]]]:
    """Close every alternative of every finger, and judge what it passes through."""
    hand, packed, T = problem.hand, problem.packed, problem.T_palm_object
    plan, exact = planned(problem)
    clock.lap("plan")
    closed = close_hand(plan, exact, packed, T, problem.rounds)
    clock.lap("close")
    overlaps = start_overlaps(hand, plan, exact.link_pose, closed, packed, T, problem.source)
    candidates = read_candidates(hand, plan, packed, closed, overlaps)
    measure = problem.command.check_sets
    judged = judge_sets(hand, candidates, packed, T, problem.source, measure, plan.together)
    clock.lap("sets")
    return plan, exact, closed, group_by_finger(plan, judged)


def make_problem(hand: Hand, obj: GraspObject, command: GraspCommand) -> Problem:
    """Check the three inputs and bring them together."""
    check_command(hand, command)
    if not any(body.role is BodyRole.GRASPABLE for body in obj.bodies):
        raise ObjectError(f"{obj.name}: no body to grasp; every body is an obstacle.")
    start = open_posture(hand, command)
    source = CollisionSource(command.collision_source or hand.default_source)
    T_world_object = command.object_pose if command.object_pose is not None else obj.pose
    return Problem(hand, obj, command, start, source, palm_pose(hand, command, start), T_world_object, pack_object(obj))


def make_setting(problem: Problem, calibration: Calibration) -> Setting:
    """Return what the criteria judge sets in.

    Raises:
        UnknownNameError: the calibration weighs a joint that the hand does not have.
    """
    hand = problem.hand
    weights = np.ones(len(hand.joints))
    for name, weight in calibration.joints.items():
        if name not in hand.joint_names:
            raise UnknownNameError(
                "joint", name, f"hand '{hand.name}', though {calibration.name} names it", hand.joint_names
            )
        weights[hand.joint_index(name)] = weight
    return Setting(
        hand,
        problem.start,
        problem.packed,
        problem.T_palm_object,
        problem.source,
        next_postures(hand, problem.command.next_steps),
        weights if calibration.joints else None,
        problem.obj,
        problem.T_world_palm.rotation.T @ np.array([0.0, 0.0, -1.0]),
        not problem.together and problem.command.rounds == 1,
        task_wrenches(problem.command, problem.T_world_palm),
        problem.command.order == ClosingOrder.FINGERTIP,
    )


def plan_hand(problem: Problem) -> HandPlan:
    """Return the plan of a hand at a posture; the same posture is planned once.

    Raises:
        HandError: no finger asked for has a closing joint.
    """
    return planned(problem)[0]


def planned(problem: Problem) -> tuple[HandPlan, ExactArrays]:
    """Return the plan of a hand at a posture, and what its exact sweeps need."""
    hand, command = problem.hand, problem.command
    key = (
        id(hand),
        problem.start.tobytes(),
        None if command.fingers is None else tuple(command.fingers),
        command.planes,
        command.rounds != 1,
        problem.together,
        tuple(sorted(command.speeds.items())),
        command.full_width,
        tuple(command.yaw_grid),
        tuple(command.open_variants),
        tuple(command.opposition_grid),
        problem.source,
    )
    kept = _plans.get(key)
    if kept is not None and kept[0] is hand:
        return kept[1], kept[2]
    plans, finger, posture = [], [], []
    for f, asked in enumerate(asked_fingers(hand, command)):
        if closing_joints(hand, asked):
            for p, q in enumerate(alternatives(hand, asked, problem.start, command)):
                plans.append(plan_finger(hand, asked, q, command.planes, problem.source, command.speeds))
                finger.append(f)
                posture.append(p)
    if not plans:
        raise HandError(f"{hand.name}: none of the fingers asked for has a closing joint.")
    if problem.together or command.rounds != 1:
        _check_parallel(plans, f"order {command.order}" if problem.together else "rounds")
    plan = make_hand_plan(plans, finger, posture, command.full_width, problem.together)
    exact = pack_exact(hand, plan.plans, plan.whole, problem.source)
    if problem.together:
        exact = exact._replace(checked=_with_resting(hand, plan.plans, hand_bodies(hand, problem.source)))
    _plans[key] = (hand, plan, exact)
    while len(_plans) > _KEPT_PLANS:
        _plans.popitem(last=False)
    return plan, exact


def _check_parallel(plans: list[FingerPlan], what: str) -> None:
    """Refuse joints that move at once, or again, where outlines, cut once at the open posture, would no longer hold.

    Raises:
        CommandError: a finger whose closing axes are not parallel.
    """
    for plan in plans:
        if len(plan.families) > 1:
            raise CommandError(
                f"{what}: finger '{plan.finger.name}' closes about axes that are not parallel; only order "
                f"'{ClosingOrder.PROXIMAL_FIRST}' with one round covers that."
            )


def _with_resting(hand: Hand, plans: Sequence[FingerPlan], bodies: HandBodies) -> np.ndarray:
    """Return which links may not overlap while all fingers close: those of fingers that rest are in the way."""
    closing = {plan.finger.name for plan in plans}
    resting = [link for f in hand.fingers if f.name not in closing for link in f.links]
    checked = bodies.within.copy()
    checked[:, resting] = bodies.across[:, resting]
    return checked


def group_by_finger(plan: HandPlan, candidates: list[FingerCandidate]) -> list[list[FingerCandidate]]:
    """Return the candidates of each finger that closes, in the command's order."""
    groups: dict[int, list[FingerCandidate]] = {}
    for entry, candidate in zip(plan.items.entry, candidates, strict=True):
        groups.setdefault(plan.finger[int(entry)], []).append(candidate)
    return list(groups.values())


def judge_answer(
    problem: Problem,
    fingers: list[list[FingerCandidate]],
    chosen: list[int],
    best: list[FingerCandidate],
    exact: ExactArrays,
    explained: dict[str, Any],
) -> Answer:
    """Combine the best sets, and measure what overlaps at the start and at the end, over the whole width."""
    hand = problem.hand
    final = combined_posture(hand, problem.start, best)
    at_start = hand_depths(
        hand, problem.start, problem.packed, problem.T_palm_object, problem.source, links=hand.fixed_links
    )
    certificate = certify(problem, best, at_start, final, exact)
    # Where nothing can overlap there is nothing to measure but what rests.
    at_end = at_start if certificate.holds else None
    if at_end is None and problem.command.measure:
        at_end = hand_depths(hand, final, problem.packed, problem.T_palm_object, problem.source)
    return Answer(fingers, chosen, final, at_start, at_end, certificate, explained)


class _Clock:
    """Time the stages of a solve [s]."""

    def __init__(self) -> None:
        self._last = time.perf_counter()
        self._stages: dict[str, float] = {}

    def lap(self, stage: str) -> None:
        """Note the time since the last lap under a name."""
        now = time.perf_counter()
        self._stages[stage] = now - self._last
        self._last = now

    def stages(self) -> dict[str, float]:
        """Return the stages, with their total."""
        return {**self._stages, "total": float(np.sum(list(self._stages.values())))}
