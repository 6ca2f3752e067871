"""A real hand: any controller with a driver, told step by step, checked and supervised."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping

import numpy as np

from clench.core.argument_types import check_type
from clench.core.exceptions import ClenchError, CommandError, UnknownNameError
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import described
from clench.execution.execution_report import ExecutionReport
from clench.execution.history import CommandsSent
from clench.execution.trajectory import Trajectory
from clench.execution.trajectory_checks import check_for_hand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .command_check import CommandCheck, NotFollowingError, check_tensions, command_limits
from .driver import DriverError, HandDriver, RefusedCommandError, TendonDriver, check_driver
from .driver_line import CALL_LIMIT
from .driver_session import STOP_TRIES, DriverSession
from .following import CLOSEST, Follower
from .halting import halt
from .hardware_report import Done, report_on
from .hardware_squeeze import DrivenSqueeze, plan_driven_squeeze, squeeze_by_driver
from .hardware_steps import DrivenStep, go_to_steps, plan_driven_steps
from .hardware_way import plan_driven_way
from .joint_map import JointMap, MappedJoint
from .supervision import Event, ExecutionRefusedError, State, Supervision, supervision_of

#: Interval at which a stop checks whether a command on its way has arrived [s].
WAITING = 0.005
#: Number of attempts to end an interrupted execution.
ENDINGS = 5


class HardwareHand:
    """Carry solutions out on a controller; every command is checked before it is sent.

    The hand moves from where it is found to the trajectory's start, then along the trajectory. The whole motion is
    proven free before the first command, see `plan_trajectory`: of the hand's links and, with `obj`, of the object. The
    controller is told the next 0.3 s at a time, so that a cut connection stops the hand. On any trouble the hand
    is stopped and the report says why. A stop stays in force until `release_stop`, for everybody who uses this driver.
    The driver is called from a thread of its own. Without sensors of touch the report compares joint angles only.

    Args:
        hand: the model. driver: talks to the controller. joint_map: the controller's names and units.
        obj: the object, so that a solution for another one is refused; None: not checked.
        angle_tolerance: largest difference to the computed angles that counts as reached [rad].
        connect_timeout: how long the controller is looked for [s].
        max_age: oldest state of the hand on which a command may be based [s].
        max_deviation: largest allowed distance of a joint from its target, on the way [rad].
        settling: how long the hand may take to arrive after the trajectory's end [s].
        squeeze: share of the angle offsets of the solution's squeeze plan that joints get beyond the touch, 0 for none
            [-]. A solution without a plan is not squeezed (see `clench.execution.complete`).
        stay_connected: leave the driver connected at the end, for hands that let go when it leaves; call
            `driver.disconnect` later.

    Raises:
        CommandError: the driver lacks a member, or `squeeze` is out of range.
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
        check_type(hand, Hand, "hand")
        if not (np.isfinite(squeeze) and squeeze >= 0.0):
            raise CommandError(f"squeeze: expected a finite number of at least 0, got {squeeze!r}.")
        check_driver(driver)
        self._hand = hand
        self._driver = driver
        self.joint_map = joint_map or JointMap()
        self.obj = obj
        self.angle_tolerance = angle_tolerance
        self.connect_timeout = connect_timeout
        self.max_age = max_age
        self.max_deviation = max_deviation
        self.settling = settling
        self.squeeze = squeeze
        self.stay_connected = stay_connected
        self._last_report: ExecutionReport | None = None
        supervision_of(driver)

    def __repr__(self) -> str:
        obj = None if self.obj is None else self.obj.name
        return described(self, hand=self.hand.name, driver=self.name, obj=obj)

    @property
    def hand(self) -> Hand:
        """The hand that it moves."""
        return self._hand

    @property
    def driver(self) -> HandDriver:
        """The link to the controller."""
        return self._driver

    @property
    def name(self) -> str:
        """Name of the driver."""
        return self.driver.name

    @property
    def supervision(self) -> Supervision:
        """State and stop of this hand, which all who use the same driver share."""
        return supervision_of(self.driver)

    @property
    def state(self) -> State:
        """The present activity of the hand."""
        return self.supervision.state

    @property
    def last_report(self) -> ExecutionReport | None:
        """The report on the last execution, also when it ended with an exception such as Ctrl-C; None before."""
        return self._last_report

    def stop(self) -> None:
        """Stop the hand now, from any thread or signal handler; no command is sent until `release_stop`.

        An execution that is under way ends and says so.

        Raises:
            DriverError: the driver failed twice to tell the hand. The stop is in force all the same.
        """
        supervision = self.supervision
        supervision.stop()
        self._tell_stop()
        until = time.monotonic() + CALL_LIMIT
        if supervision.sender not in (None, threading.get_ident()):
            # A command was on its way, and may have come after the stop.
            while supervision.sender is not None and time.monotonic() < until:
                time.sleep(WAITING)
            self._tell_stop()

    def release_stop(self) -> None:
        """Release the stop, once it is safe to move, so that solutions are carried out again.

        Raises:
            DriverError: an execution is still ending, or the driver has not returned from a call.
        """
        self.supervision.release()

    def execute(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Connect, move to the trajectory's start, follow it, and compare the angles reached with those computed.

        Nothing is sent, and the report says why, when a stop is in force or the driver is in use.

        Raises:
            CommandError: the solution, the trajectory or the joint map does not fit the hand. UnknownNameError: the
                controller lacks a joint. KeyboardInterrupt: like every exception that is no error of the driver. The
                hand was stopped before, and `last_report` lists the commands sent.
        """
        done = Done(self.joint_map.of(self.hand), obj=self.obj)
        check_for_hand(trajectory, solution, self.hand)
        session = DriverSession(self.driver)
        raised: BaseException | None = None
        try:
            try:
                session.begin()
                self._last_report = None
                self._move(session, solution, trajectory, done)
            except ExecutionRefusedError as error:
                return ExecutionReport(
                    self.name, success=False, reason=f"Not carried out: {error}", sent=CommandsSent()
                )
            except BaseException as error:
                raised = error
            raised = self._conclude(session, solution, done, raised)
        except BaseException as error:  # an interrupt before the end was taken care of
            raised = self._conclude(session, solution, done, error)
        if raised is not None and not isinstance(raised, DriverError):
            raise raised
        assert self._last_report is not None
        return self._last_report

    def _move(self, session: DriverSession, solution: GraspSolution, trajectory: Trajectory, done: Done) -> None:
        """Plan, check and execute; every failure is raised."""
        mapped = done.mapped
        session.connect(self.connect_timeout)
        self._check_joints(mapped, session.joints())
        limits = command_limits(self.hand, mapped, session.limits())
        done.check = check = CommandCheck(limits, self.max_age, self.max_deviation)
        state = session.read()
        check.state(state)
        way = plan_driven_way(solution, trajectory, self.hand, self.obj, mapped, check, state)
        plan, done.way = way.plan, way.text
        check.command(plan.window(0.0, plan.duration + CLOSEST), plan.at(0.0))
        done.squeeze = squeeze = plan_driven_squeeze(solution, self.hand, mapped, check, self.squeeze)
        steps = self._steps(solution, trajectory, squeeze, mapped, check)
        tensions = self._tensions(solution, done)
        session.enter(Event.MOVE)
        arrived = {joint.name: 0.2 * self.angle_tolerance * abs(joint.scale) for joint in mapped.values()}
        Follower(session, check, self.settling, arrived).follow(plan, done.followed, Event.SETTLE)
        squeeze_by_driver(squeeze, session, mapped, check, done.squeezed)
        if tensions is not None:
            session.enter(Event.PULL)
            done.pulled = ""
            session.pull(tensions)
            done.pulled = f"The tendons were told the tensions of the squeeze plan, up to {tensions.max():.3g} N."
        go_to_steps(steps, session, mapped, check, (self.settling, self.angle_tolerance), done.stepped)

    def _conclude(
        self, session: DriverSession, solution: GraspSolution, done: Done, raised: BaseException | None
    ) -> BaseException | None:
        """Stop the hand if necessary, disconnect the driver, report, and return the exception to raise.

        An interrupt that comes meanwhile begins it again: it must not keep the hand from being stopped.
        """
        for _ in range(ENDINGS):
            try:
                self._halt(session, done, raised)
                session.close(disconnect=not self.stay_connected)
                # A stop that came since then was told by whoever stopped the hand.
                done.trouble = done.trouble or session.supervision.cause
                self._last_report = report_on(done, session.sent, solution, self.hand, self.name, self.angle_tolerance)
            except BaseException as error:
                raised = error
            else:
                return session.interrupt or raised
        session.close(disconnect=False)
        return raised

    def _halt(self, session: DriverSession, done: Done, raised: BaseException | None) -> None:
        supervision = session.supervision
        if raised is not None and not done.trouble:
            done.trouble = _trouble(raised)
            if isinstance(raised, NotFollowingError):
                done.left_behind = raised
        interrupted = raised is not None and not isinstance(raised, Exception)
        if interrupted:
            supervision.stop(_trouble(raised))
        elif raised is not None and (session.failed or session.sent.anything):
            supervision.fault(done.trouble)
        if supervision.cause and done.halted is None:
            done.trouble = done.trouble or supervision.cause
            done.during = supervision.doing
            done.halted = halt(session, done.check, done.latest)

    def _tell_stop(self) -> None:
        """Call the driver's `stop`, once more when it fails."""
        first: BaseException | None = None
        for _ in range(STOP_TRIES):
            try:
                self.driver.stop()
            except BaseException as error:
                first = first or error
            else:
                if first is not None and not isinstance(first, Exception):
                    raise first  # an interrupt
                return
        raise DriverError(
            f"The hand could not be told to stop ({type(first).__name__}: {first}); no further command is sent."
        ) from first

    def _tensions(self, solution: GraspSolution, done: Done) -> FloatArray | None:
        """Return the tensions that the tendons are to be told, checked; None without any."""
        planned = (solution.squeeze or {}).get("tensions")
        if planned is None or self.hand.tendons is None or not isinstance(self.driver, TendonDriver):
            return None
        tensions = np.asarray(planned, dtype=np.float64)
        try:
            check_tensions(tensions, self.hand.tendons)
        except RefusedCommandError as error:
            done.pulled = f"The tendons were not pulled: {error}"
            return None
        done.pulled = "The tendons were not pulled."  # until they are
        return tensions

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

    def _check_joints(self, mapped: Mapping[str, MappedJoint], known: tuple[str, ...]) -> None:
        for name, joint in mapped.items():
            if joint.name not in known:
                said = "" if joint.name == name else f" (joint '{name}' of the hand)"
                raise UnknownNameError("joint", joint.name, f"controller '{self.name}'{said}", known)


def _trouble(error: BaseException | None) -> str:
    """Describe in a sentence the exception that ended an execution."""
    if isinstance(error, ClenchError):
        return str(error)
    if isinstance(error, Exception):
        return f"It failed ({type(error).__name__}: {error})."
    return f"Interrupted ({type(error).__name__})."
