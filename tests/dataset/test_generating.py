"""What is done stays done: runs that are killed, shared out and gone on with give the same bytes."""

from __future__ import annotations

import json
import random
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from clench.core.exceptions import ClenchError
from clench.dataset.access.reading import open as open_dataset
from clench.dataset.jobs.job import DatasetJob
from clench.dataset.jobs.shards import Shard
from clench.dataset.running.generating import GenerateReport, generate
from clench.dataset.storage.folder import DatasetFolder
from clench.dataset.storage.merging import merge
from made_rows import make_result, slowly

JOB = DatasetJob(hands=("robonaut2", "patent15"), objects=("mug", "ball"), scales=(1.0, 1.5), count=50, unit=7)


def run(folder: Path, shard: Shard | None = None, job: DatasetJob = JOB) -> GenerateReport:
    return generate(job, folder, shard=shard, runner=lambda j, units: (make_result(j, unit) for unit in units))


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken")
    report = run(folder)
    assert report.merged is not None
    assert (report.merged.rows, report.units) == (2 * 2 * 2 * 50, 2 * 2 * 2 * 8)
    return folder


@pytest.fixture
def copied(tmp_path: Path, unbroken: Path) -> Path:
    shutil.copytree(unbroken, tmp_path / "copied")
    return tmp_path / "copied"


def same(one: Path, other: Path) -> bool:
    names = ("grasps.parquet", "manifest.json", "DATASET.md", "pictures/counts.png")
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in names)


def test_a_run_that_is_killed_again_and_again_ends_as_an_unbroken_one(tmp_path: Path, unbroken: Path) -> None:
    (tmp_path / "job.json").write_text(json.dumps(JOB.document()))
    out, rng, kills = tmp_path / "out", random.Random(0), 0
    for _ in range(5):
        program = [
            sys.executable,
            str(Path(__file__).parents[1] / "made_rows.py"),
            str(tmp_path / "job.json"),
            str(out),
        ]
        process = subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        before, until = len(parts(out)), time.monotonic() + 60.0
        while process.poll() is None and len(parts(out)) == before and time.monotonic() < until:
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.15))
        kills += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert kills >= 3
    assert 0 < len(parts(out)) < 64
    report = run(out)
    assert 0 < report.found < 64
    assert same(out, unbroken)
    dataset = open_dataset(out)
    keys = [(unit, number) for b in dataset.batches(99) for unit, number in zip(b["unit"], b["proposal"], strict=True)]
    assert len(keys) == len(set(keys)) == 400


def parts(out: Path) -> list[Path]:
    return list((out / "parts").glob("*.parquet"))


def test_shards_in_any_order_give_the_same_bytes(tmp_path: Path, unbroken: Path) -> None:
    units = list(JOB.units())
    for number in (3, 1, 2):
        report = run(tmp_path, Shard(number, 3))
        assert report.units == sum(Shard(number, 3).has(unit) for unit in units) < len(units)
        assert (report.merged is None) == (number != 2)
    assert same(tmp_path, unbroken)


def test_shards_of_several_machines_are_copied_together_and_merged(tmp_path: Path, unbroken: Path) -> None:
    for number in (1, 2):
        assert run(tmp_path / str(number), Shard(number, 2)).merged is None
    with pytest.raises(ClenchError, match=r"units are missing, first 'robonaut2' on 'mug'"):
        merge(tmp_path / "1")
    with pytest.raises(ClenchError, match="is not merged"):
        open_dataset(tmp_path / "1")
    shutil.copytree(tmp_path / "2", tmp_path / "1", dirs_exist_ok=True)
    assert merge(tmp_path / "1").rows == 400
    assert same(tmp_path / "1", unbroken)


def test_an_interrupted_run_keeps_whole_units(tmp_path: Path, unbroken: Path) -> None:
    def interrupted(job: DatasetJob, units: list) -> object:
        yield from slowly(job, units[:5], 0.0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate(JOB, tmp_path, runner=interrupted)
    (manifest,) = (tmp_path / "manifests").glob("*.json")
    document = json.loads(manifest.read_text())
    assert (len(document["units"]), document["waiting"], document["complete"]) == (5, 59, False)
    asked: list = []
    report = generate(JOB, tmp_path, runner=lambda job, units: slowly(job, asked.extend(units) or units, 0.0))
    assert (report.found, len(asked)) == (5, 59)
    assert same(tmp_path, unbroken)


def test_what_a_killed_run_left_half_written_is_removed(tmp_path: Path) -> None:
    run(tmp_path, Shard(1, 2))
    mine = next(unit for unit in JOB.units() if Shard(1, 2).has(unit))
    other = next(unit for unit in JOB.units() if not Shard(1, 2).has(unit))
    left = [tmp_path / "parts" / f".{unit.key}.parquet.00ff.part" for unit in (mine, other)]
    for file in left:
        file.write_bytes(b"half")
    run(tmp_path, Shard(1, 2))
    assert [file.exists() for file in left] == [False, True]


def test_a_unit_that_failed_is_kept_and_tried_again(tmp_path: Path, unbroken: Path) -> None:
    def failing(job: DatasetJob, units: list) -> object:
        for unit in units:
            result = make_result(job, unit)
            bad = unit.object == "mug" and unit.hand == "patent15"
            failed = replace(result.record, status="failed", reason="Bad mug.", rows=0, ok=0, sha256=None)
            yield replace(result, record=failed, part=None) if bad else result

    report = generate(JOB, tmp_path, runner=failing)
    assert report.merged is not None
    assert (report.merged.rows, report.merged.failed, len(report.failed)) == (300, 16, 16)
    document = json.loads((tmp_path / "manifest.json").read_text())
    assert {u["reason"] for u in document["units"] if u["status"] == "failed"} == {"Bad mug."}
    assert "Bad mug." in (tmp_path / "DATASET.md").read_text()
    assert run(tmp_path).found == 48
    assert same(tmp_path, unbroken)


def test_a_folder_with_something_else_is_refused_and_stays_as_it_is(tmp_path: Path, copied: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.*")}
    other = DatasetJob(**(JOB.document() | {"seed": 1}))
    with pytest.raises(ClenchError, match=r"holds another dataset: it differs in seed; give --out another folder"):
        run(copied, job=other)
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.*")} == before
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.tex").write_text("x")
    with pytest.raises(ClenchError, match=r"holds other files \('thesis.tex'\) and no dataset"):
        run(tmp_path / "b")
    assert [file.name for file in (tmp_path / "b").iterdir()] == ["thesis.tex"]
    with pytest.raises(ClenchError, match="is a file"):
        run(tmp_path / "b" / "thesis.tex")


@pytest.mark.parametrize("name", ["job.json", "manifests/1-of-1.json"])
@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("clench_version", "0.0.9", r"is of clench 0\.0\.9, this is "),
        ("schema", "clench.other/7", r"schema: expected 'clench\.dataset_\w+/1', got 'clench\.other/7'"),
    ],
)
def test_another_version_is_refused(copied: Path, name: str, key: str, value: str, said: str) -> None:
    file = copied / name
    file.write_text(json.dumps(json.loads(file.read_text()) | {key: value}))
    with pytest.raises(ClenchError, match=said):
        run(copied)
    with pytest.raises(ClenchError, match=said):
        merge(copied)


def test_a_manifest_of_another_dataset_is_refused(tmp_path: Path, copied: Path) -> None:
    run(tmp_path / "b", Shard(1, 2), job=DatasetJob(**(JOB.document() | {"seed": 1})))
    source = tmp_path / "b" / "manifests" / "1-of-2.json"
    (copied / "manifests" / "2-of-2.json").write_bytes(source.read_bytes())
    with pytest.raises(ClenchError, match="is of another dataset"):
        run(copied)


@pytest.mark.parametrize("with_manifest", [True, False])
@pytest.mark.parametrize("damage", ["cut", "changed", "flipped", "other"])
def test_a_part_that_is_not_whole_is_refused(copied: Path, damage: str, with_manifest: bool) -> None:
    part = DatasetFolder.open(copied).part(next(iter(JOB.units())).key)
    content = part.read_bytes()
    if damage == "other":
        content = parts(copied)[0].read_bytes() if parts(copied)[0] != part else parts(copied)[1].read_bytes()
    flipped = content[:400] + bytes([content[400] ^ 1]) + content[401:]
    changed = {"cut": content[:-100], "changed": content[:-4] + b"PARE", "flipped": flipped, "other": content}
    part.write_bytes(changed[damage])
    if not with_manifest:
        (copied / "manifests" / "1-of-1.json").unlink()
    with pytest.raises(ClenchError, match=r"remove it, and 'clench generate' makes it again"):
        run(copied)
    part.unlink()
    assert run(copied).found == 63


def test_parts_of_other_models_are_not_merged(tmp_path: Path) -> None:
    def changed(job: DatasetJob, units: list) -> object:
        for number, unit in enumerate(units):
            result = make_result(job, unit)
            yield replace(result, record=replace(result.record, object_hash="p")) if number == 1 else result

    with pytest.raises(ClenchError, match="was made from another 'mug' than"):
        generate(JOB, tmp_path, runner=changed)


def test_shards_that_begin_at_once_do_not_refuse_each_other(tmp_path: Path) -> None:
    def begin(path: Path) -> None:
        folder = DatasetFolder(path, JOB)
        folder.check()
        folder.prepare()

    with ThreadPoolExecutor(8) as pool:
        for number in range(20):
            list(pool.map(begin, [tmp_path / str(number)] * 8))
            assert DatasetFolder.open(tmp_path / str(number)).job.hash == JOB.hash
