"""`clench bench planning`: plans are checked and timed."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.users import planning_times

SMALL = ["planning", "--object", "ball", "--grasps", "2", "--proposals", "64", "--json"]


def test_a_plan_is_timed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(SMALL) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["errors"] == []
    assert found["robonaut2_ball_returned"] == 2
    assert 2 <= found["robonaut2_ball_force_closed"] <= found["robonaut2_ball_closed"] <= 64
    assert 0.0 < found["robonaut2_ball_first_s"] <= found["robonaut2_ball_all_s"]
    assert found["robonaut2_ball_force_closed_per_s"] > found["robonaut2_ball_returned_per_s"] > 0.0


def test_the_check_sees_wrong_grasps(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    plan = clench.plan_grasps(hand, ball, 1, most=64)
    assert list(planning_times.wrong_grasps(plan, hand, ball)) == []
    assert "no grasp was found" in next(planning_times.wrong_grasps(replace(plan, grasps=()), hand, ball))
    (grasp,) = plan
    unproved = replace(grasp, solution=replace(grasp.solution, certified=False))
    found = list(planning_times.wrong_grasps(replace(plan, grasps=(unproved,)), hand, ball))
    assert "grasp 0 is not certified." in found
    monkeypatch.setattr(planning_times, "wrong_grasps", lambda *_: iter(found))
    assert main(SMALL) == 1
    assert "robonaut2, ball: grasp 0 is not certified." in capsys.readouterr().err
