"""Files of grasps become lists to look through."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from clench import ClenchError, FileError
from clench.apps.cli.inputs.scene_options import with_scene
from clench.apps.cli.main import main
from clench.apps.viewer.grasps.grasp_files import GraspFiles, same_command
from clench.apps.viewer.grasps.planned_list import plan_list
from clench.apps.viewer.opening import Given, open_list, open_session
from clench.apps.viewer.session.live_session import LiveSession


def reader(hand: str | None = None, object: str | None = None) -> GraspFiles:
    return GraspFiles(
        clench.Hand.load,
        lambda model, scale, source: clench.GraspObject.load(model, scale=scale, collision_source=source),
        hand,
        object,
    )


@pytest.fixture(scope="module")
def plan() -> clench.GraspPlan:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    return clench.plan_grasps(hand, mug, 3, path=False)


@pytest.fixture(scope="module")
def solutions(plan: clench.GraspPlan) -> list[dict[str, Any]]:
    named = {"hand_model": "robonaut2", "object_model": "mug"}
    return [{**grasp.solution.to_dict(), **named} for grasp in plan]


def test_a_plan_is_listed_with_scores_kinds_and_tests(
    plan: clench.GraspPlan, solutions: list[dict[str, Any]], tmp_path: Path
) -> None:
    document = plan.to_dict()
    for entry, solution in zip(document["grasps"], solutions, strict=True):
        entry["solution"] = solution
    document["grasps"][1]["hold"] = {"held": False}
    (tmp_path / "plan.json").write_text(json.dumps(document))
    listed = reader().read(tmp_path / "plan.json")
    assert [g.score for g in listed] == [g.score for g in plan]
    assert [g.kind for g in listed] == [str(g.kind) for g in plan]
    assert [g.held for g in listed] == [None, False, None]
    for entry, grasp in zip(listed, plan, strict=True):
        again = clench.solve(clench.Hand.load("robonaut2"), clench.GraspObject.load("mug"), entry.command())
        assert again.joint_angles == grasp.joint_angles
        assert entry.posture is not None
        np.testing.assert_array_equal(entry.posture(), list(grasp.joint_angles.values()))


def test_solutions_and_lists_of_them_are_listed(solutions: list[dict[str, Any]], tmp_path: Path) -> None:
    (tmp_path / "one.json").write_text(json.dumps(solutions[0]))
    (tmp_path / "all.json").write_text(json.dumps(solutions))
    assert [g.name for g in reader().read(tmp_path / "one.json")] == ["one"]
    assert [g.name for g in reader().read(tmp_path / "all.json")] == ["all 1", "all 2", "all 3"]


def test_a_record_is_listed_with_its_outcomes(solutions: list[dict[str, Any]], tmp_path: Path) -> None:
    with clench.Record(tmp_path / "record.sqlite") as record:
        ids = record.extend([clench.GraspSolution.from_dict(each) for each in solutions])
        record.note_outcome(ids[0], held=True)
    listed = {g.name: g.held for g in reader().read(tmp_path / "record.sqlite")}
    assert listed == {f"solve {ids[0]}": True, f"solve {ids[1]}": None, f"solve {ids[2]}": None}


def test_a_batch_is_listed(plan: clench.GraspPlan, tmp_path: Path) -> None:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    poses = np.array([grasp.hand_pose.wxyz_xyz for grasp in plan])
    clench.solve_batch(hand, mug, poses, plan[0].command).save(tmp_path / "batch.npz")
    listed = reader("robonaut2", "mug").read(tmp_path / "batch.npz")
    assert listed
    assert {g.object for g in listed} == {"mug"}


def test_a_dataset_is_listed_and_its_commands_solve_to_its_rows(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    assert main(["generate", "--hands", "robonaut2", "--objects", "mug", "--count", "2", "--out", str(tmp_path)]) == 0
    read = reader()
    listed = read.read(tmp_path)
    # Grasps that failed are rows, too.
    ok = parquet.read_table(tmp_path / "grasps.parquet")["ok"].to_pylist()
    assert ok.count(True) == 2
    assert [not grasp.rejected for grasp in listed] == ok
    for grasp in listed:
        assert grasp.kind
        assert (grasp.score is None) == bool(grasp.rejected)
        solution = clench.solve(read.hands[grasp.hand], read.objects[grasp.object], grasp.command())
        assert grasp.posture is not None
        np.testing.assert_allclose(list(solution.joint_angles.values()), grasp.posture(), atol=1e-12)
        T = solution.object_pose.inverse() @ solution.hand_pose
        np.testing.assert_allclose(T.matrix, grasp.T_object_palm.matrix, atol=1e-12)


def test_grasps_of_another_program_need_a_hand_and_an_object(plan: clench.GraspPlan, tmp_path: Path) -> None:
    clench.export_grasps(tmp_path / "grasps.yaml", [grasp.solution for grasp in plan])
    with pytest.raises(FileError, match="names no hand; give --hand"):
        reader().read(tmp_path / "grasps.yaml")
    with pytest.raises(FileError, match="names no object; give --object"):
        reader("robonaut2").read(tmp_path / "grasps.yaml")
    listed = reader("robonaut2", "mug").read(tmp_path / "grasps.yaml")
    assert len(listed) == 3
    np.testing.assert_allclose(listed[0].T_object_palm.position, plan[0].hand_pose.position, atol=1e-9)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"schema": "clench.plan/1"}', "grasps: expected a list"),
        ('{"schema": "clench.plan/1", "grasps": [1]}', r"grasps\[0\]: expected an object"),
        ('{"schema": "clench.plan/1", "grasps": []}', "holds no grasps"),
        ("[]", "holds no grasps"),
        ("no json", "JSON"),
        ('{"schema": "clench.solution/1"}', "file.json"),
    ],
)
def test_what_is_malformed_is_one_sentence_with_the_file(content: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "file.json").write_text(content)
    with pytest.raises(ClenchError, match=message) as caught:
        reader().read(tmp_path / "file.json")
    assert "file.json" in str(caught.value)


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        reader().read(tmp_path / "none.json")


def test_a_session_of_a_file_begins_with_its_first_grasp(solutions: list[dict[str, Any]], tmp_path: Path) -> None:
    (tmp_path / "all.json").write_text(json.dumps(solutions))
    session, listed = open_list(reader(), [tmp_path / "all.json"], None, 0.1, {})
    session.begin()
    assert session.wait()
    assert session.answer is not None
    assert session.answer.status == "grasp"
    assert list(session.answer.joint_angles) == list(solutions[0]["joint_angles"].values())
    assert len(listed) == 3
    session.close()


def test_a_same_command_a_solution_solves_to_it(plan: clench.GraspPlan) -> None:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    for grasp in plan:
        assert clench.solve(hand, mug, same_command(grasp.solution, hand)).joint_angles == grasp.joint_angles


def test_a_search_lists_grasps_and_rejected_proposals_at_their_places() -> None:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    session: LiveSession = open_session(Given(hand, mug, None, {}, None, 0.1, {"seed": 3}))
    seen: list[int] = []
    listed = plan_list(session, 4, seen.append)
    session.close()
    assert seen == [1, 2, 3, 4]
    grasps, fallen = [g for g in listed if not g.rejected], [g for g in listed if g.rejected]
    assert len(grasps) == 4
    assert {g.rejected for g in fallen} >= {"stopped before its place"}
    first = fallen[0]
    assert first.command().hand_pose == mug.pose @ first.T_object_palm
    assert first.posture is not None
    assert first.posture().shape == (len(hand.joints),)


def test_a_grasp_on_a_table_is_listed_with_it(tmp_path: Path) -> None:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug", pose=clench.Pose([0.3, 0.0, 0.1]))
    scene = with_scene(mug, None, (), ())
    pose = clench.approach_poses(hand, scene, 1, 0)[0]
    clench.solve(hand, scene, clench.GraspCommand(hand_pose=pose, preshape="open")).save(tmp_path / "s.json")
    bare = reader()
    with pytest.warns(UserWarning, match="the solution was computed with obstacle 'table': add --table HEIGHT"):
        bare.read(tmp_path / "s.json")
    assert [obj.obstacles for obj in bare.objects.values()] == [()]
    told = reader()
    told.around = lambda obj, pose: with_scene(obj, pose, (), ())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (listed,) = told.read(tmp_path / "s.json")
    (obj,) = told.objects.values()
    np.testing.assert_array_equal(obj.bodies[1].shapes[0].pose.position, scene.bodies[1].shapes[0].pose.position)
    assert listed.object in told.objects
