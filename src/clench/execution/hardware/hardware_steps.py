"""The next steps of a driven hand: planned and checked before anything moves, followed after the squeeze."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.execution.execution_report import JointReached, NextStepReached, step_sentence
from clench.execution.next_steps import Phase, moved_joints, plan_next_steps
from clench.execution.step_check import step_overlap
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

from .command_check import CommandCheck, slowed_down
from .driver import JointPath, RefusedCommandError
from .driver_session import DriverSession
from .following import CLOSEST, PERIOD, Followed, Follower, TimedPlan
from .joint_map import MappedJoint
from .supervision import Event


@dataclass(frozen=True, eq=False)
class DrivenStep:
    """A next step, in the form in which it goes to a controller.

    Args:
        number: its index. targets: of the joints that it moves and the controller knows [rad]. plan: the way there.
    """

    number: int
    targets: Mapping[str, float]
    plan: TimedPlan


def plan_driven_steps(
    solution: GraspSolution,
    hand: Hand,
    told: FloatArray,
    pace: tuple[FloatArray, FloatArray],
    mapped: Mapping[str, MappedJoint],
    check: CommandCheck,
) -> tuple[DrivenStep, ...]:
    """Plan the way to every next step, and check the commands of it.

    Args:
        solution: with `next_steps`. hand: the model.
        told: where the joints are told to be before the first step [rad], shape (J,).
        pace: largest velocity [rad/s] and acceleration [rad/s²] of every joint, shape (J,) each.
        mapped: the joints as the controller says them. check: test for every command.

    Raises:
        RefusedCommandError: a step may not be sent, or drives links into each other; the message says which, and why.
    """
    steps = []
    phases = plan_next_steps(solution, hand, told, pace)
    overlap = step_overlap(solution, hand, phases)
    if overlap is not None:
        raise RefusedCommandError(overlap)
    for phase in phases:
        plan = _timed(phase, hand, mapped, check)
        assert phase.step is not None
        whole = JointPath(plan.joints, plan.times[-1:], plan.positions[-1:], PERIOD)
        try:
            check.command(whole, plan.at(0.0))  # first, so that a refusal names the angle that the step asks for
            check.command(plan.window(0.0, plan.duration + CLOSEST), plan.at(0.0))
        except RefusedCommandError as error:
            raise RefusedCommandError(f"Next step {phase.step + 1}: {error}") from None
        names = [hand.joint_names[j] for j in moved_joints(hand, solution.next_steps[phase.step])]
        targets = {name: float(phase.positions[-1, hand.joint_index(name)]) for name in names if name in mapped}
        steps.append(DrivenStep(phase.step, targets, plan))
    return tuple(steps)


def go_to_steps(
    steps: Sequence[DrivenStep],
    session: DriverSession,
    mapped: Mapping[str, MappedJoint],
    check: CommandCheck,
    arriving: tuple[float, float],
    found: list[tuple[DrivenStep, Followed]],
) -> None:
    """Follow the steps one after another, up to the first that is not reached.

    Args:
        steps: planned. session: with the driver. mapped: the joints as the controller says them.
        check: test for every command and state.
        arriving: time limit for the hand to arrive [s], and tolerance of the angles [rad].
        found: collects the steps that were begun, and the samples of each.

    Raises:
        DriverError: see `Follower.follow`.
    """
    settling, tolerance = arriving
    for step in steps:
        # Joints that go on pressing on the object stay behind.
        arrived = {
            joint.name: 0.2 * tolerance * abs(joint.scale) if name in step.targets else np.inf
            for name, joint in mapped.items()
        }
        session.enter(Event.STEP)
        found.append((step, Followed()))
        Follower(session, check, settling, arrived).follow(step.plan, found[-1][1])
        if not step_reached(step, found[-1][1], mapped, tolerance).reached:
            break


def step_reached(
    step: DrivenStep, followed: Followed, mapped: Mapping[str, MappedJoint], tolerance: float, trouble: str = ""
) -> NextStepReached:
    """Compare where the hand is after a step with where the step leads.

    Args:
        step: the step. followed: samples of the way there. mapped: the joints as the controller says them.
        tolerance: of the angles [rad]. trouble: the failure that ended the way, in words, or empty.
    """
    last = followed.measured[-1] if followed.measured else {}
    joints = {
        name: JointReached(target, mapped[name].to_angle(last[mapped[name].name]))
        for name, target in step.targets.items()
        if mapped[name].name in last
    }
    if trouble:
        return NextStepReached(joints, False, f"On the way to next step {step.number + 1}: {trouble}")
    return NextStepReached(joints, *step_sentence(step.number, joints, tolerance))


def _timed(phase: Phase, hand: Hand, mapped: Mapping[str, MappedJoint], check: CommandCheck) -> TimedPlan:
    """Return a phase in the controller's names and units, no faster than it may be."""
    joints = tuple(joint.name for joint in mapped.values())
    columns = [[joint.to_controller(q) for q in phase.positions[:, hand.joint_index(n)]] for n, joint in mapped.items()]
    positions = np.array(columns, dtype=np.float64).T
    if not phase.duration > 0.0:  # nothing moves
        return TimedPlan(joints, np.array([0.0, PERIOD]), np.repeat(positions[:1], 2, axis=0))
    speeds = np.array([check.limits[name].velocity for name in joints])
    return TimedPlan(joints, slowed_down(phase.times, positions, speeds), positions).thinned()
