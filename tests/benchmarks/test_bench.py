"""The benchmark: it checks its answers, refuses to time wrong ones, and prints what can be read by a program."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import BENCHMARKS, main
from benchmarks.bench_report import BenchReport, describe_place
from benchmarks.speed import choice_timing, packing_time, solving
from benchmarks.speed.answer_checks import Checked, Surface, check_answer, triangle_distances
from clench.closing.kernel_run import empty_answers, run_stages, solve_packed
from clench.core.exceptions import CommandError, UnknownNameError
from clench.kernels.closing.solve_layout import BLOCK, CHOOSE, CLOSE, FINISH
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.scoring.calibration import calibration_of
from clench.solver.alternatives import candidates_of, finger_candidates
from clench.solver.problem import make_context, make_problem
from clench.solver.solution import GraspSolution
from handmade import make_solution

SMALL = ["solve", "--poses", "2", "--passes", "2", "--planes", "3"]


@pytest.fixture(scope="module")
def problem() -> tuple[clench.Hand, clench.GraspObject, GraspSolution]:
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("mug")
    pose = clench.approach_poses(hand, obj, 1, 0)[0]
    return hand, obj, clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, planes=2, preshape="open"))


def wrong(solution: GraspSolution, again: GraspSolution, obj: clench.GraspObject) -> list[str]:
    return list(check_answer(solution, again, Surface(obj), Checked()))


def test_solve_prints_flat_lines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(SMALL) == 0
    lines = dict(line.split(" ", 1) for line in capsys.readouterr().out.splitlines())
    assert lines["answers_right"] == "True"
    assert int(lines["checked_contacts"]) > 0
    assert lines["fingers"] == "5"
    assert lines["degrees_of_freedom"] == "15"
    times = [float(lines[f"solve_{name}_ms"]) for name in ("median", "p90", "p99", "max")]
    assert 0.0 < times[0] <= times[1] <= times[2] <= times[3]
    for part in ("read", "plan", "close", "assemble"):
        assert float(lines[f"stage_{part}_median_ms"]) >= 0.0
    assert float(lines["then_read_contacts_median_ms"]) <= float(lines["then_read_everything_max_ms"])
    stages = [f"{kind}_{stage}_median_ms" for kind in ("width", "planes") for stage in ("close", "choose", "finish")]
    assert all(float(lines[stage]) > 0.0 for stage in stages)
    statuses = [int(lines[f"status_{s}"]) for s in ("grasp", "partial", "no_contact", "blocked")]
    assert sum(statuses) == 2


def test_solve_prints_one_json_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SMALL, "--object", "cylinder:r=0.03,h=0.1", "--hand", "robonaut2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "clench.bench/1"
    assert document["errors"] == []
    assert document["hand"] == "robonaut2"
    assert document["checked_surface_contacts"] == 0  # round objects have no triangles to compare with
    assert {"commit", "python_version", "numba_version", "processor", "cores"} <= set(document)


def test_wrong_answers_are_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(solving, "check_answer", lambda *_: iter(["a link floats."]))
    assert main(SMALL) == 1
    captured = capsys.readouterr()
    assert "wrong answer: pose 0: a link floats." in captured.err
    assert "answers_right False" in captured.out
    assert "solve_median_ms" not in captured.out


def test_a_right_answer_passes(problem: tuple[clench.Hand, clench.GraspObject, GraspSolution]) -> None:
    _, obj, solution = problem
    checked = Checked()
    assert list(check_answer(solution, solution, Surface(obj), checked)) == []
    assert checked.contacts >= checked.surface_contacts > 0


def test_the_check_sees_what_is_wrong(problem: tuple[clench.Hand, clench.GraspObject, GraspSolution]) -> None:
    _, obj, solution = problem
    joint = next(iter(solution.joint_angles))
    beyond = replace(solution, joint_angles={**solution.joint_angles, joint: solution.joint_limits[joint][1] + 1e-6})
    assert any("outside its limits" in s for s in wrong(beyond, beyond, obj))
    nan = replace(solution, joint_angles={**solution.joint_angles, joint: np.nan})
    assert wrong(nan, nan, obj) == [f"joint_angles.{joint} is not a finite number."]
    assert wrong(solution, replace(solution, max_penetration=1.0), obj) == ["the same question gave another answer."]
    moved = replace(solution.contacts[0], position=solution.contacts[0].position + 0.2)
    floating = replace(solution, contacts=(moved,))
    assert any("from the object's surface" in s for s in wrong(floating, floating, obj))


@pytest.mark.parametrize(("gap", "right"), [(2e-6, False), (-2e-9, False), (5e-7, True), (-5e-10, True)])
def test_the_check_looks_at_gaps(gap: float, right: bool) -> None:
    solution = make_solution()
    fingers = {}
    for name, finger in solution.fingers.items():
        moved = [replace(c, contacts=tuple(replace(t, gap=gap) for t in c.contacts)) for c in finger.candidates]
        fingers[name] = replace(finger, candidates=tuple(moved))
    changed = replace(solution, fingers=fingers)
    found = [s for s in wrong(changed, changed, clench.GraspObject.load("sphere:r=0.03")) if "with a gap of" in s]
    assert (found == []) is right


def test_the_surface_is_the_posed_one() -> None:
    box = clench.GraspObject.load("box:x=0.1,y=0.1,z=0.1", pose=clench.Pose([1.0, 0.0, 0.0]))
    assert Surface(box).distance(np.array([1.07, 0.0, 0.0])) == pytest.approx(0.02)
    assert Surface(clench.GraspObject.load("sphere:r=0.03")).distance(np.zeros(3)) is None


def test_distances_from_triangles() -> None:
    flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    line = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    dot = [[0.0, 0.0, 0.0]] * 3
    triangles = np.array([flat, line, dot])
    for point, expected in [
        ((0.2, 0.2, 0.3), (0.3, np.hypot(0.2, 0.3), np.sqrt(0.17))),  # over the face
        ((0.2, 0.2, -0.3), (0.3, np.hypot(0.2, 0.3), np.sqrt(0.17))),  # under it
        ((0.5, -2.0, 0.0), (2.0, 2.0, np.sqrt(4.25))),  # before an edge
        ((1.0, 1.0, 0.0), (np.sqrt(0.5), 1.0, np.sqrt(2.0))),  # before the long edge
        ((-3.0, 0.0, 4.0), (5.0, 5.0, 5.0)),  # before a corner
        ((0.25, 0.25, 0.0), (0.0, 0.25, np.sqrt(0.125))),  # on the face
    ]:
        assert triangle_distances(triangles, np.array(point)) == pytest.approx(np.array(expected), abs=1e-15)


@pytest.mark.parametrize("full_width", [True, False])
def test_stages_one_after_another_give_the_answer_of_one_call(full_width: bool) -> None:
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    pose = clench.approach_poses(hand, ball, 1, 0)[0]
    command = clench.GraspCommand(hand_pose=pose, preshape="open", planes=2, full_width=full_width)
    times = solving.stage_times(hand, ball, command)
    assert list(times) == ["close", "choose", "finish"]
    problem = make_problem(hand, ball, command)
    packed = candidates_of(problem, calibration_of(None)).problem
    apart, T = empty_answers(packed, 1), problem.T_palm_object[None, :3]
    for stage in (CLOSE, BLOCK, CHOOSE, FINISH):
        run_stages(packed, T, apart, stage)
    at_once = solve_packed(packed, T).solved
    for one, other in zip(apart.solved, at_once, strict=True):
        np.testing.assert_array_equal(one, other)
    assert at_once.contacts.any()


def test_distribution_is_in_milliseconds() -> None:
    report = BenchReport()
    report.distribution("t", [0.001] * 98 + [0.002, 0.5])
    assert report.values["t_median_ms"] == pytest.approx(1.0)
    assert report.values["t_p90_ms"] == pytest.approx(1.0)
    assert report.values["t_max_ms"] == pytest.approx(500.0)
    assert next(report.lines()) == "t_median_ms 1"


def test_the_place_is_described() -> None:
    place: dict[str, Any] = describe_place()
    assert place["clench_version"] == clench.__version__
    assert all(value != "" for value in place.values())
    assert int(place["cores"]) >= 1


@pytest.mark.parametrize("option", ["--planes", "--poses", "--passes"])
def test_counts_of_nothing_are_refused(option: str) -> None:
    with pytest.raises(CommandError, match=f"{option}: expected at least 1, got 0"):
        main(["solve", option, "0"])


def test_unknown_benchmark_names_those_there_are() -> None:
    with pytest.raises(UnknownNameError, match="solve"):
        main(["solv"])


def test_help_lists_the_benchmarks(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"\n  {name} " in out for name in BENCHMARKS)
    assert main(["solve", "--help"]) == 0
    assert "--passes" in capsys.readouterr().out


def test_choose_is_checked_and_timed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["choose", "--poses", "2", "--passes", "1", "--alternatives", "3"]) == 0
    lines = dict(line.split(" ", 1) for line in capsys.readouterr().out.splitlines())
    assert lines["answers_right"] == "True"
    assert lines["alternatives"] == "3"
    assert float(lines["choose_additive_median_ms"]) > 0.0
    assert float(lines["choose_steady_median_ms"]) > 0.0
    assert float(lines["combinations_tried_additive_median"]) == 0.0


def test_a_wrong_choice_is_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(choice_timing, "_wrong", lambda *_: ["steady: chose 1, the best is 2."])
    assert main(["choose", "--poses", "1", "--passes", "1", "--alternatives", "2"]) == 1
    printed = capsys.readouterr()
    assert "choose_steady_median_ms" not in printed.out
    assert "pose 0: steady: chose 1" in printed.err


def test_the_check_of_choices_sees_one_that_is_not_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("mug")
    pose = clench.approach_poses(hand, obj, 1, 0)[0]
    command = clench.GraspCommand(hand_pose=pose, planes=1, open_variants=(0.0, 0.1), preshape="open")
    problem = make_problem(hand, obj, command)
    groups = [[c for c in g if c.plane is None] for g in finger_candidates(problem)]
    context = make_context(problem, choice_timing.ADDITIVE)
    assert choice_timing._wrong(groups, context) == []
    real = choice_timing.choose

    def worst(given: Any, calibration: Any, context: Any) -> Any:
        choice = real(given, calibration, context)
        return replace(choice, total=choice.total - 1.0) if len(given[0]) > 1 else choice

    monkeypatch.setattr(choice_timing, "choose", worst)
    assert len(choice_timing._wrong(groups, context)) == 2


def test_packing_checks_times_and_weighs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    mesh = tmp_path / "cube.obj"
    corners = [f"v {x} {y} {z}" for x in (0, 0.05) for y in (0, 0.05) for z in (0, 0.05)]
    mesh.write_text("\n".join([*corners, "f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]))
    assert (
        main(["packing", "--triangles", "30000", "--passes", "1", "--points", "3", "--mesh", str(mesh), "--json"]) == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert found["answers_right"] is True
    assert found["file_0_cube_triangles"] == 12
    for name in ("sphere", "scan"):
        assert found[f"{name}_triangles"] == 12 * 50**2
        # Besides the triangles there is the grid of distances, of at most 0.5 MB.
        assert found[f"{name}_packed_mb"] * 1e6 <= 200.0 * 12 * 50**2 + 0.5e6
        assert min(found[f"{name}_{stage}_processor_s"] for stage in ("load", "pack")) > 0.0


def test_packing_reports_wrong_distances(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    exact = packing_time.triangle_distances
    monkeypatch.setattr(packing_time, "triangle_distances", lambda *given: exact(*given) + 1e-6)
    assert main(["packing", "--triangles", "1200", "--passes", "1", "--points", "1"]) == 1
    assert "by all triangles" in capsys.readouterr().err


def test_steadiness_checks_times_and_draws(capsys: pytest.CaptureFixture[str], tmp_path) -> None:
    picture = tmp_path / "bound.png"
    small = ["steadiness", "--contacts", "5", "--grasps", "6", "--passes", "1", "--plot", str(picture), "--json"]
    assert main(small) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["errors"] == []
    assert document["force_closure"] > 0
    assert 0.0 < document["bound_of_exact_median"] <= 1.0
    for part in ("epsilon", "bound", "volume", "least_torque", "squeeze"):
        assert 0.0 < document[f"{part}_median_ms"] <= document[f"{part}_max_ms"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_steadiness_refuses_to_time_wrong_bounds(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    from benchmarks.speed import epsilon_timing

    monkeypatch.setattr(epsilon_timing, "epsilon_bound", lambda held: 2.0)
    assert main(["steadiness", "--contacts", "4", "--grasps", "1", "--passes", "1"]) == 1
    captured = capsys.readouterr()
    assert "the lower bound 2.000000000 is above epsilon" in captured.err
    assert "epsilon_median_ms" not in captured.out


def test_solve_says_which_geometry_and_order_it_times(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--object", "sphere:r=0.03", "--collision-source", "visual", "--order", "fingertip", "--json"]
    assert main([*SMALL, *options]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["collision_source"], document["order"]) == ("visual", "fingertip")
    assert 0.0 < document["solve_processor_least_median_ms"] <= document["solve_processor_least_max_ms"]


def test_triangles_are_counted_as_they_are_closed() -> None:
    """With `engine` meshes are convex hulls: their own triangles are not those that times belong to."""
    hand, mug = clench.Hand.load("patent15"), clench.GraspObject.load("mug").bodies[0].shapes[0]
    assert mug.mesh is not None
    box = Shape(ShapeKind.BOX, (0.01, 0.01, 0.01))
    shapes = {CollisionSource.ENGINE: (mug, box), CollisionSource.VISUAL: (mug, box)}
    meshed = replace(hand, links=(replace(hand.links[0], shapes=shapes), *hand.links[1:]))
    before = solving.link_triangles(hand, CollisionSource.VISUAL)
    assert solving.link_triangles(meshed, CollisionSource.VISUAL) == before + len(mug.mesh.triangles)
    hull = solving.link_triangles(meshed, CollisionSource.ENGINE)
    assert 100 < hull < len(mug.mesh.triangles) / 4
