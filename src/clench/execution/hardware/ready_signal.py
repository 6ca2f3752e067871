"""The ready signal: tell a separate controller that contacts and joint angles have been computed, by a record id."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError
from clench.core.files.json_files import check_writable, write_json
from clench.core.showing.short_repr import described
from clench.execution.execution_report import ExecutionReport
from clench.execution.trajectory import Trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.record import Record
from clench.solver.solution import GraspSolution

from .driver import DriverError

SCHEMA: Final = "clench.ready/1"
#: The code that says that everything is there.
READY: Final = "ready"
_KINDS: Final = "file:PATH, tcp:HOST:PORT, unix:PATH or topic:NAME"


@dataclass(frozen=True)
class _Channel:
    kind: str
    where: str
    send: Callable[[str, dict[str, Any], float], None]


class ReadySignal:
    """Append a solution to a record and signal its id; another controller reads it there and moves the hand.

    The signal is one JSON object of schema `clench.ready/1`. It is written to a file atomically, sent as one line
    through a socket, or published as std_msgs/String on a ROS 2 topic.

    Args:
        hand: the hand. record: the record (SQLite file), made when missing.
        to: ``file:PATH``, ``tcp:HOST:PORT``, ``unix:PATH`` or ``topic:NAME``.
        obj: the object, so that a solution for another one is refused; None: not checked.
        timeout: how long a receiver is looked for [s].

    Raises:
        CommandError: `to` is malformed. FileError: its file is a folder, or in none.
    """

    name = "signal"

    def __init__(
        self, hand: Hand, record: str | Path, to: str, *, obj: GraspObject | None = None, timeout: float = 5.0
    ) -> None:
        self._hand = hand
        self.obj = obj
        self.record = Path(record)
        self.timeout = timeout
        self._channel = _channel(to)

    def __repr__(self) -> str:
        return described(self, hand=self.hand.name, record=self.record, timeout=self.timeout)

    @property
    def hand(self) -> Hand:
        """The hand that the other controller moves."""
        return self._hand

    def execute(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Record the solution, then signal; success says that the signal was taken, not that the hand moved.

        Raises:
            FileError: the record cannot be written.
        """
        with Record(self.record) as record:
            number = record.append(solution)
        signal = {
            "schema": SCHEMA,
            "code": READY,
            "record": str(self.record.resolve()),
            "id": number,
            "hand": solution.hand,
            "object": solution.object,
            "status": solution.status.value,
            "geometry_hash": solution.geometry_hash,
            "duration": trajectory.duration,
        }
        where = f"{self._channel.kind}:{self._channel.where}"
        try:
            self._channel.send(self._channel.where, signal, self.timeout)
        except DriverError as error:
            return ExecutionReport(
                self.name, success=False, reason=f"Recorded as {number}, but not signalled to {where}: {error}"
            )
        return ExecutionReport(
            self.name,
            success=True,
            reason=f"Recorded as {number} and signalled to {where}.",
            notes=("Another controller moves the hand; what it reaches is not known here.",),
        )


def _channel(to: str) -> _Channel:
    kind, _, where = to.partition(":")
    senders = {"file": _to_file, "tcp": _to_tcp, "unix": _to_unix, "topic": _to_topic}
    if kind not in senders or not where:
        raise CommandError(f"to: expected {_KINDS}, got '{to}'.")
    if kind == "tcp":
        _address(where)
    elif kind == "file":
        check_writable(where)
    elif kind == "topic":
        from clench.execution.drivers.ros2 import topic_name

        where = topic_name(where, "to")
    return _Channel(kind, where, senders[kind])


def _to_file(where: str, signal: dict[str, Any], timeout: float) -> None:
    write_json(where, signal, "signal")


def _to_tcp(where: str, signal: dict[str, Any], timeout: float) -> None:
    try:
        with socket.create_connection(_address(where), timeout=timeout) as connection:
            connection.sendall(_line(signal))
    except OSError as error:
        raise DriverError(f"Nobody takes it ({error.strerror or error}).") from None


def _to_unix(where: str, signal: dict[str, Any], timeout: float) -> None:
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(timeout)
            connection.connect(where)
            connection.sendall(_line(signal))
    except OSError as error:
        raise DriverError(f"Nobody takes it ({error.strerror or error}).") from None


def _to_topic(where: str, signal: dict[str, Any], timeout: float) -> None:
    from clench.execution.drivers.ros2 import ros_domain
    from clench.execution.drivers.ros_text import publish_text

    publish_text(where, _line(signal).decode().strip(), ros_domain(None), timeout)


def _address(where: str) -> tuple[str, int]:
    host, _, port = where.rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise CommandError(f"to: expected tcp:HOST:PORT with a port from 1 to 65535, got 'tcp:{where}'.")
    return host, int(port)


def _line(signal: dict[str, Any]) -> bytes:
    return json.dumps(signal).encode() + b"\n"
