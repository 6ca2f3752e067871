"""`clench bench hands`: right answers are timed in processes of their own, beside another version, and kept."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.users import hand_times
from benchmarks.users.kept_ratios import Ratio, check_header, keep_ratios
from benchmarks.users.timing_workers import BatchCase, Worker, differing
from clench.core.exceptions import CommandError, FileError

SMALL = ["hands", "--hand", "robonaut2", "patent15", "--object", "ball", "--poses", "2", "--passes", "1", "--json"]


def test_each_case_has_a_time_and_ratios(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    kept = tmp_path / "ratios.csv"
    options = ["--order", "proximal-first", "fingertip", "--other", sys.executable, "--keep", str(kept)]
    assert main([*SMALL, *options]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["errors"] == []
    assert found["robonaut2_elements"] > 5
    assert found["robonaut2_ball_proximal-first_over_robonaut2"] == 1.0
    for case in ("robonaut2_ball_proximal-first", "patent15_ball_fingertip"):
        assert found[f"{case}_processor_ms"] > 0.0
        assert found[f"{case}_over_other"] > 0.0
        assert found[f"{case}_poses_that_differ"] == 0
    assert found["patent15_ball_fingertip_over_proximal-first"] > 0.0
    header, *rows = kept.read_text().splitlines()
    assert header == "commit,hand,object,order,geometry,processor_ms,over_other"
    assert [row.split(",")[1:5] for row in rows] == [
        [hand, "ball", order, "default"]
        for hand in ("robonaut2", "patent15")
        for order in ("proximal-first", "fingertip")
    ]


def test_wrong_answers_are_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(hand_times, "wrong_answers", lambda *_: iter(["pose 0: another number of contacts."]))
    assert main(SMALL) == 1
    captured = capsys.readouterr()
    assert "robonaut2, ball, proximal-first: pose 0: another number of contacts." in captured.err
    assert "processor_ms" not in captured.out


def test_a_worker_has_the_answers_of_this_process() -> None:
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    pose = clench.approach_poses(hand, ball, 1, 0)[0]
    command = clench.GraspCommand(hand_pose=pose, preshape="open", measure=False)
    row = [*map(float, pose.wxyz), *map(float, pose.position)]
    with Worker(sys.executable, [BatchCase("patent15", None, "ball", 1.0, "proximal-first", [row])]) as worker:
        expected = list(clench.solve(hand, ball, command).joint_angles.values())
        np.testing.assert_array_equal(worker.angles(0), [expected])
        assert worker.answers[0]["status"] == [clench.solve(hand, ball, command).status.value]
        assert worker.time(0) > 0.0


def test_angles_that_differ_are_counted() -> None:
    ours = np.zeros((3, 2))
    assert differing(ours, ours) == 0
    assert differing(ours, np.array([[0.0, 0.0], [0.0, 2e-9], [1e-10, 0.0]])) == 1
    assert differing(ours, np.zeros((3, 4))) == 3


def test_a_python_without_the_package_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="expected a Python of an environment with clench"):
        Worker(str(tmp_path / "python"), [])
    bare = tmp_path / "bare"
    bare.write_text("#!/bin/sh\nexit 1\n")
    bare.chmod(0o755)
    if sys.platform != "win32":
        with pytest.raises(CommandError, match="the process ended"):
            Worker(str(bare), [])


def test_ratios_are_appended(tmp_path: Path) -> None:
    file, row = tmp_path / "ratios.csv", Ratio("hand", "mug", "together", "visual", 1.23456, 0.5)
    for commit in ("one", "two"):
        keep_ratios(file, commit, [row, row._replace(object="a,b")])
    assert file.read_text().splitlines()[1:3] == [
        "one,hand,mug,together,visual,1.235,0.5",
        'one,hand,"a,b",together,visual,1.235,0.5',
    ]
    assert len(file.read_text().splitlines()) == 5
    check_header(file)
    file.write_text("something,else\n")
    with pytest.raises(FileError, match="expected the header commit,hand"):
        check_header(file)


def test_a_file_for_ratios_needs_another_version(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="--keep: expected --other"):
        main([*SMALL, "--keep", str(tmp_path / "ratios.csv")])
    other = tmp_path / "notes.csv"
    other.write_text("something,else\n")
    with pytest.raises(FileError, match="expected the header"):
        main([*SMALL, "--other", sys.executable, "--keep", str(other)])
    assert other.read_text() == "something,else\n"


def test_elements_are_those_of_the_geometry() -> None:
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    fewer = replace(hand, links=(replace(hand.links[0], shapes={}), *hand.links[1:]))
    assert 0 < hand_times.swept_elements(fewer, ball) < hand_times.swept_elements(hand, ball)
