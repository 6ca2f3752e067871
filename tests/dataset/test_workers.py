"""The real work in processes: killed, shared out, replaced, and on a cluster, with the same bytes."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from clench.dataset.jobs.job import DatasetJob
from clench.dataset.running.generating import generate
from clench.dataset.running.unit_run import UnitRecord
from clench.dataset.running.workers import run_units

pytestmark = pytest.mark.long

JOB = DatasetJob(
    hands=("robonaut2",), objects=("ball", "mug", "cylinder:r=0.03,h=0.1"), count=6, unit=2, effort=8, hold=True
)

MAIN = "from clench.apps.cli.main import main; raise SystemExit(main())"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> str:
    report = generate(JOB, tmp_path_factory.mktemp("one") / "out", workers=1)
    assert report.merged is not None
    return report.merged.sha256


def test_two_workers_killed_five_times_end_as_one_unbroken(tmp_path: Path, unbroken: str) -> None:
    out, rng = tmp_path / "out", random.Random(1)
    (tmp_path / "job.json").write_text(json.dumps(JOB.document()))
    options = ["--job", str(tmp_path / "job.json"), "--out", str(out), "--workers", "2"]
    for _ in range(5):
        process = subprocess.Popen([sys.executable, "-c", MAIN, "generate", *options], stderr=subprocess.DEVNULL)
        before, until = parts(out), time.monotonic() + 600.0
        while process.poll() is None and parts(out) == before and time.monotonic() < until:
            time.sleep(0.05)
        time.sleep(rng.uniform(0.0, 2.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
    run = subprocess.run([sys.executable, "-c", MAIN, "generate", *options, "--json"], capture_output=True, check=True)
    report = json.loads(run.stdout)
    assert report["done_before"] > 0
    assert report["merged"]["sha256"] == unbroken


def parts(out: Path) -> int:
    return len(list((out / "parts").glob("*.parquet")))


def test_a_term_signal_leaves_whole_units_and_says_how_to_go_on(tmp_path: Path, unbroken: str) -> None:
    out = tmp_path / "out"
    (tmp_path / "job.json").write_text(json.dumps(JOB.document()))
    call = [sys.executable, "-c", MAIN, "generate", "--job", str(tmp_path / "job.json"), "--out", str(out)]
    process = subprocess.Popen(call, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 600.0
    while not parts(out) and time.monotonic() < until:
        time.sleep(0.1)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert f"whole units are in '{out}'; the same call goes on: clench generate --job" in said
    report = generate(JOB, out, workers=2)
    assert 0 < report.found < report.units
    assert report.merged is not None
    assert report.merged.sha256 == unbroken


def test_a_process_that_ends_is_replaced_and_its_unit_done() -> None:
    units = list(JOB.units())[:2]

    def kill() -> None:
        until = time.monotonic() + 60.0
        while not multiprocessing.active_children() and time.monotonic() < until:
            time.sleep(0.05)
        os.kill(multiprocessing.active_children()[0].pid or 0, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    # So little memory that every process is replaced after its unit.
    results = list(run_units(JOB, units, 1, 1e-6))
    killer.join()
    assert [result.record.status for result in results] == ["done", "done"]
    assert not multiprocessing.active_children()


def test_a_unit_that_ends_every_process_is_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    # What cannot be unpickled ends the process before anything else does.
    (unit, other) = list(JOB.units())[:2]
    results = list(run_units(JOB, [replace(unit, hand=Ends()), other], 1, 4.0))
    assert [result.record.status for result in results] == ["failed", "done"]
    assert "The process ended with exit code 7 in 2 of 2 tries" in str(results[0].record.reason)


class Ends(str):
    """Text that ends the process that reads it."""

    def __reduce__(self) -> tuple[object, ...]:
        return os._exit, (7,)


def test_a_cluster_of_two_nodes_gives_the_same_bytes(tmp_path: Path, unbroken: str) -> None:
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    from clench.dataset.ray_driver import generate_on_ray

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    try:
        cluster.add_node(num_cpus=1)
        ray.init(address=cluster.address, log_to_driver=False)
        cluster.wait_for_nodes()
        assert len([node for node in ray.nodes() if node["Alive"]]) == 2
        told: list[UnitRecord] = []
        report = generate_on_ray(JOB, tmp_path / "out", tell=told.append)
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert len(told) == report.units == 9
    assert report.merged is not None
    assert report.merged.sha256 == unbroken
