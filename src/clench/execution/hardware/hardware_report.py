"""Report on a hardware hand: commands sent, posture reached, and the reason of the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from clench.core.pose import FloatArray
from clench.execution.execution_report import ExecutionReport, JointReached, judge_steps, notes_on_steps
from clench.execution.history import CommandsSent, ExecutionHistory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .command_check import CommandCheck, NotFollowingError
from .driver_session import Sent
from .following import Followed
from .halting import Halted
from .hardware_squeeze import DrivenSqueeze
from .hardware_steps import DrivenStep, step_reached
from .hardware_way import found_posture
from .joint_blocking import modelled_blocker
from .joint_map import MappedJoint
from .supervision import State


@dataclass
class Done:
    """The record of an execution on a hardware hand.

    Args:
        mapped: the joints as the controller says them. check: test for commands, None before it is known.
        obj: the object, None when it is not known. way: a sentence about the way to the trajectory's start.
        squeeze: as planned.
        followed, squeezed, stepped: samples of the trajectory, the squeeze, and the next steps that were begun.
        pulled: a sentence about tendons. during: phase at the end. trouble: why it ended early.
        left_behind: the fault of a joint that was too far from its target.
        halted: result of the stop, None without a stop.
    """

    mapped: Mapping[str, MappedJoint]
    check: CommandCheck | None = None
    obj: GraspObject | None = None
    way: str = ""
    squeeze: DrivenSqueeze = field(default_factory=DrivenSqueeze)
    followed: Followed = field(default_factory=Followed)
    squeezed: Followed = field(default_factory=Followed)
    stepped: list[tuple[DrivenStep, Followed]] = field(default_factory=list)
    pulled: str = ""
    during: State = State.IDLE
    trouble: str = ""
    left_behind: NotFollowingError | None = None
    halted: Halted | None = None

    @property
    def ways(self) -> list[Followed]:
        """The samples of all ways that were begun, in their order."""
        return [self.followed, self.squeezed, *(way for _, way in self.stepped)]

    @property
    def latest(self) -> Followed:
        """The samples of the way that was begun last."""
        return next((way for way in reversed(self.ways) if way.times), self.followed)

    def ending(self) -> str:
        """Say why it ended early, and the result of the stop; empty after a complete execution."""
        stopped = "" if self.halted is None else f" {self.halted.text()}"
        return f"{self.trouble}{stopped}" if self.trouble else ""


def report_on(
    done: Done, sent: Sent, solution: GraspSolution, hand: Hand, name: str, tolerance: float
) -> ExecutionReport:
    """Report the execution of a hardware hand.

    Args:
        done: record of the execution. sent: count of commands. solution: the executed solution. hand: the model.
        name: of the driver. tolerance: largest difference to a computed angle that counts as reached [rad].
    """
    counted = _counted(sent, done.mapped)
    if not sent.anything:
        return ExecutionReport(name, success=False, reason=f"Not carried out: {done.ending()}", sent=counted)
    computed = posture(solution.joint_angles, hand, "joint_angles")
    at_touch = done.followed.measured[-1] if done.followed.measured else {}
    joints = {
        joint: JointReached(float(computed[hand.joint_index(joint)]), said.to_angle(at_touch[said.name]))
        for joint, said in done.mapped.items()
        if said.name in at_touch
    }
    error = max((abs(joint.error) for joint in joints.values()), default=None)
    stepping = done.during is State.STEPPING and bool(done.stepped)
    ends = ["" for _ in done.stepped[1:]] + [done.ending() if stepping else ""]
    steps = tuple(
        step_reached(step, way, done.mapped, tolerance, end)
        for (step, way), end in zip(done.stepped, ends, strict=False)
    )
    if done.trouble and not stepping:
        success, reason = False, f"{_BEFORE.get(done.during, '')}{done.ending()}"
        if done.left_behind is not None:
            reason += f" {_left_behind(done, done.left_behind, solution, hand)}"
    else:
        success, reason = _judge(joints, error, tolerance)
        if not success:
            worst = _worst(joints)
            reason += f" {_blocker(done, solution, hand, worst, joints[worst].computed, at_touch)}"
        if success or stepping:
            success, reason = judge_steps(success, reason, steps)
    history = _history(done.ways, done.mapped)
    return ExecutionReport(
        actuator=name,
        success=success,
        reason=reason,
        joints=joints,
        duration=float(history.times[-1]) if len(history.times) else 0.0,
        largest_angle_error=error,
        angle_tolerance=tolerance,
        notes=(
            *_notes(done),
            *([counted.text()] if done.trouble else []),
            "Angles were compared; whether links touch was not measured.",
            *notes_on_steps(solution, steps),
        ),
        history=history,
        next_steps=steps,
        sent=counted,
    )


#: Sentence before the trouble, by phase.
_BEFORE = {State.SQUEEZING: "While squeezing: ", State.PULLING: "While pulling the tendons: "}


def _judge(joints: Mapping[str, JointReached], error: float | None, tolerance: float) -> tuple[bool, str]:
    if error is None or error > tolerance:
        worst = _worst(joints)
        far = f"joint '{worst}' is {abs(joints[worst].error):.3g} rad from its computed angle"
        return False, f"Not reached: {far}; tolerance {tolerance:g} rad."
    return True, f"Every joint is within {error:.2g} rad of its computed angle."


def _worst(joints: Mapping[str, JointReached]) -> str:
    return max(joints, key=lambda name: abs(joints[name].error))


def _left_behind(done: Done, fault: NotFollowingError, solution: GraspSolution, hand: Hand) -> str:
    joint = next(name for name, said in done.mapped.items() if said.name == fault.joint)
    told = done.mapped[joint].to_angle(fault.told)
    return _blocker(done, solution, hand, joint, told, fault.positions)


def _blocker(
    done: Done, solution: GraspSolution, hand: Hand, joint: str, told: float, measured: Mapping[str, float]
) -> str:
    """Name the obstruction of a joint that is off its target [rad]."""
    others = posture(solution.joint_angles, hand, "joint_angles")
    reached = found_posture(hand, done.mapped, measured, others)
    return modelled_blocker(solution, hand, done.obj, reached, joint, told)


def _notes(done: Done) -> tuple[str, ...]:
    begun = done.squeeze.plan is None or (done.squeezed.times and done.during is not State.SQUEEZING)
    return tuple(filter(None, (done.way, done.squeeze.text if begun else "", done.pulled)))


def _counted(sent: Sent, mapped: Mapping[str, MappedJoint]) -> CommandsSent:
    last = sent.last or {}
    return CommandsSent(
        commands=sent.commands,
        unconfirmed=sent.unconfirmed,
        last={name: joint.to_angle(last[joint.name]) for name, joint in mapped.items() if joint.name in last},
        time=None if sent.last is None else sent.last_at - sent.first_at,
        tensions=sent.tensions,
    )


def _history(ways: Sequence[Followed], mapped: Mapping[str, MappedJoint]) -> ExecutionHistory:
    """Return the samples of ways that followed each other."""

    def angles(samples: list[Mapping[str, float]]) -> FloatArray:
        rows = [[joint.to_angle(sample[joint.name]) for joint in mapped.values()] for sample in samples]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(mapped))

    times, commanded, measured = list[float](), list[Mapping[str, float]](), list[Mapping[str, float]]()
    for way in ways:
        # The first sample of a way is taken at the end of the one before.
        first, begin = (1, times[-1]) if times else (0, 0.0)
        times += [begin + time for time in way.times[first:]]
        commanded += way.commanded[first:]
        measured += way.measured[first:]
    return ExecutionHistory(tuple(mapped), np.array(times), angles(commanded), angles(measured))
