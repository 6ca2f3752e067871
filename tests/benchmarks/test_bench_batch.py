"""`clench bench batch`: it refuses to time wrong answers, and to call a growing stream constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.speed import many_poses

SMALL = ["batch", "--object", "ball", "--poses", "2", "--passes", "1", "--planes", "2", "--stream", "5"]


def test_it_prints_rates_and_memory(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(many_poses, "CHUNK", 2)
    assert main(SMALL) == 0
    lines = dict(line.split(" ", 1) for line in capsys.readouterr().out.splitlines())
    assert lines["answers_right"] == "True"
    for key in ("certified_1_threads", "planes_1_threads"):
        assert float(lines[f"{key}_per_s"]) > 0.0
        assert float(lines[f"{key}_processor_ms"]) > 0.0
    assert lines["stream_poses"] == "5"
    assert float(lines["stream_memory_mb"]) > 10.0


def test_a_stream_that_grows_is_an_error(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    grown = iter(range(0, 10**12, 10**8))
    monkeypatch.setattr(many_poses, "_resident", lambda: next(grown))
    monkeypatch.setattr(many_poses, "CHUNK", 1)
    assert main(SMALL) == 1
    assert "a stream of 5 poses grew by" in capsys.readouterr().err


def test_wrong_answers_are_seen() -> None:
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    poses = clench.approach_poses(hand, obj, 2, 0)
    command = clench.GraspCommand(hand_pose=poses[0], planes=1, preshape="open")
    batch = clench.solve_batch(hand, obj, poses, command)
    alone = [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses]
    assert list(many_poses.wrong_answers(batch, alone)) == []
    nudged = batch.joint_angles.copy()
    nudged[1, 0] = np.nextafter(nudged[1, 0], 9.0)
    (sentence,) = many_poses.wrong_answers(replace(batch, joint_angles=nudged), alone)
    assert sentence.startswith("pose 1: joint angles are off by up to")
    (sentence,) = many_poses.wrong_answers(replace(batch, certified=~batch.certified), alone)
    assert "pose 0" in sentence
    (sentence,) = many_poses.wrong_answers(replace(batch, finger_codes=batch.finger_codes + 1), alone)
    assert sentence == "pose 0: a finger ends in another way."
