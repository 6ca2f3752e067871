"""The log of an execution: read by the makers' own reader, and its bytes by ROS itself."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.core.exceptions import CommandError
from clench.execution.execution_report import ExecutionReport, JointReached
from clench.execution.formats import mcap_log
from clench.execution.formats.mcap_log import write_log
from clench.execution.history import ExecutionHistory
from clench.solver.solution import GraspSolution

pytest.importorskip("mcap_ros2", reason="needs mcap-ros2-support")

HISTORY = ExecutionHistory(
    ("thumb", "index"),
    np.array([0.0, 0.05, 1.25]),
    np.array([[0.0, 0.0], [0.1, 1.0 / 3.0], [0.2, 0.4]]),
    np.array([[0.01, 0.0], [0.09, 0.3], [0.2, 0.41]]),
)
REPORT = ExecutionReport("fake", True, "done", {"thumb": JointReached(0.2, 0.2)}, history=HISTORY)


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    found: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as stream:
        for _, channel, message, decoded in make_reader(
            stream, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def test_the_makers_reader_sees_everything(solution: GraspSolution, tmp_path: Path) -> None:
    write_log(tmp_path / "x.mcap", REPORT, solution)
    topics = read(tmp_path / "x.mcap")
    assert set(topics) == {"/joint_states", "/clench/command", "/clench/solution", "/clench/report"}
    for topic, rows in (("/joint_states", HISTORY.measured), ("/clench/command", HISTORY.commanded)):
        assert [list(m.name) for _, m in topics[topic]] == [["thumb", "index"]] * 3
        np.testing.assert_array_equal([list(m.position) for _, m in topics[topic]], rows)
        assert [t for t, _ in topics[topic]] == [0, 50_000_000, 1_250_000_000]
        assert [(m.header.stamp.sec, m.header.stamp.nanosec) for _, m in topics[topic]][-1] == (1, 250_000_000)
    ((_, text),) = topics["/clench/solution"]
    assert GraspSolution.from_dict(json.loads(text.data)) == solution
    ((_, text),) = topics["/clench/report"]
    assert json.loads(text.data) == REPORT.to_dict()


def test_ros_itself_reads_the_messages(solution: GraspSolution, tmp_path: Path) -> None:
    serialization = pytest.importorskip("rclpy.serialization", reason="needs rclpy")
    from mcap.reader import make_reader
    from sensor_msgs.msg import JointState

    write_log(tmp_path / "x.mcap", REPORT, solution)
    with (tmp_path / "x.mcap").open("rb") as stream:
        found = list(make_reader(stream).iter_messages(topics=["/joint_states"]))
    assert {schema.name for schema, _, _ in found} == {"sensor_msgs/msg/JointState"}
    states = [serialization.deserialize_message(message.data, JointState) for _, _, message in found]
    np.testing.assert_array_equal([s.position for s in states], HISTORY.measured)
    assert states[2].name == ["thumb", "index"]
    assert states[2].header.stamp.nanosec == 250_000_000


def test_the_same_log_twice(solution: GraspSolution, tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_log(tmp_path / name, REPORT, solution)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_what_cannot_be_logged(solution: GraspSolution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CommandError, match="Nothing was kept of the execution by 'fake'"):
        write_log(tmp_path / "x.mcap", replace(REPORT, history=None), solution)
    monkeypatch.setattr(mcap_log.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(CommandError, match="mcap-ros2-support is not installed; pip install"):
        write_log(tmp_path / "x.mcap", REPORT, solution)
    assert not (tmp_path / "x.mcap").exists()
