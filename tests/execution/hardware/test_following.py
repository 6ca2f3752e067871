"""A program that is interrupted at any moment, or has a slow line: the hand keeps its pace, and arrives."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import fake_driver
import numpy as np
import pytest
from fake_driver import FakeDriver
from hypothesis import example, given, settings
from hypothesis import strategies as st
from virtual_clock import VirtualClock

from clench.execution.hardware.command_check import CommandCheck, CommandLimits
from clench.execution.hardware.driver import DriverError, HandState, JointPath
from clench.execution.hardware.driver_session import DriverSession
from clench.execution.hardware.following import HORIZON, LATE, PERIOD, Followed, Follower, TimedPlan
from clench.execution.hardware.halting import halt
from clench.execution.hardware.supervision import supervision_of

#: What every look at the clock takes [s].
LOOK = 2e-5
#: Looks between two pauses, at least: a path is computed three times at most.
APART = 12
#: How finely the motion is looked at [s].
GRAIN = 0.005
#: Looks in between, and how long [s].
Pauses = list[tuple[int, float]]
PAUSES = st.lists(st.tuples(st.integers(0, 300), st.floats(0.0, 0.6)), max_size=8)
#: By the number of the command [s].
INSIDE = st.dictionaries(st.integers(0, 50), st.floats(0.0, 0.6), max_size=6)
#: A joint that goes to 3 rad in 3 s, and one to and fro.
TIMES = np.linspace(0.0, 3.0, 601)
PLAN = TimedPlan(("a", "b"), TIMES, np.stack([TIMES, np.sin(TIMES)], axis=1))
LIMITS = {name: CommandLimits(-4.0, 4.0, 1.001, 1.0, "rad") for name in PLAN.joints}
#: Less than what is planned for the time that a controller is told.
DEVIATION = 0.15


class Traced(FakeDriver):
    """Keep where the joints were all the time.

    Args:
        clock: of the test. before, after: how long the program is interrupted inside of a command, by its number,
            before and after the controller has it [s]. one_target: whether the hand goes at once to where a path is
            when the next one is due.
    """

    def __init__(
        self,
        clock: VirtualClock,
        before: Callable[[int], float] = lambda _: 0.0,
        after: Callable[[int], float] = lambda _: 0.0,
        one_target: bool = False,
    ) -> None:
        super().__init__(dict.fromkeys(PLAN.joints, 0.0))
        self.clock, self.before, self.after, self.one_target = clock, before, after, one_target
        self.samples: list[list[float]] = []
        self.seen = clock.now
        self.connected = True

    def watch(self, until: float) -> None:
        while self.seen < until:
            self.samples.append(list(self.at(self.seen).values()))
            self.seen += GRAIN

    def at(self, moment: float) -> dict[str, float]:
        return dict(self.start) if self.one_target else super().at(moment)

    def command(self, path: JointPath) -> None:
        number = len(self.commands)
        self.clock.sleep(self.before(number))
        self.watch(self.clock.now)
        interrupted, self.clock.pause = self.clock.pause, lambda: 0.0
        super().command(path)
        if self.one_target:
            self.start = path.at(path.period)
        self.clock.pause = interrupted
        self.clock.sleep(self.after(number))


def followed(
    plan: TimedPlan,
    pauses: Pauses,
    make: Callable[[VirtualClock], Traced],
    deviation: float = DEVIATION,
    settling: float = 4.0,
) -> tuple[Traced, Followed, str]:
    """Follow a plan with pauses, each so many looks at the clock after the one before; return the trouble, too."""

    def interrupted() -> Iterator[float]:
        for looks, seconds in pauses:
            for _ in range(looks + APART):
                yield LOOK
            yield seconds
        while True:
            yield LOOK

    looks = interrupted()
    clock = VirtualClock(lambda: next(looks))
    driver = make(clock)
    with pytest.MonkeyPatch.context() as patched:
        clock.use(patched, fake_driver)
        check, found, trouble = CommandCheck(LIMITS, 0.5, deviation), Followed(), ""
        session = DriverSession(driver)
        session.begin()
        try:
            Follower(session, check, settling, dict.fromkeys(plan.joints, 1e-6)).follow(plan, found)
        except DriverError as error:
            trouble = str(error)
            halt(session, check, found)
        session.close(disconnect=False)
        driver.watch(clock.now)
    return driver, found, trouble


def motions(
    pauses: Pauses, make: Callable[[VirtualClock], Traced] = Traced, deviation: float = DEVIATION
) -> np.ndarray:
    """Return how fast the hand goes along the plan at any time, 1 as planned [-], shape (N,), and check the rest."""
    driver, found, trouble = followed(PLAN, pauses, make, deviation)
    assert trouble == ""
    for name, end in PLAN.at(PLAN.duration).items():
        assert found.measured[-1][name] == pytest.approx(end, abs=1e-6)
    assert (np.diff(found.times) > 0.0).all()
    return np.diff(np.array(driver.samples)[:, 0]) / GRAIN  # the first joint is to go at 1 rad/s


@cache
def unhindered() -> int:
    return len(motions([]))


def told(inside: dict[int, float]) -> Callable[[int], float]:
    return lambda number: inside.get(number, 0.0)


@settings(deadline=None, max_examples=60)
@example(pauses=[(4, 0.5)], after={})
@given(pauses=PAUSES, after=INSIDE)
def test_pauses_while_the_controller_has_its_path_neither_hurry_nor_pull_back(
    pauses: Pauses, after: dict[int, float]
) -> None:
    gone = motions(pauses, lambda clock: Traced(clock, after=told(after)))
    assert gone.max() <= 1.02
    assert gone.min() >= -0.02


@settings(deadline=None, max_examples=60)
@example(pauses=[], before={0: 0.5, 1: 0.5}, after={})
@example(pauses=[], before={0: 0.15, 1: 0.15}, after={})
@example(pauses=[], before=dict.fromkeys(range(0, 40, 3), 0.28), after=dict.fromkeys(range(40), 0.28))
@given(pauses=PAUSES, before=INSIDE, after=INSIDE)
def test_a_pause_before_the_controller_has_its_path_hurries_little(
    pauses: Pauses, before: dict[int, float], after: dict[int, float]
) -> None:
    """It may pull the hand back, to where that was told to be: what was told is over by then."""
    gone = motions(pauses, lambda clock: Traced(clock, told(before), told(after)), deviation=2.0 * DEVIATION)
    assert gone.max() <= 2.02
    assert gone.min() >= 1.0 - HORIZON / PERIOD


@settings(deadline=None, max_examples=60)
@given(pauses=PAUSES, before=INSIDE, after=INSIDE)
def test_of_one_target_after_the_other_none_is_farther_than_planned(
    pauses: Pauses, before: dict[int, float], after: dict[int, float]
) -> None:
    driver, _, trouble = followed(PLAN, pauses, lambda clock: Traced(clock, told(before), told(after), one_target=True))
    assert trouble == ""
    steps = np.diff([path.at(PERIOD)["a"] for path in driver.commands])
    assert steps.max() <= PERIOD * 1.0001
    assert steps.min() >= -LATE - 0.001


def irregular(number: int) -> float:
    return random.Random(number).uniform(0.001, 0.049)


@pytest.mark.parametrize("inside", ["before", "after"])
@pytest.mark.parametrize("takes", [lambda _: 0.02, lambda _: 0.049, irregular], ids=["20 ms", "49 ms", "irregular"])
def test_a_line_that_takes_less_than_a_period_does_not_halt_the_hand(
    takes: Callable[[int], float], inside: str
) -> None:
    """Whether a controller has a path at once, or when it was told."""
    gone = motions([], lambda clock: Traced(clock, **{inside: takes}), deviation=0.002)  # type: ignore[arg-type]
    assert gone.max() <= 2.02
    assert gone.min() >= -0.02
    assert len(gone) < unhindered() + 0.2 / GRAIN


@pytest.mark.parametrize("inside", ["before", "after"])
@pytest.mark.parametrize("takes", [0.06, 0.15, 0.6])
def test_on_a_slower_line_the_hand_goes_and_halts(takes: float, inside: str) -> None:
    gone = motions([], lambda clock: Traced(clock, **{inside: lambda _: takes}))  # type: ignore[arg-type]
    assert gone.max() <= 1.02
    assert gone.min() >= -0.02
    assert len(gone) == pytest.approx(unhindered() * (HORIZON + takes) / HORIZON, abs=(0.4 + 2 * takes) / GRAIN)


def test_a_hand_that_stands_still_is_noticed_in_spite_of_a_slow_line() -> None:
    def stuck(clock: VirtualClock) -> Traced:
        driver = Traced(clock, before=lambda _: 0.04)
        driver.fault = lambda _: {"positions": {"a": 0.0}}
        return driver

    driver, _, trouble = followed(PLAN, [], stuck)
    assert trouble.startswith("Joint 'a' does not follow: it is at 0 rad and was told to be at 0.1")
    assert driver.stopped_after is not None
    assert driver.stopped_after < 0.5


def test_a_hand_that_runs_ahead_is_noticed() -> None:
    def running(clock: VirtualClock) -> Traced:
        driver = Traced(clock)
        driver.fault = lambda since: {"positions": {"a": 2.0 * since}}
        return driver

    driver, _, trouble = followed(PLAN, [], running)
    assert trouble.startswith("Joint 'a' does not follow")
    assert driver.stopped_after is not None
    assert driver.stopped_after < 0.3


class Aged(Traced):
    """Say where the joints were a while ago, every one by itself, and how long ago that was; one clock is ahead."""

    lags = (0.2, 0.03)
    aheads = (0.0, -0.03)

    def read(self) -> HandState:
        self.watch(self.clock.now)
        positions, ages = {}, {}
        for k, (name, lag, ahead) in enumerate(zip(self.joints, self.lags, self.aheads, strict=True)):
            steps = round(lag / GRAIN)
            positions[name] = self.samples[-steps][k] if len(self.samples) >= steps else 0.0
            ages[name] = lag + ahead
        return HandState(positions, ages)


@settings(deadline=None, max_examples=60)
@given(pauses=PAUSES, before=st.integers(0, 9), after=INSIDE)
def test_states_of_a_while_ago_are_compared_with_where_the_hand_was_to_be_then(
    pauses: Pauses, before: int, after: dict[int, float]
) -> None:
    jitter = random.Random(before)

    def make(clock: VirtualClock) -> Traced:
        return Aged(clock, lambda _: jitter.choice([0.0, 0.001, 0.02, 0.045, 0.049]) if before else 0.0, told(after))

    _, _, trouble = followed(PLAN, pauses if not before else [], make, deviation=0.025)
    assert trouble == ""


def test_a_hand_that_goes_to_a_target_at_once_is_not_ahead() -> None:
    class Servo(Aged):
        lags, aheads = (0.04, 0.04), (0.0, 0.0)

    _, _, trouble = followed(PLAN, [], lambda clock: Servo(clock, one_target=True), deviation=0.02)
    assert trouble == ""


def test_where_a_joint_is_nearest_is_found_at_turns_too() -> None:
    plan = TimedPlan(("a", "b"), np.array([0.0, 1.0, 2.0]), np.array([[0.0, 5.0], [1.0, 5.0], [0.0, 5.0]]))
    assert plan.nearest("a", 3.0, 0.5, 1.5) == 1.0
    assert plan.nearest("a", 0.7, 0.5, 1.5) == 0.7
    assert plan.nearest("a", -1.0, 0.5, 1.7) == pytest.approx(0.3)
    assert plan.nearest("b", 0.0, -np.inf, np.inf) == 5.0
    assert np.isnan(plan.nearest("a", np.nan, 0.5, 1.5))


class Short(Traced):
    """Stay short of what it is told on the way."""

    def command(self, path: JointPath) -> None:
        on_the_way = len(self.commands) < round(PLAN.duration / PERIOD)
        super().command(replace(path, positions=path.positions * 0.99) if on_the_way else path)


@pytest.mark.parametrize("stops", [False, True])
def test_a_hand_that_does_not_arrive_is_read_once_more_and_a_stop_then_is_heeded(stops: bool) -> None:
    def make(clock: VirtualClock) -> Traced:
        driver = Short(clock, after=lambda number: 0.12 if number >= round(PLAN.duration / PERIOD) else 0.0)
        if stops:
            clock.after(3.1, supervision_of(driver).stop)
        return driver

    driver, found, trouble = followed(PLAN, [], make, settling=0.05)
    assert trouble == ("Stopped on request." if stops else "")
    assert found.measured[-1]["a"] == pytest.approx(driver.at(driver.clock.now)["a"], abs=1e-3)


@pytest.mark.parametrize("looks", range(60))
def test_a_stop_is_heeded_before_anything_more_is_told(looks: int) -> None:
    """Another thread stops the hand, at any look at the clock."""
    left = [looks + 200]
    commands: list[int] = []

    def make(clock: VirtualClock) -> Traced:
        driver = Traced(clock)
        before = clock.pause

        def pause() -> float:
            left[0] -= 1
            if left[0] == 0:
                supervision_of(driver).stop()
                commands.append(len(driver.commands))
            return before()

        clock.pause = pause
        return driver

    driver, _, trouble = followed(PLAN, [], make)
    assert trouble == "Stopped on request."
    assert len(driver.commands) == commands[0]
