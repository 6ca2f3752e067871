"""A real hand: any controller with a driver, told step by step, checked and supervised."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from clench.base.errors import ClenchError, CommandError, UnknownNameError
from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solve.posture import posture
from clench.solve.solution import GraspSolution

from .command_check import CommandCheck, check_tensions, command_limits, slowed_down
from .driven_squeeze import DrivenSqueeze, plan_driven_squeeze, squeeze_by_driver
from .driven_steps import DrivenStep, go_to_steps, plan_driven_steps
from .driver import DriverError, HandDriver, HandState, TendonDriver
from .following import CLOSEST, Followed, Follower, TimedPlan
from .history import ExecutionHistory
from .joint_map import JointMap, MappedJoint
from .report import ExecutionReport, JointReached, NextStepReached, judge_steps, notes_on_steps
from .trajectory import Trajectory

#: Points of the way from where the hand is found to the trajectory's start.
WAY_POINTS = 9


@dataclass
class _Done:
    """Collect what a hand has done: the way to the start [rad], the path, the squeeze, the tendons, the next steps."""

    way: float
    squeeze: DrivenSqueeze
    followed: Followed = field(default_factory=Followed)
    squeezed: Followed = field(default_factory=Followed)
    pulled: str = ""
    stepped: list[tuple[NextStepReached, Followed]] = field(default_factory=list)

    def untroubled(self) -> bool:
        return self.followed.trouble is None and self.squeezed.trouble is None


class DrivenHand:
    """Carry solutions out on a controller; every command is checked before it is sent.

    The hand moves in a straight line from where it is found to the trajectory's start, then along the trajectory. The
    controller is told the next 0.3 s at a time, so that a cut connection stops the hand. On any trouble the hand
    is stopped and the report says why. Without sensors of touch the report compares joint angles only.

    Args:
        hand: the model. driver: talks to the controller. joint_map: the controller's names and units.
        obj: the object, so that a solution for another one is refused; None: not checked.
        angle_tolerance: largest difference to the computed angles that counts as reached [rad].
        connect_timeout: how long the controller is looked for [s].
        max_age: oldest state of the hand on which a command may be based [s].
        max_deviation: how far a joint may be from where it was told to be, on the way [rad].
        settling: how long the hand may take to arrive after the trajectory's end [s].
        squeeze: share of the angle offsets of the solution's squeeze plan that joints are told beyond the touch, 0 for
            none [-]; a solution without a plan is not squeezed (see `clench.complete`).
        stay_connected: leave the driver connected at the end, for hands that let go when it leaves; call
            `driver.disconnect` later.
    """

    def __init__(
        self,
        hand: Hand,
        driver: HandDriver,
        *,
        joint_map: JointMap | None = None,
        obj: GraspObject | None = None,
        angle_tolerance: float = 0.05,
        connect_timeout: float = 5.0,
        max_age: float = 0.5,
        max_deviation: float = 0.5,
        settling: float = 2.0,
        squeeze: float = 1.0,
        stay_connected: bool = False,
    ) -> None:
        if not (np.isfinite(squeeze) and squeeze >= 0.0):
            raise CommandError(f"squeeze: expected a finite number of at least 0, got {squeeze!r}.")
        self._hand = hand
        self.driver = driver
        self.joint_map = joint_map or JointMap()
        self.obj = obj
        self.angle_tolerance = angle_tolerance
        self.connect_timeout = connect_timeout
        self.max_age = max_age
        self.max_deviation = max_deviation
        self.settling = settling
        self.squeeze = squeeze
        self.stay_connected = stay_connected
        self._stopping = threading.Event()

    @property
    def hand(self) -> Hand:
        """The hand that it moves."""
        return self._hand

    @property
    def name(self) -> str:
        """Name of the driver."""
        return self.driver.name

    def stop(self) -> None:
        """Stop the hand now, from any thread; an execution that is under way ends and says so."""
        self._stopping.set()
        self.driver.stop()

    def carry_out(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Connect, move to the trajectory's start, follow it, and compare the angles reached with those computed.

        Raises:
            CommandError: the solution or the joint map does not fit the hand. UnknownNameError: the controller lacks
                a joint.
        """
        mapped = self.joint_map.of(self.hand)
        computed = posture(solution.joint_angles, self.hand, "joint_angles")
        self._stopping.clear()
        try:
            self.driver.connect(self.connect_timeout)
            self._check_joints(mapped)
            check = CommandCheck(
                command_limits(self.hand, mapped, self.driver.limits), self.max_age, self.max_deviation
            )
            state = self.driver.read()
            check.state(state)
            plan, way = self._plan(trajectory, mapped, check, state)
            check.command(plan.window(0.0, plan.duration + CLOSEST), plan.at(0.0))
            squeeze = plan_driven_squeeze(solution, self.hand, mapped, check, self.squeeze)
            steps = self._steps(solution, trajectory, squeeze, mapped, check)
            done = _Done(way, squeeze)
            arrived = {joint.name: 0.2 * self.angle_tolerance * abs(joint.scale) for joint in mapped.values()}
            done.followed = Follower(self.driver, check, self._stopping, self.settling, arrived).follow(plan)
            if done.followed.trouble is None:
                done.squeezed = squeeze_by_driver(squeeze, self.driver, mapped, check, self._stopping)
            if done.untroubled():
                done.pulled = self._pull(solution)
                done.stepped = go_to_steps(
                    steps, self.driver, mapped, check, self._stopping, self.settling, self.angle_tolerance
                )
        except DriverError as error:
            return ExecutionReport(self.name, success=False, reason=f"Not carried out: {error}")
        except ClenchError:
            raise
        except Exception as error:  # drivers are others' code
            reason = f"Not carried out: The driver failed ({type(error).__name__}: {error})."
            return ExecutionReport(self.name, success=False, reason=reason)
        finally:
            if not self.stay_connected:
                with suppress(Exception):  # what the hand did is known, however the line closes
                    self.driver.disconnect()
        return self._report(solution, done, mapped, computed)

    def _steps(
        self,
        solution: GraspSolution,
        trajectory: Trajectory,
        squeeze: DrivenSqueeze,
        mapped: Mapping[str, MappedJoint],
        check: CommandCheck,
    ) -> tuple[DrivenStep, ...]:
        told = posture(solution.joint_angles, self.hand, "joint_angles")
        for name, offset in squeeze.offsets.items():
            told[self.hand.joint_index(name)] += offset
        return plan_driven_steps(solution, self.hand, told, trajectory.pace, mapped, check)

    def _check_joints(self, mapped: Mapping[str, MappedJoint]) -> None:
        for name, joint in mapped.items():
            if joint.name not in self.driver.joints:
                said = "" if joint.name == name else f" (joint '{name}' of the hand)"
                raise UnknownNameError("joint", joint.name, f"controller '{self.name}'{said}", self.driver.joints)

    def _plan(
        self, trajectory: Trajectory, mapped: Mapping[str, MappedJoint], check: CommandCheck, state: HandState
    ) -> tuple[TimedPlan, float]:
        """Return the whole motion in the controller's units, and how far the way to its start is [rad]."""
        columns = [trajectory.joints.index(name) for name in mapped]
        joints = list(mapped.values())
        angles = trajectory.positions[:, columns]
        found = np.array([joint.to_angle(state.positions[joint.name]) for joint in joints])
        limits = [check.limits[joint.name] for joint in joints]
        speeds = np.array([limit.velocity / abs(j.scale) for limit, j in zip(limits, joints, strict=True)])
        # As fast as the trajectory itself, compared with what its joints could do.
        share = _largest_share(trajectory)
        s = np.linspace(0.0, 1.0, WAY_POINTS)[:, None]
        way = found + (s * s * (3.0 - 2.0 * s)) * (angles[0] - found)
        step = max(float((np.abs(np.diff(way, axis=0)) / (speeds * share)).max(initial=0.0)), CLOSEST * 10.0)
        before = step * np.arange(WAY_POINTS)
        after = slowed_down(trajectory.times, angles, speeds)
        scale, offset = np.array([j.scale for j in joints]), np.array([j.offset for j in joints])
        plan = TimedPlan(
            joints=tuple(joint.name for joint in joints),
            times=np.concatenate([before[:-1], before[-1] + after]),
            positions=np.vstack([way[:-1], angles]) * scale + offset,
        )
        return plan.thinned(), float(np.abs(angles[0] - found).max(initial=0.0))

    def _pull(self, solution: GraspSolution) -> str:
        """Send the squeeze plan's tensions to a driver that pulls tendons; return a sentence about it, or none."""
        planned = (solution.squeeze or {}).get("tensions")
        if planned is None or self.hand.tendons is None or not isinstance(self.driver, TendonDriver):
            return ""
        if self._stopping.is_set():
            return "The tendons were not pulled: stopped on request."
        tensions = np.asarray(planned, dtype=np.float64)
        try:
            check_tensions(tensions, self.hand.tendons)
            self.driver.pull(tensions)
        except DriverError as error:
            with suppress(Exception):  # the sentence says what went wrong first
                self.driver.stop()
            return f"The tendons were not pulled: {error}"
        return f"The tendons were told the tensions of the squeeze plan, up to {tensions.max():.3g} N."

    def _report(
        self, solution: GraspSolution, done: _Done, mapped: Mapping[str, MappedJoint], computed: FloatArray
    ) -> ExecutionReport:
        followed = done.followed
        at_touch = followed.measured[-1] if followed.measured else {}
        joints = {
            name: JointReached(float(computed[self.hand.joint_index(name)]), joint.to_angle(at_touch[joint.name]))
            for name, joint in mapped.items()
            if joint.name in at_touch
        }
        error = max((abs(joint.error) for joint in joints.values()), default=None)
        success, reason = self._judge(followed, joints, error)
        if success and done.squeezed.trouble is not None:
            success, reason = False, f"While squeezing: {done.squeezed.ending()}"
        steps = tuple(step for step, _ in done.stepped)
        if success:
            success, reason = judge_steps(success, reason, steps)
        history = _history([followed, done.squeezed, *(way for _, way in done.stepped)], mapped)
        return ExecutionReport(
            actuator=self.name,
            success=success,
            reason=reason,
            joints=joints,
            duration=float(history.times[-1]) if len(history.times) else 0.0,
            largest_angle_error=error,
            angle_tolerance=self.angle_tolerance,
            notes=(
                *filter(None, (_way(done.way), done.squeeze.text, done.pulled)),
                "Angles were compared; whether links touch was not measured.",
                *notes_on_steps(solution, steps),
            ),
            history=history,
            next_steps=steps,
        )

    def _judge(self, followed: Followed, joints: Mapping[str, JointReached], error: float | None) -> tuple[bool, str]:
        if followed.trouble is not None:
            return False, followed.ending()
        if error is None or error > self.angle_tolerance:
            worst = max(joints, key=lambda name: abs(joints[name].error))
            far = f"joint '{worst}' is {abs(joints[worst].error):.3g} rad from its computed angle"
            return False, f"Not reached: {far}; tolerance {self.angle_tolerance:g} rad."
        return True, f"Every joint is within {error:.2g} rad of its computed angle."


def _way(way: float) -> str:
    return f"Before the trajectory the hand moved straight to its start, {way:.3g} rad at most."


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


def _largest_share(trajectory: Trajectory) -> float:
    """Return the largest share of a joint's speed limit that a trajectory uses, above 0 and up to 1 [-]."""
    if len(trajectory.times) < 2:
        return 1.0
    rates = np.abs(np.diff(trajectory.positions, axis=0)) / np.diff(trajectory.times)[:, None]
    share = float((rates / trajectory.velocity_limits).max(initial=0.0))
    return min(1.0, share) if share > 0.0 else 1.0
