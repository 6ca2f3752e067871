"""A real hand's supervision: followed to the end, or stopped with the reason; nothing wrong is ever sent."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fake_driver import FakeDriver
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from virtual_clock import VirtualClock

from clench.core.exceptions import CommandError, UnknownNameError
from clench.execution import executing
from clench.execution.executing import execute
from clench.execution.hardware import hardware_hand as driven_hand
from clench.execution.hardware.driver import DriverError, DriverLimits, HandState, JointPath
from clench.execution.hardware.following import HORIZON, PERIOD, TimedPlan
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.hardware.joint_map import JointMap, MappedJoint
from clench.models.hand.hand import Hand
from clench.models.hand.reading.tendons import TendonMap
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

OPEN = {"thumb": 0.0, "index": 0.0}
pytestmark = pytest.mark.usefixtures("clock")


@pytest.fixture
def solution(pinch: GraspSolution) -> GraspSolution:
    return pinch


def run(driver: FakeDriver, hand: Hand, solution: GraspSolution, speed: float = 1.0, **options: object):
    return execute(solution, HardwareHand(hand, driver, **options), speed=speed)  # type: ignore[arg-type]


def test_a_trajectory_is_followed_to_its_end(pincer: Hand, solution: GraspSolution, ball: GraspObject) -> None:
    driver = FakeDriver(OPEN)
    report = run(driver, pincer, solution, obj=ball)
    assert report.success, report.reason
    assert driver.stops == 0
    assert not driver.connected
    assert set(report.joints) == {"thumb", "index"}  # the coupled tip is moved by its leader
    for name, joint in report.joints.items():
        assert joint.computed == solution.joint_angles[name]
        assert driver.where()[name] == pytest.approx(joint.computed, abs=1e-9)
    assert report.history is not None
    np.testing.assert_allclose(report.history.measured[0], 0.0)
    assert (np.diff(report.history.times) > 0).all()
    assert report.to_dict()["history"]["joints"] == ["thumb", "index"]


def test_no_command_reaches_beyond_the_horizon_and_all_are_slow_enough(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver({"thumb": 0.4, "index": 0.3})  # first back to the open hand
    report = run(driver, pincer, solution)
    assert report.success, report.reason
    assert "0.4 rad at most" in report.notes[0]
    for path in driver.commands:
        assert path.times[-1] == pytest.approx(HORIZON)
        steps = np.abs(np.diff(path.positions, axis=0)) / np.diff(path.times)[:, None]
        assert (steps <= np.array([3.0, 2.0]) * (1 + 1e-6)).all()
    lowest = min(path.positions[:, 0].min() for path in driver.commands)
    assert lowest == pytest.approx(0.0, abs=1e-12)


class Servos(FakeDriver):
    """Go at once to where a path is when the next one is due; `pause` is how long the program stops after a path."""

    def __init__(self, joints: dict[str, float], pause: Callable[[JointPath], float]) -> None:
        super().__init__(joints)
        self.pause = pause

    def where(self) -> dict[str, float]:
        return self.start

    def command(self, path: JointPath) -> None:
        super().command(path)
        self.start = {**self.start, **path.at(path.period)}
        time.sleep(self.pause(path))


def test_servos_arrive_when_the_program_pauses_before_the_end(pincer: Hand, solution: GraspSolution) -> None:
    end = np.array([solution.joint_angles[name] for name in OPEN])
    driver = Servos(OPEN, lambda path: 0.4 if np.allclose(path.positions[-1], end, atol=1e-9) else 0.0)
    report = run(driver, pincer, solution)
    assert report.success, report.reason
    for name in OPEN:
        assert driver.where()[name] == pytest.approx(solution.joint_angles[name], abs=1e-9)


@pytest.mark.parametrize("one_target", [True, False])
def test_after_a_pause_servos_go_on_from_the_target_they_were_told(
    pincer: Hand, solution: GraspSolution, one_target: bool
) -> None:
    driver = Servos(OPEN, lambda _: 0.15)
    driver.one_target = one_target  # type: ignore[attr-defined]
    assert run(driver, pincer, solution).success
    targets = np.array([list(path.at(path.period).values()) for path in driver.commands])
    fastest = np.abs(np.diff(targets, axis=0)).max(axis=0) / PERIOD
    paths = [path for path in driver.commands if len(path.times) > 1]
    rates = [np.abs(np.diff(path.positions, axis=0)) / np.diff(path.times)[:, None] for path in paths]
    planned = max((rate.max() for rate in rates), default=0.0)
    assert (fastest.max() <= planned * (1.0 + 1e-6)) == one_target


@given(
    st.lists(st.floats(0.001, 0.2), min_size=1, max_size=8),
    st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9),
    st.floats(0.0, 1.0),
)
def test_a_path_tells_where_the_plan_is_at_any_time_until_its_end(
    steps: list[float], angles: list[float], begin: float
) -> None:
    times = np.concatenate([[0.0], np.cumsum(steps)])
    plan = TimedPlan(("thumb",), times, np.array(angles[: len(times)])[:, None])
    moment = begin * plan.duration
    path = plan.window(moment, HORIZON)
    assert (np.diff(path.times) > 0.0).all()
    fastest = np.abs(np.diff(plan.positions[:, 0]) / np.diff(times)).max()
    for time_ahead in np.linspace(PERIOD, HORIZON, 23):
        # Way-points that are next to the begin or the end of the path are left out.
        there = plan.at(moment + time_ahead)["thumb"]
        assert path.at(time_ahead)["thumb"] == pytest.approx(there, abs=3e-4 * fastest + 1e-12)


def test_servos_keep_to_the_speed_of_a_plan_of_few_points(pincer: Hand, solution: GraspSolution) -> None:
    """The way back to the open hand has nine points, farther apart than a path is due."""
    driver = Servos({"thumb": 1.4, "index": 1.05}, lambda _: 0.0)
    driver.one_target = True  # type: ignore[attr-defined]
    report = run(driver, pincer, solution, speed=0.3, max_deviation=2.0)
    assert report.success, report.reason
    targets = np.array([list(path.at(path.period).values()) for path in driver.commands])
    rates = [np.abs(np.diff(path.positions, axis=0)) / np.diff(path.times)[:, None] for path in driver.commands]
    planned = max((rate.max() for rate in rates if len(rate)), default=0.0)
    assert np.abs(np.diff(targets, axis=0)).max() / PERIOD <= planned * (1.0 + 1e-6)


def test_other_names_units_offsets_and_directions(pincer: Hand, solution: GraspSolution) -> None:
    deg = 180.0 / np.pi
    joint_map = JointMap(
        {
            "thumb": MappedJoint("T1", scale=-deg, offset=90.0, unit="deg"),
            "index": MappedJoint("I1", scale=2048 / np.pi, offset=2048.0, unit="units"),
        }
    )
    driver = FakeDriver({"T1": 90.0, "I1": 2048.0, "arm": 1.0})
    report = run(driver, pincer, solution, joint_map=joint_map)
    assert report.success, report.reason
    where = driver.where()
    assert where["T1"] == pytest.approx(90.0 - deg * solution.joint_angles["thumb"])
    assert where["I1"] == pytest.approx(2048.0 + 2048 / np.pi * solution.joint_angles["index"])
    assert report.joints["thumb"].reached == pytest.approx(solution.joint_angles["thumb"])


def test_a_slower_controller_gets_a_slower_path(pincer: Hand, solution: GraspSolution) -> None:
    fast = run(FakeDriver(OPEN), pincer, solution)
    driver = FakeDriver(OPEN, DriverLimits(velocities={"thumb": 0.25}))
    slow = run(driver, pincer, solution)
    assert slow.success, slow.reason
    assert slow.duration > 1.5 * fast.duration
    for path in driver.commands:
        assert (np.abs(np.diff(path.positions[:, 0])) <= 0.25 * np.diff(path.times) * (1.0 + 1e-6) + 1e-12).all()


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (
            lambda t: {"age": t} if t > 0.2 else {},
            r"state of joint 'thumb' is stale: 0\.\d+ s old; at most 0\.15 s",
        ),
        (lambda t: {"age": -0.01} if t > 0.2 else {}, r"state of joint 'thumb' is -0\.01 s old, from the future; are"),
        (lambda t: {"positions": {"index": np.nan}} if t > 0.2 else {}, r"Joint 'index' is said to be at nan rad\."),
        (lambda t: {"positions": {"index": None}} if t > 0.2 else {}, r"says nothing of joint 'index'\."),
        (lambda t: {"positions": {"thumb": 0.0}}, r"Joint 'thumb' does not follow: it is at 0 rad and was told to be"),
    ],
    ids=["stale", "future", "nan", "absent", "stuck"],
)
def test_trouble_on_the_way_stops_the_hand(pincer: Hand, solution: GraspSolution, fault: object, reason: str) -> None:
    driver = FakeDriver(OPEN, fault=fault)  # type: ignore[arg-type]
    begun = time.monotonic()
    report = run(driver, pincer, solution, speed=0.3, max_age=0.15, max_deviation=0.1)
    assert not report.success
    assert time.monotonic() - begun < 5.0
    assert re.search(reason, report.reason), report.reason
    assert "The hand was told to stop" in report.reason
    assert driver.stops == 1
    sent = len(driver.commands)
    assert driver.where()["thumb"] < 0.9 * solution.joint_angles["thumb"]
    time.sleep(2 * PERIOD)
    assert len(driver.commands) == sent


def test_a_state_from_the_future_confirms_no_stop(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver(OPEN, fault=lambda t: {"age": -0.01} if t > 0.2 else {})
    report = run(driver, pincer, solution, speed=0.3)
    assert "The hand was told to stop: that was not confirmed" in report.reason


def test_nothing_is_sent_to_a_hand_whose_state_is_from_the_future(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver(OPEN, fault=lambda _: {"age": -5.0})
    report = run(driver, pincer, solution)
    assert report.reason.startswith("Not carried out: The state of joint 'thumb' is -5 s old, from the future")
    assert (driver.commands, driver.stops) == ([], 0)


def test_a_controller_that_fails_stops_the_hand(pincer: Hand, solution: GraspSolution) -> None:
    def fault(t: float) -> dict[str, object]:
        if t > 0.2:
            raise DriverError("The line is dead.")
        return {}

    driver = FakeDriver(OPEN, fault=fault)
    report = run(driver, pincer, solution, speed=0.3)
    assert report.reason.startswith("The line is dead. The hand was told to stop: that was not confirmed")
    assert driver.stops == 1


def test_drivers_may_raise_anything(pincer: Hand, solution: GraspSolution) -> None:
    def fault(t: float) -> dict[str, object]:
        if t > 0.2:
            raise OSError("no such device")
        return {}

    driver = FakeDriver(OPEN, fault=fault)
    driver.disconnect = lambda: 1 / 0  # type: ignore[method-assign]
    report = run(driver, pincer, solution, speed=0.3)
    assert report.reason.startswith("The driver failed (OSError: no such device). The hand was told to stop")
    assert driver.stops == 1
    driver = FakeDriver(OPEN)
    driver.connect = lambda _: {}["port"]  # type: ignore[method-assign]
    report = run(driver, pincer, solution)
    assert report.reason == "Not carried out: The driver failed (KeyError: 'port')."


def test_a_driver_that_lacks_members_is_refused_at_once(pincer: Hand) -> None:
    class Bare:
        def connect(self, timeout: float) -> None: ...
        def read(self) -> None: ...
        def disconnect(self) -> None: ...

    message = (
        "driver: Bare lacks 'name', 'command', 'stop'; "
        "a driver has name, joints, limits, connect, read, command, stop, disconnect."
    )
    with pytest.raises(CommandError, match=f"^{re.escape(message)}$"):
        HardwareHand(pincer, Bare())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("member", "value", "message"),
    [
        ("joints", None, "joints of FakeDriver: expected names of joints once connected, got None."),
        ("joints", "thumb", "joints of FakeDriver: expected names of joints once connected, got 'thumb'."),
        ("limits", {}, "limits of FakeDriver: expected DriverLimits once connected, got {}."),
        ("read", lambda: {"thumb": 0.0}, "read() of FakeDriver: expected a HandState, got {'thumb': 0.0}."),
        ("read", lambda: None, "read() of FakeDriver: expected a HandState, got None."),
    ],
)
def test_wrong_values_of_a_driver_are_told(
    pincer: Hand, solution: GraspSolution, member: str, value: object, message: str
) -> None:
    driver = FakeDriver(OPEN)
    setattr(driver, member, value)
    report = run(driver, pincer, solution)
    assert report.reason.startswith(f"Not carried out: {message}")
    assert driver.commands == []
    assert not driver.connected


def test_members_that_come_with_the_connection(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    del driver.joints, driver.limits

    def connect(timeout: float) -> None:
        driver.joints, driver.limits, driver.connected = tuple(OPEN), DriverLimits(), True

    driver.connect = connect  # type: ignore[method-assign]
    report = run(driver, pincer, solution)
    assert report.success, report.reason


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"thumb": 0.0}, "expected a HandState, got {'thumb': 0.0}."),
        (HandState([0.0, 0.0]), "positions: expected numbers by joint, got [0.0, 0.0]."),  # type: ignore[arg-type]
        (HandState({"thumb": "0", "index": 0.0}), "positions of joint 'thumb': expected a number, got '0'."),  # type: ignore[dict-item]
        (HandState(OPEN, {"thumb": None}), "ages of joint 'thumb': expected a number, got None."),  # type: ignore[dict-item]
    ],
)
def test_a_wrong_state_on_the_way_stops_the_hand(
    pincer: Hand, solution: GraspSolution, clock: VirtualClock, state: object, message: str
) -> None:
    driver = FakeDriver(OPEN)
    read = driver.read
    driver.read = lambda: read() if len(driver.commands) < 4 else state  # type: ignore[method-assign, assignment, return-value]
    hand = HardwareHand(pincer, driver)
    report = execute(solution, hand, speed=0.3)
    assert not report.success
    assert report.reason.startswith(f"read() of FakeDriver: {message} The hand was told to stop")
    assert driver.stops >= 1
    assert hand.state == "faulted"


def test_a_stop_from_another_thread(pincer: Hand, solution: GraspSolution, clock: VirtualClock) -> None:
    driver = FakeDriver(OPEN)
    hand = HardwareHand(pincer, driver)
    clock.after(0.3, hand.stop)
    report = execute(solution, hand, speed=0.2)
    assert report.reason.startswith("Stopped on request. The hand was told to stop: it was seen to stand still")
    assert report.joints["thumb"].reached < 0.9 * solution.joint_angles["thumb"]
    assert driver.stopped_after == pytest.approx(0.3, abs=PERIOD)


def test_a_stop_while_the_trajectory_is_planned_is_heeded(
    pincer: Hand, solution: GraspSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = FakeDriver(OPEN)
    hand = HardwareHand(pincer, driver)
    plan = executing.plan_trajectory
    monkeypatch.setattr(executing, "plan_trajectory", lambda *a, **k: [hand.stop(), plan(*a, **k)][1])
    report = execute(solution, hand)
    assert report.reason == "Not carried out: A stop is in force (Stopped on request); release it with release_stop()."
    assert report.sent is not None
    assert report.sent.commands == 0
    assert driver.commands == []
    monkeypatch.undo()
    hand.release_stop()
    assert execute(solution, hand).success


def test_an_interrupt_stops_the_hand_and_goes_on(pincer: Hand, solution: GraspSolution) -> None:
    def fault(t: float) -> dict[str, object]:
        if t > 0.1:
            raise KeyboardInterrupt
        return {}

    driver = FakeDriver(OPEN, fault=fault)
    hand = HardwareHand(pincer, driver)
    with pytest.raises(KeyboardInterrupt):
        execute(solution, hand, speed=0.3)
    assert driver.stops == 1
    assert not driver.connected
    report = hand.last_report
    assert report is not None
    assert report.reason.startswith(
        "Interrupted (KeyboardInterrupt). The hand was told to stop: that was not confirmed"
    )
    assert report.history is not None
    assert len(report.history.times) > 1
    count = len(driver.commands)
    assert any(note.startswith(f"{count} commands were sent; the last one came 0.1") for note in report.notes)


def test_nothing_moves_when_the_plan_breaks_a_limit(pincer: Hand, solution: GraspSolution) -> None:
    narrow = DriverLimits(positions={"thumb": (0.0, 0.2)})
    driver = FakeDriver(OPEN, narrow)
    report = run(driver, pincer, solution)
    assert report.reason.startswith("Not carried out: Joint 'thumb' would be told 0.2")
    assert "outside its limits [0, 0.2] rad" in report.reason
    assert driver.commands == []
    assert driver.stops == 0


def test_a_controller_in_degrees_without_a_map_is_noticed(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver({"thumb": 30.0, "index": 0.0})
    report = run(driver, pincer, solution)
    assert "Joint 'thumb' is said to be at 30 rad, far outside its limits [0, 1.5] rad; is the" in report.reason
    assert driver.commands == []


def test_a_joint_found_just_outside_is_led_back_inside(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver({"thumb": -0.05, "index": 0.0})
    report = run(driver, pincer, solution)
    assert report.success, report.reason
    lowest = [path.positions[:, 0].min() for path in driver.commands]
    assert min(lowest) > -0.05
    assert lowest == sorted(lowest)


def test_joints_that_the_controller_lacks(pincer: Hand, solution: GraspSolution) -> None:
    with pytest.raises(UnknownNameError, match=r"Joint 'index' is not in controller 'fake'. Did you mean 'indx'\?"):
        run(FakeDriver({"thumb": 0.0, "indx": 0.0}), pincer, solution)
    joint_map = JointMap({"thumb": MappedJoint("T"), "index": MappedJoint("I")})
    with pytest.raises(UnknownNameError, match=r"'T' is not in controller 'fake' \(joint 'thumb' of the hand\)"):
        run(FakeDriver(OPEN), pincer, solution, joint_map=joint_map)


def test_an_angle_that_is_not_reached(pincer: Hand, solution: GraspSolution) -> None:
    stuck = 0.8 * solution.joint_angles["thumb"]
    driver = FakeDriver(OPEN)
    driver.fault = lambda _: {"positions": {"thumb": min(driver.where()["thumb"], stuck)}}
    report = run(driver, pincer, solution, settling=0.2, angle_tolerance=0.01)
    assert not report.success
    assert report.reason.startswith("Not reached: joint 'thumb' is")
    assert report.reason.endswith(
        "from its computed angle; tolerance 0.01 rad. In the model, no other link is in the way of joint 'thumb'."
    )


def test_a_solution_of_another_geometry_never_reaches_the_driver(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    with pytest.raises(CommandError, match="geometry_hash"):
        run(driver, pincer, replace(solution, geometry_hash="ab+cd"))
    assert driver.commands == []


TENDONS = TendonMap(("thumb", "index"), ((0.01, 0.0), (0.0, 0.01)), (0.0, 1.0), (50.0, 60.0))


class Puller(FakeDriver):
    """A controller that pulls tendons, too."""

    pulled: list[list[float]]

    def pull(self, tensions: np.ndarray) -> None:
        self.pulled = [*getattr(self, "pulled", []), tensions.tolist()]


def test_the_squeeze_of_a_tendon_driven_hand(pincer: Hand, solution: GraspSolution) -> None:
    hand = replace(pincer, tendons=TENDONS)
    planned = replace(solution, squeeze={"tensions": [12.0, 1.0]})
    driver = Puller(OPEN)
    report = run(driver, hand, planned)
    assert report.success
    assert driver.pulled == [[12.0, 1.0]]
    assert "The tendons were told the tensions of the squeeze plan, up to 12 N." in report.notes
    for wrong, message in (
        ([12.0], "Expected 2 tensions, one a tendon"),
        ([60.0, 1.0], "Tendon 1 would be told 60 N, outside its limits [0, 50] N."),
        ([1.0, np.nan], "Tendon 2 would be told nan N"),
    ):
        driver = Puller(OPEN)
        report = run(driver, hand, replace(solution, squeeze={"tensions": wrong}))
        assert any(note.startswith("The tendons were not pulled: " + message) for note in report.notes), report.notes
        assert not hasattr(driver, "pulled")
        assert driver.stops == 0
    plain = FakeDriver(OPEN)
    asked_nothing = run(plain, hand, planned)  # a driver without tendons
    assert not any("tendons" in note for note in asked_nothing.notes)


def test_after_a_stop_no_tendon_is_pulled(
    pincer: Hand, solution: GraspSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = Puller(OPEN)
    hand = HardwareHand(replace(pincer, tendons=TENDONS), driver)
    monkeypatch.setattr(driven_hand, "squeeze_by_driver", lambda *_: hand.stop())
    report = execute(replace(solution, squeeze={"tensions": [12.0, 1.0]}), hand)
    assert report.reason.startswith("Stopped on request. The hand was told to stop")
    assert "The tendons were not pulled." in report.notes
    assert not hasattr(driver, "pulled")


def test_staying_connected(pincer: Hand, solution: GraspSolution) -> None:
    driver = FakeDriver(OPEN)
    assert run(driver, pincer, solution, stay_connected=True).success
    assert driver.connected


def test_way_points_that_are_next_to_each_other_are_one() -> None:
    times = np.array([0.0, 1e-9, 0.5, 0.5 + 1e-12, 0.7, 1.0 - 1e-9, 1.0])
    plan = TimedPlan(("a",), times, np.arange(7.0)[:, None]).thinned()
    assert plan.times.tolist() == [0.0, 0.5, 0.7, 1.0]
    assert plan.positions[:, 0].tolist() == [0.0, 2.0, 4.0, 6.0]


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(0, 2), st.floats(0.05, 1))
def test_a_window_is_the_plan_seen_from_now(moment: float, horizon: float) -> None:
    plan = TimedPlan(("a",), np.array([0.0, 0.5, 0.7, 1.5]), np.array([[0.0], [1.0], [0.2], [0.4]]))
    window = plan.window(moment, horizon)
    assert (np.diff(window.times) > 0).all()
    assert window.times[0] > 0
    for t in np.linspace(window.times[0], horizon, 9):
        assert window.at(t)["a"] == pytest.approx(plan.at(moment + t)["a"], abs=1e-3)
