"""A vendor's hand, in memory: told in degrees by other names, stopped, and never moved by connecting."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from virtual_clock import VirtualClock

from clench.core.exceptions import CommandError, FileError
from clench.execution.executing import execute
from clench.execution.hardware.driver import DriverError, JointPath
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.hardware.joint_map import JointMap, joint_map_from_dict
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

pytest.importorskip("orca_core", reason="needs orca-core")

from clench.execution.drivers import orca
from clench.execution.drivers.orca import OrcaDriver

pytestmark = pytest.mark.usefixtures("clock")
MAP = {
    "unit": "deg",
    "joints": {
        "thumb": {"name": "thumb_dip", "offset": -10.0},
        "index": {"name": "index_mcp", "offset": -20.0},
        "index_tip": {"name": "index_pip", "offset": -12.0},
    },
}
EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture
def joint_map() -> JointMap:
    return joint_map_from_dict(MAP)


def test_a_pinch_on_the_mock(
    pincer: Hand, pinch: GraspSolution, joint_map: JointMap, capfd: pytest.CaptureFixture[str]
) -> None:
    driver = OrcaDriver(mock=True)
    leave, driver.disconnect = driver.disconnect, lambda: None  # what the mock knows is lost with its connection
    report = execute(pinch, HardwareHand(pincer, driver, joint_map=joint_map))
    assert report.success, report.reason
    assert report.actuator == "orca (mock)"
    assert set(report.joints) == {"thumb", "index", "index_tip"}
    reached = driver.read().positions
    assert reached["thumb_dip"] == pytest.approx(np.rad2deg(pinch.joint_angles["thumb"]) - 10, abs=0.5)
    assert reached["index_mcp"] == pytest.approx(np.rad2deg(pinch.joint_angles["index"]) - 20, abs=0.5)
    leave()
    assert capfd.readouterr().out == ""


def test_connecting_moves_nothing_and_stopping_holds() -> None:
    driver = OrcaDriver(mock=True)
    with pytest.raises(DriverError, match="failed"):
        driver.read()
    driver.stop()  # nothing is connected: nothing to stop
    driver.connect(1.0)
    before = driver.read().positions
    driver.disconnect()
    driver.connect(1.0)
    assert driver.read().positions == before
    driver.command(JointPath(("index_mcp",), np.array([0.05, 0.3]), np.array([[20.0], [50.0]]), 0.05))
    assert driver.read().positions["index_mcp"] == pytest.approx(20.0)
    driver.stop()
    assert driver.read().positions["index_mcp"] == pytest.approx(20.0)
    driver.disconnect()
    driver.disconnect()


def test_a_stop_without_an_answer_repeats_no_old_place(monkeypatch: pytest.MonkeyPatch) -> None:
    driver = OrcaDriver(mock=True)
    driver.connect(1.0)
    told: list[object] = []
    monkeypatch.setattr(driver._hand, "set_joint_positions", told.append)
    monkeypatch.setattr(type(driver._hand), "last_read_ok", False)
    with pytest.raises(DriverError, match="do not answer; they hold the last target"):
        driver.stop()
    assert told == []
    monkeypatch.undo()
    driver.disconnect()


def test_what_other_threads_print_is_kept(capsys: pytest.CaptureFixture[str]) -> None:
    """One thread hangs in orca-core while another one stops the hand: neither takes standard output away."""
    inside, goes_on = threading.Event(), threading.Event()

    def hanging() -> None:
        with orca._quiet():
            print("not seen")
            inside.set()
            goes_on.wait(60.0)

    before = sys.stdout
    thread = threading.Thread(target=hanging)
    thread.start()
    inside.wait(60.0)
    with orca._quiet():
        print("not seen")
    print("seen")
    goes_on.set()
    thread.join()
    assert sys.stdout is before
    assert capsys.readouterr().out == "seen\n"


def test_stopped_on_the_way(pincer: Hand, pinch: GraspSolution, joint_map: JointMap, clock: VirtualClock) -> None:
    driver = OrcaDriver(mock=True)
    hand = HardwareHand(pincer, driver, joint_map=joint_map)
    clock.after(1.0, hand.stop)
    report = execute(pinch, hand, speed=0.05)
    assert report.reason.startswith("Stopped on request. The hand was told to stop: it was seen to stand still")


def test_the_configuration_limits_what_is_sent(pincer: Hand, pinch: GraspSolution) -> None:
    far = {**MAP, "joints": {**MAP["joints"], "index": {"name": "index_mcp", "offset": -14.0, "upper": -8.0}}}
    report = execute(pinch, HardwareHand(pincer, OrcaDriver(mock=True), joint_map=joint_map_from_dict(far)))
    assert "outside its limits" in report.reason
    assert "deg" in report.reason


def test_what_is_wrong_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FileError, match=r"absent/config.yaml: no such file"):
        OrcaDriver("absent/config.yaml", mock=True)
    driver = OrcaDriver(version="v1")  # no hardware here
    with pytest.raises(DriverError, match=r"The ORCA hand (does not answer|failed)"):
        driver.connect(1.0)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(CommandError, match="orca-core is not installed; pip install"):
        OrcaDriver(mock=True)


@pytest.mark.shared
def test_the_map_of_the_examples_fits_the_hand(shared_data: Path) -> None:
    hand = Hand.load(shared_data / "hands/orca_v1_mjcf/orcahand_right.mjcf")
    joints = JointMap.load(EXAMPLES / "orca_v1_right.joints.toml").of(hand)
    limits = OrcaDriver(mock=True, version="v1").limits.positions
    assert {joint.name for joint in joints.values()} == set(limits)
    for name, joint in joints.items():
        model = hand.joints[hand.joint_index(name)]
        ends = sorted([joint.to_controller(model.lower), joint.to_controller(model.upper)])
        np.testing.assert_allclose(ends, limits[joint.name], atol=10.5 if joint.name == "wrist" else 4.5, err_msg=name)
