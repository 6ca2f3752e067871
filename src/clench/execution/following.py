"""Follow a timed plan on a controller, never further ahead than a short horizon, and stop on any trouble.

A controller is only ever told the next fraction of a second. When this program, its machine or the connection fails,
no more arrives, and the hand stands still at the end of what it was told.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from clench.base.pose import FloatArray

from .command_check import CommandCheck
from .driver import DriverError, HandDriver, HandState, JointPath, OneTargetDriver

#: How often the controller is read and told more [s].
PERIOD = 0.05
#: How far ahead it is told [s]: how long a hand moves on after its connection was cut.
HORIZON = 0.3
_TOLD_NOTHING = f"it was told nothing beyond {HORIZON:g} s"
#: How long after its moment a path may be told [s]; what takes longer is a pause of this program.
LATE = 0.2 * PERIOD
#: How often a path is computed again that a pause made late.
_TRIES = 3
#: Points of a path that are closer than this are one [s].
CLOSEST = 1e-4
#: How long is waited for a hand to stand still after a stop [s].
STOP_WAIT = 1.0
#: A joint stands still when it is slower than this fraction of its largest speed [-].
STILL = 0.05


@dataclass(frozen=True, eq=False)
class TimedPlan:
    """Hold way-points in a controller's names and units; between two of them joints move at constant speed.

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

    def window(self, moment: float, horizon: float) -> JointPath:
        """Return the way-points of the next `horizon` [s], with times from `moment` [s] on."""
        inside = self.times[(self.times > moment + CLOSEST) & (self.times < moment + horizon - CLOSEST)] - moment
        # Where it is when the next path is due, so that a driver that passes that on finds it.
        due = [PERIOD] if horizon - CLOSEST > PERIOD and (np.abs(inside - PERIOD) > CLOSEST).all() else []
        times = np.sort(np.concatenate([inside, due, [horizon]]))
        positions = np.stack([np.interp(moment + times, self.times, column) for column in self.positions.T], axis=1)
        return JointPath(joints=self.joints, times=times, positions=positions, period=PERIOD)


@dataclass
class Followed:
    """Collect what happened: samples of commanded and measured positions, and why it ended early.

    Args:
        times: of the samples [s]. commanded, measured: by the controller's names and units.
        trouble: one sentence, None when the plan was followed to its end. stopped: whether the hand was seen to stand
            still after a stop; None when none was sent.
    """

    times: list[float] = field(default_factory=list)
    commanded: list[Mapping[str, float]] = field(default_factory=list)
    measured: list[Mapping[str, float]] = field(default_factory=list)
    trouble: str | None = None
    stopped: bool | None = None

    def ending(self) -> str:
        """Say why it ended early, and whether the hand was seen to stand still; empty when it did not."""
        if self.trouble is None:
            return ""
        told = "it was seen to stand still" if self.stopped else f"that was not confirmed; {_TOLD_NOTHING}"
        return f"{self.trouble} The hand was told to stop: {told}."

    def sample(self, moment: float, commanded: Mapping[str, float], state: HandState) -> None:
        """Keep one sample."""
        self.times.append(moment)
        self.commanded.append(commanded)
        self.measured.append(state.positions)


@dataclass
class _Progress:
    """Keep how far along a plan a hand is, by what it was told last.

    Args:
        ahead: how far it goes on along one path [s]. due: when the next path is to be told, by the clock [s].
    """

    ahead: float
    due: float = 0.0
    _begin: float = 0.0
    _told: float | None = None

    def moment(self) -> float:
        """Return where on the plan the hand is [s]: after a pause, at the end of what it was told."""
        if self._told is None:
            return self._begin
        return self._begin + min(time.monotonic() - self._told, self.ahead)

    def told(self, moment: float, before: float, after: float) -> None:
        """Note a path from a moment of the plan [s], and when the controller was told it: between two times."""
        self._begin, self._told = moment, before
        # Where telling took long, nobody knows how far along its path the hand is: it comes to its end.
        self.due = before + PERIOD if after - before <= PERIOD else after + self.ahead


@dataclass(frozen=True)
class Follower:
    """Make a controller follow plans.

    Args:
        driver: connected. check: what every command and state must pass. stopping: set to stop it from elsewhere.
        settling: how long the hand may take to arrive after the plan's end [s].
        arrived: how near to its target every joint shall be, by the controller's names and in its units.
    """

    driver: HandDriver
    check: CommandCheck
    stopping: threading.Event
    settling: float
    arrived: Mapping[str, float]

    def follow(self, plan: TimedPlan) -> Followed:
        """Follow a plan to its end, or stop the hand and say why; a stop is sent whatever is raised here."""
        found = Followed()
        try:
            self._move(plan, found)
            self._settle(plan, found)
        except DriverError as error:
            found.trouble = str(error)
            found.stopped = self._stop(found)
        except Exception as error:  # drivers are others' code: whatever they raise, the hand is stopped
            found.trouble = f"The driver failed ({type(error).__name__}: {error})."
            found.stopped = self._stop(found)
        except BaseException:
            self._stop(found, wait=0.0)
            raise
        return found

    def _move(self, plan: TimedPlan, found: Followed) -> None:
        one_target = isinstance(self.driver, OneTargetDriver) and self.driver.one_target
        begun, progress = time.monotonic(), _Progress(PERIOD if one_target else HORIZON)
        while True:
            state = self.driver.read()
            moment = progress.moment()
            expected = plan.at(moment)
            self.check.state(state, plan.at(moment - state.age(plan.joints)))
            found.sample(time.monotonic() - begun, expected, state)
            if self.stopping.is_set():
                raise DriverError("Stopped on request.")
            if moment >= plan.duration:
                return
            self._tell(plan, progress)
            self.stopping.wait(max(0.0, progress.due - time.monotonic()))

    def _tell(self, plan: TimedPlan, progress: _Progress) -> None:
        """Tell what comes next, computed anew where a pause made it late: it would pull the hand back."""
        for _ in range(_TRIES):
            seen, moment = time.monotonic(), progress.moment()
            path = self._path(plan, moment)
            told = time.monotonic()
            if told - seen <= LATE:
                break
        self.driver.command(path)
        progress.told(moment, told, time.monotonic())

    def _path(self, plan: TimedPlan, moment: float) -> JointPath:
        path = plan.window(moment, HORIZON)
        self.check.command(path, plan.at(moment))
        return path

    def _settle(self, plan: TimedPlan, found: Followed) -> None:
        begun, before, told = time.monotonic(), found.times[-1], False
        end = plan.at(plan.duration)
        while time.monotonic() - begun < self.settling:
            self.stopping.wait(PERIOD)
            if self.stopping.is_set():
                raise DriverError("Stopped on request.")
            state = self.driver.read()
            self.check.state(state, end)
            found.sample(before + time.monotonic() - begun, end, state)
            if all(abs(state.positions[name] - end[name]) <= near for name, near in self.arrived.items()):
                return
            if not told:  # a driver that passes on one target without saying so may not have been told the end
                self.driver.command(self._path(plan, plan.duration))
                told = True

    def _stop(self, found: Followed, wait: float = STOP_WAIT) -> bool:
        """Stop the hand; return whether it was seen to stand still, and keep where it stands."""
        try:
            self.driver.stop()
            until, before = time.monotonic() + wait, None
            while time.monotonic() < until:
                time.sleep(2.0 * PERIOD)
                state = self.driver.read()
                fresh = state.age(self.check.limits) <= 2.0 * PERIOD
                if fresh and before is not None and self._still(before, state):
                    if found.times:
                        found.sample(found.times[-1] + wait - (until - time.monotonic()), found.commanded[-1], state)
                    return True
                before = state if fresh else None
        except Exception:  # as above
            return False
        return False

    def _still(self, before: HandState, state: HandState) -> bool:
        nowhere = float("nan")  # is never still
        return all(
            abs(state.positions.get(name, nowhere) - before.positions.get(name, nowhere))
            <= STILL * limits.velocity * 2.0 * PERIOD
            for name, limits in self.check.limits.items()
        )
