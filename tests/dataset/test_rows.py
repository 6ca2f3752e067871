"""Rows are what the planner found: complete grasps, failures with their reason, nulls where nothing is known."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main
from clench.core.exceptions import ClenchError
from clench.dataset.access.exporting import export
from clench.dataset.access.reading import GraspDataset
from clench.dataset.access.reading import open as open_dataset
from clench.dataset.jobs.job import DatasetJob
from clench.dataset.jobs.sources import license_beside, load_hand, load_object
from clench.dataset.jobs.units import Unit
from clench.dataset.running.generating import GenerateReport, generate
from clench.dataset.running.unit_run import UnitResult
from clench.dataset.running.workers import run_units
from clench.dataset.storage.columns import COLUMNS, SCHEMA
from clench.dataset.storage.rows import row_of
from clench.execution.simulation.hold import Hold
from clench.planner.rejections import Rejection

#: A closed box of triangles [m], 40 × 40 × 80 mm, as a file.
BOX = """v -.02 -.02 -.04\nv .02 -.02 -.04\nv .02 .02 -.04\nv -.02 .02 -.04\nv -.02 -.02 .04\nv .02 -.02 .04
v .02 .02 .04\nv -.02 .02 .04\nf 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7
f 4 1 5\nf 4 5 8\n"""


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Work in a folder of models: their paths are part of the seeds."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("made")
        patch.chdir(folder)
        yield folder


@pytest.fixture(scope="module")
def made(folder: Path) -> tuple[Path, GenerateReport]:
    """Generate a small dataset in this process: two objects, one of which is no mesh."""
    (folder / "box.obj").write_text(BOX)
    (folder / "LICENSE").write_text("\n  A licence for all.\nMore.\n")
    (folder / "bad.obj").write_text("v 0 0 zero\n")
    job = DatasetJob(hands=("robonaut2",), objects=("bad.obj", "box.obj"), count=3, unit=2, effort=8, hold=True, seed=3)
    return folder / "out", generate(job, folder / "out", workers=0)


@pytest.fixture(scope="module")
def dataset(made: tuple[Path, GenerateReport]) -> GraspDataset:
    return open_dataset(made[0])


def test_an_object_that_does_not_load_stops_nothing_else(made: tuple[Path, GenerateReport]) -> None:
    _, report = made
    assert (report.units, len(report.failed)) == (4, 2)
    assert all("bad.obj" in record.reason and record.object.endswith("bad.obj") for record in report.failed)
    assert report.merged is not None
    assert (report.merged.ok, report.merged.failed) == (3, 2)
    document = report.to_dict()
    assert document["yield"] == pytest.approx(
        sum(r.force_closed for r in report.records) / sum(r.closed for r in report.records)
    )
    assert sum(document["rejected"].values()) > 0


def test_every_row_is_complete_and_says_where_it_comes_from(dataset: GraspDataset) -> None:
    assert len(dataset) >= 3
    hand = clench.Hand.load("robonaut2")
    assert dataset.hands["robonaut2"]["joints"] == list(hand.joint_names)
    for number in range(len(dataset)):
        row = dataset.row(number)
        assert tuple(row) == tuple(COLUMNS)
        assert row["object_license"] == "LICENSE: A licence for all."
        assert row["hand_license"] is None
        assert row["object_collision_source"] == "engine"
        assert row["clench_version"] == clench.__version__
        for name in ("pregrasp", "touch"):
            assert len(row[name]) == len(hand.joint_names)
        assert all(row[name] is not None for name, column in COLUMNS.items() if not column.nullable)
        # The box is convex, and its surface is where the contacts are.
        for point, normal in zip(row["contact_position"], row["contact_normal"], strict=True):
            sides = np.abs(point) - [0.02, 0.02, 0.04]
            assert abs(sides.max()) < 1e-6
            assert np.linalg.norm(normal) == pytest.approx(1.0)
        assert row["T_object_palm"] == pytest.approx(row["T_world_palm"])


def test_grasps_balance_their_forces_and_were_held(dataset: GraspDataset) -> None:
    good = dataset.filter(ok=True)
    assert len(good) == 3
    for number in range(3):
        row = good.row(number)
        assert np.linalg.norm(np.sum(row["contact_force"], axis=0)) < 1e-6
        assert (row["held"], row["stage"], row["reason"]) == (True, None, None)
        assert 0.0 <= row["hold_distance"] < 0.05
        assert row["held_5mm_5deg"] == (row["hold_distance"] < 0.005 and row["hold_angle"] < math.radians(5.0))
        assert row["epsilon"] > 0.0
        assert row["margin"] >= 1.0
        pressing = np.subtract(row["squeeze"], row["touch"])
        assert np.abs(pressing).max() > 0.0


def test_a_row_solves_to_the_same_answer_to_the_bit(dataset: GraspDataset) -> None:
    for number in range(len(dataset)):
        row, solution = dataset.row(number), dataset.solution(number)
        assert list(solution.joint_angles.values()) == row["touch"]
        assert solution.hand_pose.wxyz_xyz.tolist() == row["T_world_palm"]
        assert solution.certified
        plain = clench.solve(
            load_hand("robonaut2"), load_object(row["object_model"], 1.0, True), dataset.command(number)
        )
        assert dict(plain.joint_angles) == dict(solution.joint_angles)


def test_another_model_is_refused(dataset: GraspDataset) -> None:
    with pytest.raises(ClenchError, match="was made from another model of object 'box' than is loaded here"):
        dataset.solution(0, obj=clench.GraspObject.load("ball"))


def test_the_planner_finds_the_same_grasps_with_the_seed_of_the_row(dataset: GraspDataset) -> None:
    row = dataset.filter(ok=True).row(0)
    obj = load_object(row["object_model"], 1.0, True)
    plan = clench.plan_grasps(load_hand("robonaut2"), obj, 2, effort=8, seed=row["seed"])
    assert row["touch"] in [list(grasp.joint_angles.values()) for grasp in plan]


def test_failures_are_rows_with_stage_and_reason() -> None:
    hand, obj = load_hand("robonaut2"), load_object("ball", 1.0, False)
    unfinished: list = []
    search = clench.iter_grasps(hand, obj, 1, effort=8, mass=50.0, most=32, path=False)
    search.tell_unfinished(unfinished.append)
    assert not list(search)
    plan = search.plan()
    assert plan.rejected[Rejection.NO_SQUEEZE] == len(unfinished) > 0
    row = row_of(Unit(0, "robonaut2", "ball", 1.0, 0, 1), hand, obj, unfinished[0], None)
    assert (row["ok"], row["stage"], row["reason"]) == (False, "squeeze", "no squeeze within limits")
    assert row["contact_position"]
    for name in ("pregrasp", "squeeze", "torques", "contact_force", "epsilon", "score", "held", "hold_reason"):
        assert row[name] is None


def test_a_dropped_grasp_failed_in_the_hold_test() -> None:
    from clench.execution.simulation.pulling import hold_and_pull

    hand, obj = load_hand("robonaut2"), load_object("ball", 1.0, False)
    (grasp,) = clench.plan_grasps(hand, obj, 1, effort=8)
    report = hold_and_pull(grasp.solution, hand, obj, Hold(pull=2000.0), grasp.trajectory)
    unit = Unit(0, "robonaut2", "ball", 1.0, 0, 1)
    row = row_of(unit, hand, obj, grasp, report)
    assert (row["held"], row["ok"], row["stage"], row["reason"]) == (False, False, "hold", report.reason)
    soft = replace(grasp, squeeze=replace(grasp.squeeze, offsets={}))
    assert row_of(unit, hand, obj, soft, None)["squeeze"] is None


def test_licences_are_named_only_where_they_lie_beside_the_model(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for folder in (tmp_path, tmp_path / "below"):
        (folder / "a.obj").write_text("")
    (tmp_path / "COPYING").write_bytes(b"\xff\xfe not text")
    assert license_beside(str(tmp_path / "a.obj")) == "COPYING"
    assert license_beside(str(tmp_path / "below" / "a.obj")) is None
    assert license_beside("mug") is None


def test_the_card_and_the_manifest_tell_of_it(made: tuple[Path, GenerateReport]) -> None:
    folder, report = made
    card = (folder / "DATASET.md").read_text()
    assert "| complete grasps (`ok`) | 3 |" in card
    assert "Held in simulation: 3 of 3 grasps." in card
    assert "LICENSE: A licence for all." in card
    assert "bad.obj" in card
    assert SCHEMA in card
    for name in ("counts", "epsilon", "rejections"):
        assert (folder / "pictures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["sha256"] == report.merged.sha256
    assert [unit["status"] for unit in manifest["units"]] == ["failed", "failed", "done", "done"]


def test_other_programs_get_the_grasps_as_they_were_computed(dataset: GraspDataset, tmp_path: Path) -> None:
    good = dataset.filter(ok=True)
    (yaml,) = export(dataset, tmp_path / "isaac", "isaac_grasp")
    read = clench.import_grasps(yaml)
    assert [grasp.confidence for grasp in read] == [1.0] * 3
    files = export(dataset, tmp_path / "bench", "dexgraspbench")
    assert len(files) == 3
    for number in range(3):
        row = good.row(number)
        names = dataset.hands["robonaut2"]["joints"]
        assert dict(read[number].joint_angles) == dict(zip(names, row["touch"], strict=True))
        assert read[number].hand_pose.wxyz_xyz == pytest.approx(np.array(row["T_object_palm"]))
        (posture,) = clench.import_grasps(files[number])
        assert dict(posture.joint_angles) == dict(zip(names, row["touch"], strict=True))
        assert posture.command(load_hand("robonaut2")).hand_pose.position == pytest.approx(row["T_world_palm"][4:])


CALL = [
    "generate",
    "--hands",
    "robonaut2",
    "--objects",
    "ball",
    "--count",
    "2",
    "--unit",
    "1",
    "--effort",
    "8",
    "--without-path",
]


def test_the_command_says_what_it_did(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call = [*CALL, "--workers", "0", "--out", str(tmp_path / "out")]
    assert main(call) == 0
    said = capsys.readouterr().out
    assert "Shard 1/1: 2 units, 2 grasps and 0 that failed" in said
    assert "Merged 2 rows, 2 of them grasps" in said
    assert main([*call, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["schema"], report["done_before"], report["ok"]) == ("clench.generate/1", 2, 2)
    assert report["merged"]["sha256"] in said
    assert main(["generate", "--merge", str(tmp_path / "out"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sha256"] == report["merged"]["sha256"]
    assert open_dataset(tmp_path / "out").row(0)["pregrasp"] is None


def test_ctrl_c_leaves_whole_parts_and_says_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(job: DatasetJob, units: list[Unit], workers: int, memory: float) -> Iterator[UnitResult]:
        yield from islice(run_units(job, units, workers, memory), 1)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("clench.dataset.running.generating.run_units", interrupted)
    out = tmp_path / "out"
    call = [*CALL, "--workers", "0", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["clench", *call])
    assert main(call) == 130
    assert f"whole units are in '{out}'; the same call goes on: clench {' '.join(call)}" in capsys.readouterr().err
    assert len(list((out / "parts").glob("*.parquet"))) == 1
    assert not (out / "grasps.parquet").exists()
    monkeypatch.undo()
    assert main(call) == 0
    assert "2 units (1 of them before), 2 grasps" in capsys.readouterr().out


def test_a_job_of_which_everything_fails_gives_no_dataset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.obj").write_text("v 0 0 zero\n")
    call = [
        "generate",
        "--hands",
        "robonaut2",
        "--objects",
        str(tmp_path / "bad.obj"),
        "--count",
        "1",
        "--workers",
        "0",
    ]
    assert main([*call, "--out", str(tmp_path / "out")]) == 1
    assert "bad.obj" in capsys.readouterr().err
    assert not (tmp_path / "out" / "grasps.parquet").exists()
    assert main(["generate", "--merge", str(tmp_path / "out")]) == 2
    assert "holds no part: all 1 units failed" in capsys.readouterr().err
