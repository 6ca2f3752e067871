"""Log an execution as MCAP with ROS 2 messages: targets and measurements, the solution, the report."""

from __future__ import annotations

import importlib.util
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError
from clench.core.extras import how_to_install
from clench.core.files.json_files import encode_document, write_atomically
from clench.execution.execution_report import ExecutionReport
from clench.solver.solution import GraspSolution

MEASURED: Final = "/joint_states"
COMMANDED: Final = "/clench/command"
SOLUTION: Final = "/clench/solution"
REPORT: Final = "/clench/report"

_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_log(path: str | Path, report: ExecutionReport, solution: GraspSolution) -> None:
    """Write the history of an execution; times count from its start.

    Topics: `/joint_states` (measured) and `/clench/command` (told), sensor_msgs/JointState [rad]; `/clench/solution`
    and `/clench/report`, std_msgs/String with their JSON.

    Raises:
        CommandError: nothing was kept of the execution, or `mcap-ros2-support` is not installed.
        FileError: the file cannot be written.
    """
    if report.history is None:
        raise CommandError(f"Nothing was kept of the execution by '{report.actuator}': there is nothing to log.")
    if importlib.util.find_spec("mcap_ros2") is None:
        raise CommandError(f"mcap-ros2-support is not installed; {how_to_install('logs')}.")
    from mcap_ros2.writer import Writer

    content = io.BytesIO()
    writer = Writer(content)
    state = writer.register_msgdef("sensor_msgs/msg/JointState", _STATE)
    text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
    schemas = {MEASURED: state, COMMANDED: state, SOLUTION: text, REPORT: text}
    for sequence, (topic, moment, message) in enumerate(_messages(report, solution)):
        writer.write_message(topic, schemas[topic], message, log_time=moment, publish_time=moment, sequence=sequence)
    writer.finish()
    write_atomically(path, content.getvalue())


def _messages(report: ExecutionReport, solution: GraspSolution) -> Iterator[tuple[str, int, dict[str, Any]]]:
    history = report.history
    assert history is not None
    yield SOLUTION, 0, {"data": encode_document(solution.to_dict(), "solution").decode()}
    last = 0
    for time, told, measured in zip(history.times, history.commanded, history.measured, strict=True):
        last = round(float(time) * 1e9)
        for topic, angles in ((COMMANDED, told), (MEASURED, measured)):
            yield (
                topic,
                last,
                {
                    "header": {
                        "stamp": dict(zip(("sec", "nanosec"), divmod(last, 10**9), strict=True)),
                        "frame_id": "",
                    },
                    "name": list(history.joints),
                    "position": angles.tolist(),
                    "velocity": [],
                    "effort": [],
                },
            )
    yield REPORT, last, {"data": encode_document(report.to_dict(), "report").decode()}
