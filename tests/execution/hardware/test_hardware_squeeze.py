"""The squeeze of a driven hand: beyond the touch once it was reached, inside the limits, stopped like any motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_driver import FakeDriver

from clench.core.exceptions import CommandError
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.hardware.driver import DriverError, DriverLimits
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

OPEN = {"thumb": 0.0, "index": 0.0}
pytestmark = pytest.mark.usefixtures("clock")
OFFSETS = {"thumb": 0.05, "index": 0.03, "index_tip": 0.03}


def squeezed(pinch: GraspSolution, **changes: object) -> GraspSolution:
    return replace(pinch, squeeze={"feasible": True, "text": "Holds 0.1 kg.", "offsets": OFFSETS, **changes})


def run(driver: FakeDriver, hand: Hand, solution: GraspSolution, **options: float) -> ExecutionReport:
    return execute(solution, HardwareHand(hand, driver, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_joints_end_beyond_the_touch_and_the_touch_is_what_is_reported(
    pincer: Hand, pinch: GraspSolution, share: float
) -> None:
    driver = FakeDriver(OPEN)
    report = run(driver, pincer, squeezed(pinch), squeeze=share)
    assert report.success, report.reason
    for name in OPEN:
        touch = pinch.joint_angles[name]
        assert driver.commands[-1].positions[-1][driver.joints.index(name)] == pytest.approx(
            touch + share * OFFSETS[name]
        )
        assert report.joints[name].reached == pytest.approx(touch, abs=0.01)
    assert f"up to {share * 0.05:.3g} rad beyond the touch" in " ".join(report.notes)


def test_without_a_plan_or_a_share_nothing_is_squeezed(pincer: Hand, pinch: GraspSolution) -> None:
    for solution, options in ((pinch, {}), (squeezed(pinch), {"squeeze": 0.0})):
        driver = FakeDriver(OPEN)
        report = run(driver, pincer, solution, **options)
        assert report.success
        assert driver.where()["thumb"] == pytest.approx(pinch.joint_angles["thumb"], abs=1e-6)
        assert not any("queeze" in note for note in report.notes)


def test_joints_whose_servo_gain_is_not_known_are_named(pincer: Hand, pinch: GraspSolution) -> None:
    torques = {"thumb": 0.1, "index": 0.2}
    notes = run(FakeDriver(OPEN), pincer, squeezed(pinch, torques=torques, offsets={})).notes
    assert any("There was no squeeze: the hand's model gives no servo gain of 'thumb', 'index'" in n for n in notes)
    notes = run(FakeDriver(OPEN), pincer, squeezed(pinch, torques=torques, offsets={"thumb": 0.05})).notes
    assert any("Not all of it was told: the hand's model gives no servo gain of 'index'" in n for n in notes)


def test_a_squeeze_that_does_not_hold_is_not_told(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    report = run(driver, pincer, squeezed(pinch, feasible=False, text="No squeeze holds 0.1 kg."))
    assert report.success
    assert "There was no squeeze: No squeeze holds 0.1 kg." in report.notes
    assert driver.where()["thumb"] == pytest.approx(pinch.joint_angles["thumb"], abs=1e-6)


def test_a_squeeze_beyond_a_limit_is_refused_before_it_is_sent(pincer: Hand, pinch: GraspSolution) -> None:
    limit = pinch.joint_angles["thumb"] + 0.02
    driver = FakeDriver(OPEN, DriverLimits(positions={"thumb": (-1.0, limit)}))
    report = run(driver, pincer, squeezed(pinch))
    assert report.success
    assert any("There was no squeeze: Joint 'thumb' would be told" in note for note in report.notes)
    assert max(path.positions[:, 0].max() for path in driver.commands) <= limit


def test_it_is_no_faster_than_the_limits(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN, DriverLimits(velocities={"thumb": 0.1}))
    report = run(driver, pincer, squeezed(pinch))
    assert report.success, report.reason
    for path in driver.commands:
        assert (np.abs(np.diff(path.positions[:, 0])) / np.diff(path.times) <= 0.1 * (1 + 1e-6)).all()


def test_a_line_that_is_cut_while_squeezing_stops_the_hand(pincer: Hand, pinch: GraspSolution) -> None:
    end = pinch.joint_angles["thumb"] + 0.02
    driver = FakeDriver(OPEN)

    def cut(_: float) -> dict[str, object]:
        if driver.where()["thumb"] > end:
            raise DriverError("The line is cut.")
        return {}

    driver.fault = cut
    report = run(driver, pincer, squeezed(pinch))
    assert not report.success
    assert report.reason.startswith("While squeezing: The line is cut. The hand was told to stop")
    assert driver.stops == 1


@pytest.mark.parametrize("share", [-1.0, np.nan, np.inf])
def test_a_share_that_makes_no_sense(pincer: Hand, share: float) -> None:
    with pytest.raises(CommandError, match="squeeze: expected a finite number of at least 0"):
        HardwareHand(pincer, FakeDriver(OPEN), squeeze=share)
