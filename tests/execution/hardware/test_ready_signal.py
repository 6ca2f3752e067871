"""The ready signal: recorded first, then told whole or not at all, through a file, a socket or a topic."""

from __future__ import annotations

import importlib.util
import json
import os
import socket
import threading
import time
import uuid
from pathlib import Path

import pytest

from clench.core.exceptions import CommandError, FileError
from clench.execution.drivers import ros2
from clench.execution.executing import execute
from clench.execution.hardware.ready_signal import ReadySignal
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.record import Record
from clench.solver.solution import GraspSolution

DOMAIN = 1 + os.getpid() % 100


def check(signal: dict[str, object], folder: Path, solution: GraspSolution) -> None:
    assert signal["schema"] == "clench.ready/1"
    assert signal["code"] == "ready"
    assert signal["geometry_hash"] == solution.geometry_hash
    with Record(str(signal["record"])) as record:
        assert record.read(int(str(signal["id"]))) == solution


def test_a_file_is_replaced_as_a_whole(pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path) -> None:
    ready = tmp_path / "ready.json"
    hand = ReadySignal(pincer, tmp_path / "r.db", f"file:{ready}", obj=ball)
    seen: set[int] = set()
    ended = threading.Event()

    def read_on() -> None:
        while not ended.is_set():
            if ready.exists():
                seen.add(json.loads(ready.read_text())["id"])  # a half-written file would not be JSON

    reader = threading.Thread(target=read_on)
    reader.start()
    for k in range(1, 6):
        report = execute(pinch, hand)
        assert report.success
        assert report.reason == f"Recorded as {k} and signalled to file:{ready}."
        time.sleep(0.02)
    ended.set()
    reader.join()
    assert max(seen) == 5
    check(json.loads(ready.read_text()), tmp_path, pinch)
    assert sorted(p.name for p in tmp_path.iterdir() if not p.name.startswith("r.db")) == ["ready.json"]


def serve(server: socket.socket, taken: list[bytes]) -> None:
    connection, _ = server.accept()
    with connection, connection.makefile("rb") as lines:
        taken.extend(lines)


@pytest.mark.parametrize("kind", ["tcp", "unix"])
def test_a_socket_gets_one_line(pincer: Hand, pinch: GraspSolution, tmp_path: Path, kind: str) -> None:
    if kind == "tcp":
        server = socket.create_server(("127.0.0.1", 0))
        to = f"tcp:127.0.0.1:{server.getsockname()[1]}"
    else:
        server = socket.socket(socket.AF_UNIX)
        server.bind(str(tmp_path / "s"))
        server.listen()
        to = f"unix:{tmp_path / 's'}"
    taken: list[bytes] = []
    thread = threading.Thread(target=serve, args=(server, taken))
    thread.start()
    assert execute(pinch, ReadySignal(pincer, tmp_path / "r.db", to)).success
    thread.join(timeout=5)
    server.close()
    assert len(taken) == 1
    check(json.loads(taken[0]), tmp_path, pinch)
    report = execute(pinch, ReadySignal(pincer, tmp_path / "r.db", to, timeout=0.5))
    assert not report.success
    assert report.reason.startswith(f"Recorded as 2, but not signalled to {to}: Nobody takes it (")


@pytest.mark.parametrize("interface", ["cyclonedds", "rclpy"])
def test_a_topic(
    pincer: Hand, pinch: GraspSolution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, interface: str
) -> None:
    if not importlib.util.find_spec("cyclonedds") or not importlib.util.find_spec(interface):
        pytest.skip(f"needs cyclonedds and {interface}")
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from clench.execution.drivers.cyclone_link import prepare_domain, quality
    from clench.execution.drivers.dds_messages import String

    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    monkeypatch.setattr(ros2.importlib.util, "find_spec", lambda name: name if name in (interface, "_") else None)
    name = f"/ready_{uuid.uuid4().hex[:8]}"
    report = execute(pinch, ReadySignal(pincer, tmp_path / "r.db", f"topic:{name}", timeout=0.3))
    assert not report.success
    assert f"Nobody listens on '{name}' (waited 0.3 s, domain {DOMAIN}, {interface})" in report.reason
    prepare_domain(DOMAIN)
    participant = DomainParticipant(DOMAIN)
    reader = DataReader(participant, Topic(participant, f"rt{name}", String), qos=quality(reliable=True))
    report = execute(pinch, ReadySignal(pincer, tmp_path / "r.db", f"topic:{name}", timeout=10.0))
    assert report.success, report.reason
    texts = []
    until = time.monotonic() + 5.0
    while not texts and time.monotonic() < until:
        texts = [s.data for s in reader.take(10) if s.sample_info.valid_data]
        time.sleep(0.01)
    assert len(set(texts)) == 1  # the same, up to three times
    check(json.loads(texts[0]), tmp_path, pinch)


@pytest.mark.parametrize(
    "to", ["", "file:", "mail:x", "tcp:host", "tcp:host:0", "tcp:host:99999", "tcp::80", "topic:a b"]
)
def test_where_it_cannot_go(pincer: Hand, tmp_path: Path, to: str) -> None:
    with pytest.raises(CommandError, match="to: expected"):
        ReadySignal(pincer, tmp_path / "r.db", to)


def test_what_cannot_be_written(pincer: Hand, pinch: GraspSolution, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"absent/r\.db"):
        execute(pinch, ReadySignal(pincer, tmp_path / "absent" / "r.db", f"file:{tmp_path / 'ready.json'}"))
    for to, why in ((tmp_path / "absent" / "ready.json", "no folder"), (tmp_path, "it is a folder")):
        with pytest.raises(FileError, match=rf"{to}: cannot be written \({why}"):
            ReadySignal(pincer, tmp_path / "r.db", f"file:{to}")
    assert not (tmp_path / "r.db").exists()  # nothing is recorded that cannot be signalled
