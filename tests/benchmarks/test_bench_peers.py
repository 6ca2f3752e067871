"""`clench bench peers`: baselines against closed forms and another engine, and what it refuses to time."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.peers import closers
from benchmarks.peers.closers import PeerCase, wrong_ends
from benchmarks.peers.fcl_engine import Engine
from benchmarks.peers.peer_sweep import FACTORS, blade_misses, with_wires
from benchmarks.peers.stepper import RULES, Stepper
from chain_hands import one_link
from clench.closing.collision.packed_object import pack_object
from clench.core.exceptions import CommandError, FileError
from clench.core.pose import Pose
from clench.models.shapes import CollisionSource

SMALL = ["peers", "--object", "ball", "--poses", "1", "--passes", "1", "--planes", "1"]
GRASPIT, SIMOX, OPENRAVE = RULES


@pytest.fixture(scope="module")
def case() -> PeerCase:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    return PeerCase(hand, mug, clench.approach_poses(hand, mug, 2, 1)[1:], 1)


def circle_angle(radius: float, x: float, z: float, thickness: float) -> float:
    """Return where a straight link through the origin touches a circle (docs/method.md section 3)."""
    return float(np.arctan2(z, x) - np.arcsin((radius + thickness) / np.hypot(x, z)))


@pytest.mark.parametrize(("x", "z", "radius"), [(0.05, 0.04, 0.012), (0.08, 0.05, 0.01), (0.03, 0.09, 0.02)])
def test_rules_end_where_the_closed_form_says(x: float, z: float, radius: float) -> None:
    hand, ball = one_link(), clench.GraspObject.load(f"sphere:r={radius}")
    T = Pose([x, 0.0, z]).matrix
    right = circle_angle(radius, x, z, 0.008)
    stepper = Stepper(hand, ball, hand.open_angles(), CollisionSource.ENGINE)
    ends = {rule.name: stepper.close(rule, T) for rule in RULES}
    assert right - SIMOX.step < ends["simox_like"].q[0] <= right
    assert right < ends["openrave_like"].q[0] <= right + OPENRAVE.fine
    assert right - GRASPIT.fine / (np.hypot(x, z) - radius - 0.01) < ends["graspit_like"].q[0] <= right
    gap = Engine(hand, ball, pack_object(ball), CollisionSource.ENGINE).finger_gap(
        hand.fingers[0], hand.link_poses(ends["graspit_like"].q), T, ends["graspit_like"].q
    )
    assert 0.0 < gap < GRASPIT.fine
    for closing in ends.values():
        assert closing.stops.tolist() == [2]
        assert closing.tally[0] > 5
    steps = int(right / SIMOX.step)
    assert ends["simox_like"].tally[0] == steps + 2  # one that collides, and the one more round


def test_rules_end_at_limits_without_an_object_in_the_way() -> None:
    hand, ball = one_link(upper=1.0), clench.GraspObject.load("sphere:r=0.01")
    stepper = Stepper(hand, ball, hand.open_angles(), CollisionSource.ENGINE)
    for rule in RULES:
        closing = stepper.close(rule, Pose([1.0, 0.0, 0.0]).matrix)
        assert closing.q.tolist() == [1.0]
        assert closing.stops.tolist() == [1]


def test_wrong_answers_are_seen(case: PeerCase, monkeypatch: pytest.MonkeyPatch) -> None:
    assert list(wrong_ends(case)) == []
    real = case.engine.link_gap
    monkeypatch.setattr(case.engine, "link_gap", lambda *given: real(*given) + 0.02)
    found = list(wrong_ends(case))
    assert any("graspit_like was told True" in s for s in found)
    assert any("our certified" in s and "ends at a gap" in s for s in found)
    monkeypatch.undo()
    solve = case.solve

    def opened(full_width: bool, k: int) -> clench.GraspSolution:
        solution = solve(full_width, k)
        return replace(solution, joint_angles={n: 0.9 * a for n, a in solution.joint_angles.items()})

    object.__setattr__(case, "solve", opened)
    assert any("ends at a gap of" in s for s in wrong_ends(case))
    object.__delattr__(case, "solve")


def test_a_mesh_that_is_crossed_has_a_depth(case: PeerCase) -> None:
    q, T = case.hand.open_angles(), case.T_palm_object(0)
    finger = case.hand.fingers[1]
    ended = case.step(OPENRAVE, 0)
    further = ended.q + 0.1 * (ended.q - q)
    assert case.engine.finger_gap(finger, case.hand.link_poses(further), T, further) < 0.0
    assert case.engine.finger_gap(finger, case.hand.link_poses(q), T, q) > 0.0


def test_wires_are_thin_and_large_steps_go_through_a_blade() -> None:
    wires = with_wires(clench.Hand.load("robonaut2"))
    moving = {link for finger in wires.fingers for link in finger.links}
    for link in moving:
        for shape in wires.links[link].shapes[CollisionSource.ENGINE]:
            low, high = (f(shape.pose.apply(shape.to_mesh(1e-4).vertices)[:, :2].T, axis=1) for f in (np.min, np.max))
            assert min(high - low) <= 1.001e-3
    misses = blade_misses(clench.Hand.load("robonaut2"), 3, 0, 1)
    assert misses.errors == []
    assert misses.values["clench_certified_missed"] == 0
    assert int(misses.values["openrave_like_touches"]) > 3
    for shares in misses.shares.values():
        assert shares[-1] == 0.0
    assert misses.shares["openrave_like"][FACTORS.index(8.0)] > 0.0


def test_it_prints_times_gaps_and_a_picture(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    picture, table = tmp_path / "peers.png", tmp_path / "peers.md"
    assert main([*SMALL, "--plot", str(picture), "--table", str(table), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["answers_right"] is True
    assert document["ball_clench_certified_residual_max_mm"] < 0.005
    assert 0.0 < document["ball_graspit_like_residual_median_mm"] < 0.2
    for name in ("graspit_like", "simox_like", "openrave_like", "mujoco"):
        assert document[f"ball_{name}_median_ms"] > 0.0
        assert document[f"ball_{name}_queries"] > 0
        assert document[f"ball_{name}_over_clench_certified"] > 0.0
        assert document[f"ball_{name}_least_ms"] <= document[f"ball_{name}_median_ms"]
    assert picture.read_bytes().startswith(b"\x89PNG")
    lines = table.read_text(encoding="utf-8").splitlines()
    assert len(lines) == 2 + 8
    assert len({line.count("|") for line in lines}) == 1


def test_wrong_answers_are_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(closers, "_wrong_queries", lambda *_: iter(["told the wrong thing."]))
    assert main([*SMALL, "--no-simulate"]) == 1
    printed = capsys.readouterr()
    assert "ball, pose 0: told the wrong thing." in printed.err
    assert "median_ms" not in printed.out


def test_bad_options_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="--poses: expected at least 1"):
        main(["peers", "--poses", "0"])
    with pytest.raises(FileError, match="no folder"):
        main([*SMALL, "--plot", str(tmp_path / "missing" / "a.png")])
    for option in ("--plot", "--table"):
        with pytest.raises(FileError, match="it is a folder"):
            main([*SMALL, option, str(tmp_path)])
    monkeypatch.setitem(sys.modules, "fcl", None)
    with pytest.raises(CommandError, match=r"pip install python-fcl"):
        main(SMALL)
