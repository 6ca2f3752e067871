"""ROS 2, two real processes over DDS on loopback: a node that behaves like the trajectory controller, and ours."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from virtual_clock import VirtualClock

from clench.core.exceptions import CommandError, UnknownNameError
from clench.execution.drivers import ros2
from clench.execution.drivers.ros2 import Ros2Driver, topic_name
from clench.execution.hardware.driver import JointPath
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

HERE = Path(__file__).parent
#: Where ports of DDS are below those that the system hands out.
DOMAIN = 1 + os.getpid() % 100
HORIZON = 0.3
#: Machines on which tests run side by side stop any of the processes for half a second, now and then.
PATIENT = {"max_age": 2.0, "settling": 5.0}
DRIVE = """
import sys
sys.path[:0] = {paths!r}
import pickle
from pathlib import Path
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.drivers.ros2 import Ros2Driver
from clench.execution.executing import execute
hand, solution = pickle.loads(Path({inputs!r}).read_bytes())
driver = Ros2Driver({controller!r}, joint_states={states!r}, interface={interface!r}, domain={domain})
hand = HardwareHand(hand, driver, connect_timeout=15.0, **{options!r})
report = execute(solution, hand, speed={speed})
report.save({out!r})
"""


def installed(interface: str) -> bool:
    import importlib.util

    return importlib.util.find_spec(interface) is not None


NEEDS = {
    "cyclonedds": pytest.mark.skipif(not installed("cyclonedds"), reason="needs cyclonedds"),
    "rclpy": pytest.mark.skipif(not installed("rclpy"), reason="needs rclpy (Linux, x86-64)"),
    "action": pytest.mark.skipif(not installed("control_msgs"), reason="needs a ROS installation with control_msgs"),
}
#: What reports call the interfaces.
SPOKEN = {"cyclonedds": "cyclonedds", "rclpy": "rclpy", "action": "rclpy, action"}
#: The real client library in everyday tests, the other one with -m long.
RCLPY_FIRST = [
    pytest.param("rclpy", marks=NEEDS["rclpy"]),
    pytest.param("cyclonedds", marks=[NEEDS["cyclonedds"], pytest.mark.long]),
]
CYCLONE_FIRST = [
    pytest.param("cyclonedds", marks=NEEDS["cyclonedds"]),
    pytest.param("rclpy", marks=[NEEDS["rclpy"], pytest.mark.long]),
]


@dataclass
class World:
    """Start processes on names of their own, and end them all."""

    folder: Path
    hand: Hand
    solution: GraspSolution
    controller: str = field(default_factory=lambda: f"hand_{uuid.uuid4().hex[:8]}")
    processes: list[subprocess.Popen[Any]] = field(default_factory=list)

    @property
    def states(self) -> str:
        return f"/{self.controller}/joint_states"

    def start(self, *arguments: str) -> subprocess.Popen[Any]:
        environment = {
            **{k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "RMW_", "CYCLONEDDS_"))},
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
        process = subprocess.Popen([sys.executable, *arguments], env=environment, stderr=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def node(self, interface: str, *options: str, joints: str = "thumb,index") -> subprocess.Popen[Any]:
        return self.start(
            str(HERE / "trajectory_controller.py"),
            *("--interface", interface, "--domain", str(DOMAIN), "--topic", f"/{self.controller}/joint_trajectory"),
            *("--states", self.states, "--joints", joints, "--start", "0.05,0.0"),
            *("--log", str(self.folder / "log.json"), *options),
        )

    def drive(self, interface: str, speed: float, **options: float) -> subprocess.Popen[Any]:
        import pickle

        inputs = self.folder / "inputs.pickle"
        inputs.write_bytes(pickle.dumps((self.hand, self.solution)))
        program = DRIVE.format(
            paths=[p for p in sys.path if p],
            inputs=str(inputs),
            controller=self.controller,
            states=self.states,
            interface=interface,
            domain=DOMAIN,
            speed=speed,
            options=PATIENT | options,
            out=str(self.folder / "report.json"),
        )
        return self.start("-c", program)

    def wait_for(self, what: str) -> None:
        until = time.monotonic() + 30
        while not (self.folder / f"log.{what}").exists() and time.monotonic() < until:
            time.sleep(0.02)

    def report(self, driving: subprocess.Popen[Any]) -> dict[str, Any]:
        _, errors = driving.communicate(timeout=40)
        assert driving.returncode == 0, errors
        return json.loads((self.folder / "report.json").read_text())

    def log(self, node: subprocess.Popen[Any]) -> dict[str, Any]:
        node.send_signal(signal.SIGTERM)
        assert node.wait(timeout=10) == 0
        return json.loads((self.folder / "log.json").read_text())

    def close(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()


@pytest.fixture
def world(tmp_path: Path, pincer: Hand, pinch: GraspSolution) -> Iterator[World]:
    made = World(tmp_path, pincer, pinch)
    yield made
    made.close()


def targets(solution: GraspSolution) -> np.ndarray:
    return np.array([solution.joint_angles["thumb"], solution.joint_angles["index"]])


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        pytest.param("cyclonedds", "rclpy", marks=[NEEDS["cyclonedds"], NEEDS["rclpy"]]),
        pytest.param("rclpy", "cyclonedds", marks=[NEEDS["cyclonedds"], NEEDS["rclpy"]]),
        pytest.param("cyclonedds", "cyclonedds", marks=[NEEDS["cyclonedds"], pytest.mark.long]),
        pytest.param("rclpy", "rclpy", marks=[NEEDS["rclpy"], pytest.mark.long]),
        pytest.param("action", "action", marks=[NEEDS["action"], pytest.mark.long]),
    ],
)
def test_a_trajectory_is_received_followed_and_reported(world: World, ours: str, theirs: str) -> None:
    node = world.node(theirs)
    report = world.report(world.drive(ours, 0.2))
    log = world.log(node)
    assert report["success"], report["reason"]
    assert report["actuator"] == f"ros2 ({SPOKEN[ours]})"
    assert log["refused"] == []
    assert len(log["paths"]) > 5
    # However long a message takes: every path begins on the one before it, and they never pull the hand to and fro.
    for (times, points), (later, after) in pairwise(log["paths"]):
        assert times[0] == later[0] == 0.0
        on_path = np.stack([np.interp(np.linspace(0.0, times[-1], 4001), times, c) for c in np.transpose(points)], 1)
        assert np.abs(on_path - after[0]).max(axis=1).min() < 1e-3
    begins = np.array([points[0] for _, points in log["paths"]])
    there = targets(world.solution) + np.array([2 * 0.05, 0.0])  # the thumb is opened first
    assert (np.abs(np.diff(begins, axis=0)).sum(axis=0) < there + 0.15).all()
    samples = np.array(log["samples"])
    np.testing.assert_allclose(samples[-1, 1:], targets(world.solution), atol=1e-6)
    rates = np.abs(np.diff(samples[:, 1:], axis=0)) / np.diff(samples[:, :1], axis=0).clip(1e-9)
    assert np.median(rates[rates > 0]) < 0.65  # a fifth of the limits of 3 and 2 rad/s, but for the jitter of messages
    # What we report is what the controller did: every measured sample is on its way.
    measured = np.array(report["history"]["measured"])
    np.testing.assert_allclose(measured[0], [0.05, 0.0], atol=1e-9)
    # The last look is that with which it counts as arrived: a fifth of 0.05 rad from its target, on a busy machine.
    np.testing.assert_allclose(measured[-1], samples[-1, 1:], atol=0.01)
    for column in range(2):
        near = np.abs(measured[:, column, None] - samples[None, :, 1 + column]).min(axis=1)
        assert near.max() < 1e-9


@pytest.mark.parametrize("theirs", RCLPY_FIRST)
def test_squeeze_and_next_steps_are_received_followed_and_reported(world: World, theirs: str) -> None:
    squeeze = {"feasible": True, "text": "Holds.", "offsets": {"thumb": 0.05, "index": 0.03}}
    world.solution = replace(world.solution, squeeze=squeeze, next_steps=({"thumb": 0.05},))
    node = world.node(theirs)
    report = world.report(world.drive("cyclonedds" if installed("cyclonedds") else "rclpy", 0.5))
    log = world.log(node)
    assert report["success"], report["reason"]
    assert log["refused"] == []
    samples = np.array(log["samples"])[:, 1:]
    thumb, index = targets(world.solution)
    assert samples[:, 0].max() == pytest.approx(thumb + 0.05, abs=0.01)
    np.testing.assert_allclose(samples[-1], [0.05, index + 0.03], atol=1e-6)
    (step,) = report["next_steps"]
    assert step["reached"]
    assert step["joints"]["thumb"]["reached"] == pytest.approx(0.05, abs=0.01)
    np.testing.assert_allclose(report["history"]["measured"][-1], samples[-1], atol=0.02)


@pytest.mark.parametrize("theirs", RCLPY_FIRST)
def test_a_cut_connection_stops_the_hand_and_is_reported(world: World, theirs: str) -> None:
    node = world.node(theirs, "--cut-after", "0.4")
    report = world.report(world.drive("cyclonedds" if installed("cyclonedds") else "rclpy", 0.08))
    time.sleep(0.5)
    log = world.log(node)
    assert not report["success"]
    assert "Nobody listens on" in report["reason"] or "is stale" in report["reason"]
    assert "that was not confirmed; it was told nothing beyond 0.3 s" in report["reason"]
    samples = np.array(log["samples"])
    later = samples[samples[:, 0] > log["last"] + HORIZON, 1:]
    assert len(later) > 5
    assert np.ptp(later, axis=0).max() == 0.0  # it stands still
    assert (later[-1] < 0.9 * targets(world.solution)).all()  # on the way
    assert np.ptp(samples[:, 1:], axis=0).max() > 0.01


@pytest.mark.parametrize("ours", RCLPY_FIRST)
def test_killing_our_program_stops_the_hand(world: World, ours: str) -> None:
    node = world.node("cyclonedds" if installed("cyclonedds") else "rclpy")
    driving = world.drive(ours, 0.05)
    world.wait_for("moving")
    time.sleep(0.4)
    assert driving.poll() is None
    driving.kill()
    time.sleep(HORIZON + 1.0)
    log = world.log(node)
    samples = np.array(log["samples"])
    later = samples[samples[:, 0] > log["last"] + HORIZON, 1:]
    assert len(later) > 5
    assert np.ptp(later, axis=0).max() == 0.0  # however busy the machine is
    assert (samples[-1, 1:] < 0.95 * targets(world.solution)).all()
    assert (samples[-1, 1:] > 0.0).any()


@NEEDS["cyclonedds"]
@pytest.mark.long
def test_a_controller_that_dies_is_reported(world: World) -> None:
    world.node("cyclonedds", "--die-after", "0.6")
    report = world.report(world.drive("cyclonedds", 0.05))
    assert not report["success"]
    assert "is stale" in report["reason"] or "Nobody listens" in report["reason"]


@NEEDS["cyclonedds"]
def test_a_state_that_is_sent_again_and_again_is_stale(world: World) -> None:
    node = world.node("cyclonedds", "--freeze-after", "0.5")
    report = world.report(world.drive("cyclonedds", 0.05, max_age=0.5))
    log = world.log(node)
    assert re.search(r"is stale: \d\.\d+ s old; at most 0\.5 s", report["reason"])
    assert log["samples"][-1][1] < 0.9 * targets(world.solution)[0]


@NEEDS["cyclonedds"]
def test_a_controller_of_other_joints_never_moves(world: World) -> None:
    node = world.node("cyclonedds", "--start", "0.05,0.0,0.0", joints="thumb,index,toe")
    report = world.report(world.drive("cyclonedds", 1.0, max_deviation=0.15))
    log = world.log(node)
    assert "does not follow" in report["reason"]
    assert log["paths"] == []
    assert log["refused"]
    assert np.ptp(np.array(log["samples"])[:, 1:]) == pytest.approx(0.05)


@NEEDS["action"]
@pytest.mark.long
def test_an_action_of_other_joints_refuses(world: World) -> None:
    node = world.node("action", "--start", "0.05,0.0,0.0", joints="thumb,index,toe")
    report = world.report(world.drive("action", 1.0))
    assert "refused the goal; does it have exactly these joints?" in report["reason"]
    assert world.log(node)["paths"] == []


@pytest.mark.parametrize("ours", CYCLONE_FIRST)
def test_who_is_not_there(world: World, ours: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    begun = time.monotonic()
    driver = Ros2Driver(world.controller, joint_states=world.states, interface=ours, domain=DOMAIN)
    with pytest.raises(
        ros2.DriverError, match=rf"No controller listens on '/{world.controller}/joint_trajectory' \(wai"
    ):
        driver.connect(0.5)
    driver.disconnect()
    assert time.monotonic() - begun < 15.0
    world.node("cyclonedds" if installed("cyclonedds") else "rclpy", "--silent")
    world.wait_for("ready")
    with pytest.raises(ros2.DriverError, match=r"joint_states' is silent \(waited 2.5 s"):
        driver.connect(2.5)
    driver.disconnect()
    other = Ros2Driver("other_controller", joint_states=world.states, interface=ours, domain=DOMAIN)
    with pytest.raises(ros2.DriverError, match=f"Trajectories are listened for on: .*/{world.controller}/joint_traj"):
        other.connect(1.5)
    other.disconnect()
    other.disconnect()


def test_nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros2.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(CommandError, match="No ROS 2 found: neither rclpy nor cyclonedds is installed; source a ROS"):
        Ros2Driver().connect(0.1)
    with pytest.raises(CommandError, match="rclpy is not installed; source a ROS installation"):
        Ros2Driver(interface="rclpy").connect(0.1)


@dataclass
class Wire:
    """Stand in for a link: the controller is measured where it was at first, whatever it is told."""

    name: str = "wire"
    published: list[tuple[list[float], list[list[float]]]] = field(default_factory=list)

    def listeners(self) -> int:
        return 1

    def states(self) -> list[ros2.JointStates]:
        return [ros2.JointStates({"thumb": 0.0}, 0)]

    def publish(self, _: object, times: list[float], positions: list[list[float]]) -> None:
        self.published.append((times, positions))

    def flush(self, timeout: float) -> None:
        pass

    def close(self) -> None:
        self.published.clear()


def test_a_path_begins_where_the_one_before_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, wire = VirtualClock(), Wire()
    monkeypatch.setattr(ros2, "time", clock)
    monkeypatch.setattr(ros2, "open_link", lambda *_: wire)
    driver = Ros2Driver()
    driver.connect(1.0)
    path = JointPath(("thumb",), np.array([0.1, 0.3]), np.array([[0.2], [0.8]]), 0.05)
    for pause in (0.0, 0.05, 0.2, 9.0):
        clock.sleep(pause)
        driver.command(path)
    # First where it is measured; then, however far behind that is, where it was told to be by now.
    assert [positions[0] for _, positions in wire.published] == [
        [0.0],
        *([pytest.approx(at)] for at in (0.1, 0.5, 0.8)),
    ]
    assert wire.published[0] == ([0.0, 0.1, 0.3], [[0.0], [0.2], [0.8]])


def test_a_stop_is_told_while_the_first_path_is_on_its_way(monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow(Wire):
        def publish(self, joints: object, times: list[float], positions: list[list[float]]) -> None:
            super().publish(joints, times, positions)
            if len(self.published) == 1:
                driver.stop()

    wire = Slow()
    monkeypatch.setattr(ros2, "open_link", lambda *_: wire)
    driver = Ros2Driver()
    driver.connect(1.0)
    driver.command(JointPath(("thumb",), np.array([0.1, 0.3]), np.array([[0.2], [0.8]]), 0.05))
    assert wire.published[1] == ([ros2.STOP_TIME], [[0.0]])


def test_trouble_of_the_link_does_not_keep_the_hand_from_being_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = Wire()
    monkeypatch.setattr(ros2, "open_link", lambda *_: wire)
    driver = Ros2Driver()
    driver.connect(1.0)
    driver.command(JointPath(("thumb",), np.array([0.1, 0.3]), np.array([[0.2], [0.8]]), 0.05))

    def refused() -> list[ros2.JointStates]:
        raise ros2.DriverError("The goal was refused.")

    monkeypatch.setattr(wire, "states", refused)
    with pytest.raises(ros2.DriverError, match="refused"):
        driver.read()
    driver.stop()
    assert wire.published[-1] == ([ros2.STOP_TIME], [[0.0]])


def test_no_state_is_from_the_future(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another thread, which stops the hand, hears a state while this one reads."""
    clock, wire = VirtualClock(), Wire()
    monkeypatch.setattr(ros2, "time", clock)
    monkeypatch.setattr(ros2, "open_link", lambda *_: wire)
    driver = Ros2Driver()
    driver.connect(1.0)

    class Meanwhile:
        """Let the other thread have the lock first."""

        def __enter__(self) -> None:
            clock.sleep(0.1)
            driver._received["thumb"] = clock.now

        def __exit__(self, *_: object) -> None:
            pass

    monkeypatch.setattr(driver, "_receive", lambda: None)
    monkeypatch.setattr(driver, "_lock", Meanwhile())
    assert driver.read().ages == {"thumb": 0.0}


def test_names_and_domains(monkeypatch: pytest.MonkeyPatch) -> None:
    assert topic_name("hand/joint_states", "x") == topic_name("/hand/joint_states", "x") == "/hand/joint_states"
    for bad in ("", "a b", "a//b", "1a", "ä", "a-b"):
        with pytest.raises(CommandError, match="controller: expected a ROS name"):
            Ros2Driver(bad)
    with pytest.raises(UnknownNameError, match="Interface 'ros1' is not in ROS 2"):
        Ros2Driver(interface="ros1")
    monkeypatch.setenv("ROS_DOMAIN_ID", "17")
    assert Ros2Driver().domain == 17
    assert Ros2Driver(domain=3).domain == 3
    for text in ("x", "-1", "233"):
        monkeypatch.setenv("ROS_DOMAIN_ID", text)
        with pytest.raises(CommandError, match=r"ROS domain: expected a whole number from 0 to 232, got '" + text):
            Ros2Driver()


def test_a_driver_that_is_not_connected() -> None:
    driver = Ros2Driver()
    with pytest.raises(ros2.DriverError, match="not connected"):
        driver.read()
    driver.stop()  # nothing moves, nothing to stop
    driver.disconnect()
