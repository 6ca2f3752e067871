"""The next steps of a driven hand: after the squeeze, inside every limit, checked before anything moves, stopped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_driver import FakeDriver

from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.hardware.driver import DriverError, DriverLimits
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

OPEN = {"thumb": 0.0, "index": 0.0}
pytestmark = pytest.mark.usefixtures("clock")
OFFSETS = {"thumb": 0.05, "index": 0.03, "index_tip": 0.03}
SQUEEZE = {"feasible": True, "text": "Holds 0.1 kg.", "offsets": OFFSETS}


def run(
    driver: FakeDriver, hand: Hand, pinch: GraspSolution, *steps: dict[str, float], **options: float
) -> ExecutionReport:
    solution = replace(pinch, squeeze=SQUEEZE, next_steps=steps)
    return execute(solution, HardwareHand(hand, driver, **options))  # type: ignore[arg-type]


def test_steps_come_after_the_squeeze_and_the_other_finger_goes_on_pressing(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    report = run(driver, pincer, pinch, {"thumb": 0.1}, {"thumb": 0.0})
    assert report.success, report.reason
    assert [step.reached for step in report.next_steps] == [True, True]
    assert driver.where()["thumb"] == pytest.approx(0.0, abs=1e-6)
    assert driver.where()["index"] == pytest.approx(pinch.joint_angles["index"] + 0.03, abs=1e-6)
    assert max(path.positions[:, 0].max() for path in driver.commands) == pytest.approx(
        pinch.joint_angles["thumb"] + 0.05
    )
    for name in OPEN:  # the report's angles are those of the touch
        assert report.joints[name].reached == pytest.approx(pinch.joint_angles[name], abs=0.01)
    first = report.next_steps[0]
    assert set(first.joints) == {"thumb"}
    assert first.joints["thumb"].computed == 0.1
    assert first.joints["thumb"].reached == pytest.approx(0.1, abs=0.01)
    assert (first.touching, first.held, first.motion) == (None, None, None)
    history = report.history
    assert history is not None
    assert (np.diff(history.times) > 0.0).all()
    assert report.duration == history.times[-1]
    np.testing.assert_allclose(history.measured[-1], [0.0, pinch.joint_angles["index"] + 0.03], atol=0.01)


def test_without_a_squeeze_joints_stay_at_the_touch(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    assert run(driver, pincer, pinch, {"thumb": 0.1}, squeeze=0.0).success
    assert driver.where()["index"] == pytest.approx(pinch.joint_angles["index"], abs=1e-6)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"positions": {"thumb": (0.0, 0.8)}}, "Next step 2: Joint 'thumb' would be told 0.9 rad, outside its limits"),
        ({"positions": {"index": (0.0, 0.45)}}, "Next step 1: Joint 'index' would be told 0.5 rad"),
    ],
)
def test_a_step_beyond_the_controllers_limits_is_told_before_anything_moves(
    pincer: Hand, pinch: GraspSolution, limits: dict[str, dict[str, tuple[float, float]]], message: str
) -> None:
    driver = FakeDriver(OPEN, DriverLimits(**limits))
    report = run(driver, pincer, pinch, {"index": 0.5}, {"thumb": 0.9})
    assert not report.success
    assert report.reason.startswith(f"Not carried out: {message}")
    assert driver.commands == []


def test_steps_are_no_faster_than_the_controller_allows(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN, DriverLimits(velocities={"index": 0.3}))
    report = run(driver, pincer, pinch, {"index": 0.0, "thumb": 0.0})
    assert report.success, report.reason
    for path in driver.commands:
        column = path.joints.index("index")
        assert (np.abs(np.diff(path.positions[:, column])) / np.diff(path.times) <= 0.3 * (1 + 1e-6)).all()


def test_a_line_that_is_cut_on_the_way_to_a_step_stops_the_hand(pincer: Hand, pinch: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    seen: list[float] = []

    def cut(_: float) -> dict[str, object]:
        seen.append(driver.where()["thumb"])
        if max(seen) > pinch.joint_angles["thumb"] and seen[-1] < 0.2:
            raise DriverError("The line is cut.")
        return {}

    driver.fault = cut
    report = run(driver, pincer, pinch, {"thumb": 0.0}, {"index": 0.0})
    assert not report.success
    assert "On the way to next step 1: The line is cut. The hand was told to stop" in report.reason
    assert driver.stops == 1
    assert driver.where()["index"] == pytest.approx(pinch.joint_angles["index"] + 0.03, abs=1e-6)
    assert any("The last 1 of 2 next steps were not carried out" in note for note in report.notes)


def test_a_joint_that_does_not_arrive_is_told(pincer: Hand, pinch: GraspSolution) -> None:
    """The thumb sticks near the touch, less far from its way than would be a fault."""
    driver = FakeDriver(OPEN)
    stuck = pinch.joint_angles["thumb"]
    begun: list[bool] = []

    def stick(_: float) -> dict[str, object]:
        at = driver.where()["thumb"]
        begun.append(at > pinch.joint_angles["thumb"] + 0.04)
        return {"positions": {"thumb": max(at, stuck)}} if any(begun) else {}

    driver.fault = stick
    report = run(driver, pincer, pinch, {"thumb": stuck - 0.2}, settling=0.2)
    assert not report.success
    assert "Next step 1 was not reached: joint 'thumb' is 0.2 rad from its angle; tolerance 0.05 rad." in report.reason
    assert report.next_steps[0].joints["thumb"].reached == pytest.approx(stuck)
