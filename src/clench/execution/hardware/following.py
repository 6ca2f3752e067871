"""Follow a timed plan on a controller, never further ahead than a short horizon.

A controller is only ever told the next fraction of a second. When this program, its machine or the connection fails, no
more commands arrive. The hand then stands still at its last target.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from clench.core.pose import FloatArray

from .command_check import CommandCheck
from .driver import HandState, JointPath, OneTargetDriver
from .driver_session import DriverSession
from .supervision import Event

#: Interval of readings and commands [s].
PERIOD = 0.05
#: Length of a path ahead [s]: the hand moves this long after its connection is cut.
HORIZON = 0.3
#: Largest delay of a path [s]; a longer delay is a pause of this program.
LATE = 0.2 * PERIOD
#: Number of times that a late path is computed again.
_TRIES = 3
#: Points of a path that are closer than this are one [s].
CLOSEST = 1e-4


@dataclass(frozen=True, eq=False)
class TimedPlan:
    """A timed motion for a controller to follow: way-points in its own names and units.

    Between two way-points the joints move at constant speed.

    Args:
        joints: the controller's names. times: shape (N,), rising from 0 [s]. positions: shape (N, J).
    """

    joints: tuple[str, ...]
    times: FloatArray
    positions: FloatArray

    def thinned(self) -> TimedPlan:
        """Return the plan without way-points that are next to the one before; the first and the last stay."""
        kept = [0]
        for k in range(1, len(self.times) - 1):
            if self.times[k] - self.times[kept[-1]] > CLOSEST and self.times[-1] - self.times[k] > CLOSEST:
                kept.append(k)
        kept.append(len(self.times) - 1)
        return TimedPlan(self.joints, self.times[kept], self.positions[kept])

    @property
    def duration(self) -> float:
        """Time from the first way-point to the last [s]."""
        return float(self.times[-1])

    def at(self, moment: float) -> dict[str, float]:
        """Return the targets at a time [s] from the plan's start."""
        values = [float(np.interp(moment, self.times, column)) for column in self.positions.T]
        return dict(zip(self.joints, values, strict=True))

    def nearest(self, name: str, value: float, first: float, last: float) -> float:
        """Return where a joint is nearest to a value on its way between two moments [s]."""
        column = self.positions[:, self.joints.index(name)]
        inside = (self.times > first) & (self.times < last)
        passed = [*np.interp([first, last], self.times, column), *column[inside]]
        return float(np.clip(value, min(passed), max(passed)))

    def window(self, moment: float, horizon: float) -> JointPath:
        """Return the way-points of the next `horizon` [s], with times from `moment` [s] on.

        The first target is the plan's posture when the next path is due. A hand with a small error has until then to
        get there, and a driver that passes on one target finds it.
        """
        due = [PERIOD] if horizon - CLOSEST > PERIOD else []
        after, until = moment + sum(due) + CLOSEST, moment + horizon - CLOSEST
        inside = self.times[(self.times > after) & (self.times < until)] - moment
        times = np.concatenate([due, inside, [horizon]])
        columns = [np.interp(moment + times, self.times, column) for column in self.positions.T]
        positions = np.reshape(columns, (len(columns), len(times))).T
        return JointPath(joints=self.joints, times=times, positions=positions, period=PERIOD)


@dataclass
class Followed:
    """Collect samples of commanded and measured positions.

    Args:
        times: of the samples [s]. commanded, measured: by the controller's names and units.
    """

    times: list[float] = field(default_factory=list)
    commanded: list[Mapping[str, float]] = field(default_factory=list)
    measured: list[Mapping[str, float]] = field(default_factory=list)

    def sample(self, moment: float, commanded: Mapping[str, float], state: HandState) -> None:
        """Keep one sample."""
        self.times.append(moment)
        self.commanded.append(commanded)
        self.measured.append(state.positions)


@dataclass
class _Progress:
    """The progress of a hand along a plan, from its last command and the time of it.

    A controller starts on a path when it receives it, at some time during the call that sends it.

    Args:
        ahead: how far the hand goes on along one path [s]. begin: moment of the plan at which the last path begins [s].
        before, after: bounds on the time of that command [s]; not a number without a command.
    """

    ahead: float
    begin: float = 0.0
    before: float = math.nan
    after: float = math.nan

    def moment(self, now: float) -> float:
        """Return the hand's largest possible time on the plan [s]: after a pause, the end of its last path."""
        return self.begin + self._gone(now - self.before, 0.0)

    def span(self, first: float, last: float) -> tuple[float, float]:
        """Return between which moments of the plan [s] the hand was at a time between two [s].

        The hand may still lag behind by a path that came up to a period late, or already be at the start of the next
        path.
        """
        return self.begin + self._gone(first - self.after, -math.inf) - PERIOD, self.moment(last) + PERIOD

    @property
    def due(self) -> float:
        """When the next path is to be told [s]."""
        # After a slow call the place of the hand on its path is unknown, so it goes to the end of the path.
        return self.before + PERIOD if self.after - self.before <= PERIOD else self.after + self.ahead

    def _gone(self, since: float, least: float) -> float:
        return 0.0 if math.isnan(self.before) else min(max(since, least), self.ahead)


@dataclass(frozen=True)
class Follower:
    """Make a controller follow plans; every failure is raised, and the caller stops the hand.

    Args:
        session: with the driver, connected. check: test for every command and state.
        settling: how long the hand may take to arrive after the plan's end [s].
        arrived: how near to its target every joint shall be, by the controller's names and in its units.
    """

    session: DriverSession
    check: CommandCheck
    settling: float
    arrived: Mapping[str, float]

    def follow(self, plan: TimedPlan, found: Followed, end: Event | None = None) -> None:
        """Follow a plan to its end.

        Args:
            plan: the plan to follow. found: collects the samples. end: event of the supervision at the plan's end, if
                any.

        Raises:
            DriverError: the driver failed, a command or a state was refused, or a stop is in force.
        """
        driver = self.session.driver
        one_target = isinstance(driver, OneTargetDriver) and driver.one_target
        progress = _Progress(PERIOD if one_target else HORIZON)
        self._move(plan, found, progress)
        if end is not None:
            self.session.enter(end)
        self._settle(plan, found, progress)

    def _move(self, plan: TimedPlan, found: Followed, progress: _Progress) -> None:
        begun = time.monotonic()
        while self._look(plan, found, progress, begun) < plan.duration:
            self._tell(plan, progress)
            self.session.wait(progress.due - time.monotonic())

    def _look(self, plan: TimedPlan, found: Followed, progress: _Progress, begun: float) -> float:
        """Read where the hand is, and check that it is on its way; return the moment of the plan."""
        asked = time.monotonic()
        state = self.session.read()
        now = time.monotonic()
        expected = {}
        for name in plan.joints:
            age = state.age([name])
            span = progress.span(asked - age, now - age)
            expected[name] = plan.nearest(name, state.positions.get(name, math.nan), *span)
        self.check.state(state, expected)
        moment = progress.moment(now)
        found.sample(now - begun, plan.at(moment), state)
        self.session.supervision.check()
        return moment

    def _tell(self, plan: TimedPlan, progress: _Progress) -> None:
        """Send the next path. After a pause it is computed anew: a late path would pull the hand back."""
        for _ in range(_TRIES):
            seen = time.monotonic()
            moment = progress.moment(seen)
            path = plan.window(moment, HORIZON)
            self.check.command(path, plan.at(moment))
            before = time.monotonic()
            if before - seen <= LATE:
                break
        self.session.command(path, before)
        progress.begin, progress.before, progress.after = moment, before, time.monotonic()

    def _settle(self, plan: TimedPlan, found: Followed, progress: _Progress) -> None:
        begun, before, told = time.monotonic(), found.times[-1], False
        end = plan.at(plan.duration)
        while True:
            self.session.wait(PERIOD)
            self._look(plan, found, progress, begun - before)
            here = found.measured[-1]
            if all(abs(here[name] - end[name]) <= near for name, near in self.arrived.items()):
                return
            if told and time.monotonic() - begun >= self.settling:
                return
            if not told:  # a driver that passes on one target without saying so may not have been told the end
                self._tell(plan, progress)
                told = True
