"""A program that is interrupted at any moment and for long: the hand goes on at its pace, or waits, and arrives."""

from __future__ import annotations

from collections.abc import Iterator

import fake_driver
import numpy as np
import pytest
from fake_driver import FakeDriver
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from virtual_clock import VirtualClock

from clench.execution.driven_hand import DrivenHand
from clench.execution.driver import JointPath
from clench.execution.executing import execute
from clench.execution.following import LATE, PERIOD
from clench.models.hand.hand import Hand
from clench.solve.solution import GraspSolution

OPEN = {"thumb": 0.0, "index": 0.0}
#: What every look at the clock takes [s].
LOOK = 2e-5
#: Looks between two pauses, at least: a path is computed three times at most.
APART = 12
#: How finely the motion is looked at [s].
GRAIN = 0.005
PAUSES = st.lists(st.tuples(st.integers(0, 60), st.floats(0.0, 0.6)), max_size=12)


class Traced(FakeDriver):
    """Keep where the joints were all the time.

    Args:
        clock: of the test. before, after: how long the program is interrupted inside of a command, by its number,
            before and after the controller has it [s].
    """

    def __init__(self, clock: VirtualClock, before: dict[int, float], after: dict[int, float]) -> None:
        super().__init__(OPEN)
        self.clock, self.before, self.after = clock, before, after
        self.samples: list[list[float]] = []
        self.seen = clock.now

    def watch(self, until: float) -> None:
        while self.seen < until:
            self.samples.append(list(self.at(self.seen).values()))
            self.seen += GRAIN

    def command(self, path: JointPath) -> None:
        number = len(self.commands)
        self.clock.sleep(self.before.get(number, 0.0))
        self.watch(self.clock.now)
        interrupted, self.clock.pause = self.clock.pause, lambda: 0.0
        super().command(path)
        self.clock.pause = interrupted
        self.clock.sleep(self.after.get(number, 0.0))


def motions(
    hand: Hand, solution: GraspSolution, pauses: list[tuple[int, float]], **inside: dict[int, float]
) -> np.ndarray:
    """Carry a solution out with pauses, each so many looks at the clock after the one before, and return how far every
    joint goes within a period at any time [rad], shape (N, J), in shares of what it may.
    """

    def interrupted() -> Iterator[float]:
        for looks, seconds in pauses:
            for _ in range(looks + APART):
                yield LOOK
            yield seconds
        while True:
            yield LOOK

    looks = interrupted()
    clock = VirtualClock(lambda: next(looks))
    driver = Traced(clock, inside.get("before", {}), inside.get("after", {}))
    with pytest.MonkeyPatch.context() as patched:
        clock.use(patched, fake_driver)
        report = execute(solution, DrivenHand(hand, driver, max_deviation=np.inf), speed=0.5)
        driver.watch(clock.now)
    assert report.success, report.reason
    for name in OPEN:
        assert driver.commands[-1].at(1.0)[name] == pytest.approx(solution.joint_angles[name], abs=1e-9)
    samples = np.array(driver.samples)
    span = round(PERIOD / GRAIN)
    return np.asarray((samples[span:] - samples[:-span]) / (0.5 * PERIOD * np.array([3.0, 2.0])))


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(pauses=[(4, 0.5)], after={})
@given(pauses=PAUSES, after=st.dictionaries(st.integers(0, 30), st.floats(0.0, 0.6), max_size=4))
def test_pauses_outside_of_telling_neither_hurry_nor_pull_back(
    pincer: Hand, pinch: GraspSolution, pauses: list[tuple[int, float]], after: dict[int, float]
) -> None:
    gone = motions(pincer, pinch, pauses, after=after)
    late = (LATE + GRAIN) / PERIOD
    assert gone.max() <= 1.0 + late
    assert gone.min() >= -late


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pauses=PAUSES, before=st.dictionaries(st.integers(0, 30), st.floats(0.0, 0.6), max_size=4))
def test_no_pause_hurries_a_hand(
    pincer: Hand, pinch: GraspSolution, pauses: list[tuple[int, float]], before: dict[int, float]
) -> None:
    """A pause between a driver's call and its controller may pull it back: what was told is over by then."""
    gone = motions(pincer, pinch, pauses, before=before)
    # Told at most a period late without notice, it makes up for that.
    assert gone.max() <= 2.0 + (LATE + GRAIN) / PERIOD
