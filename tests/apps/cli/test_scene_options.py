"""--table and --obstacle: what stands around the object, placed in the world."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.cli.inputs.scene_options import with_scene
from clench.apps.cli.main import main
from clench.core.exceptions import ClenchError
from clench.execution.executing import check_geometry
from clench.models.objects.grasp_object import BodyRole

TURNED = clench.Pose([0.1, -0.2, 0.5], rpy=[0.4, -0.3, 1.0])
SOLVE = ["solve", "--hand", "robonaut2", "--object", "mug"]


def corners(obj: clench.GraspObject, number: int, pose: clench.Pose) -> np.ndarray:
    """Return the corners of a body in the world, shape (V, 3) [m]."""
    return np.concatenate([pose.apply(shape.to_mesh().vertices) for shape in obj.bodies[number].shapes])


@pytest.mark.parametrize("pose", [clench.Pose(), TURNED], ids=["upright", "turned"])
def test_a_table_is_level_in_the_world_under_the_lowest_point(pose: clench.Pose) -> None:
    mug = clench.GraspObject.load("mug")
    scene = with_scene(mug, pose, (), ())
    top = corners(scene, 1, pose)
    assert scene.bodies[1].role is BodyRole.OBSTACLE
    lowest = corners(scene, 0, pose)[:, 2].min()
    assert top[:, 2].max() == pytest.approx(lowest, abs=1e-5)
    # The upper face is level: four corners at one height, around the object.
    face = top[top[:, 2] > top[:, 2].mean()]
    assert np.ptp(face[:, 2]) < 1e-12
    np.testing.assert_allclose(face.mean(axis=0)[:2], pose.position[:2], atol=1e-12)
    at_height = with_scene(mug, pose, (-0.25,), ())
    assert corners(at_height, 1, pose)[:, 2].max() == pytest.approx(-0.25, abs=1e-12)


def test_obstacles_stand_in_the_world_and_keep_their_size() -> None:
    mug = clench.GraspObject.load("mug")
    texts = ("box:x=0.1,y=0.2,z=0.3@1,2,3,0.5,0.5,0.5,0.5", "ball@-0.2,0,0")
    scene = with_scene(mug, TURNED, None, texts)
    assert [(body.name, body.role.value) for body in scene.bodies[1:]] == [
        ("obstacle1", "obstacle"),
        ("obstacle2", "obstacle"),
    ]
    box = corners(scene, 1, TURNED)
    np.testing.assert_allclose(box.mean(axis=0), [1, 2, 3], atol=1e-12)
    # The quaternion turns x to y, y to z and z to x.
    np.testing.assert_allclose(np.ptp(box, axis=0), [0.3, 0.1, 0.2], atol=1e-12)
    np.testing.assert_allclose(corners(scene, 2, TURNED).mean(axis=0), [-0.2, 0, 0], atol=1e-9)
    assert with_scene(mug, TURNED, None, ()) is mug


@pytest.mark.parametrize(
    ("table", "obstacles", "message"),
    [
        ((0.1, 0.2), (), r"^--table: expected the height .* got 2 numbers\.$"),
        ((float("nan"),), (), r"table: expected a finite height"),
        (None, ("ball",), r"^--obstacle: expected MESH_OR_SHAPE@x,y,z or .*, got 'ball'\.$"),
        (None, ("@1,2,3",), r"^--obstacle: expected MESH_OR_SHAPE@x,y,z or .*, got '@1,2,3'\.$"),
        (None, ("ball@1,2",), r"got '1,2' after the @\.$"),
        (None, ("ball@1,2,3,1,0,0",), r"got '1,2,3,1,0,0' after the @\.$"),
        (None, ("ball@1,2,c",), r"got '1,2,c' after the @\.$"),
        (None, ("ball@1,2,nan",), r"^--obstacle ball@1,2,nan: pose\.position: expected finite numbers"),
        (None, ("ball@0,0,0,0,0,0,0",), r"^--obstacle ball@0,0,0,0,0,0,0: pose\.wxyz: expected a unit quaternion"),
        (None, ("bal@1,2,3",), r"^--obstacle bal@1,2,3: Object 'bal' is not .*Did you mean 'ball'"),
        (None, ("absent.stl@1,2,3",), r"^--obstacle absent\.stl@1,2,3: absent\.stl: no such file"),
    ],
)
def test_malformed_scenes_are_refused(table, obstacles, message: str) -> None:
    with pytest.raises(ClenchError, match=message):
        with_scene(clench.GraspObject.load("mug"), None, table, obstacles)


def test_solve_and_execute_see_the_same_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pose = TURNED @ clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    command = {"hand_pose": pose.to_dict(), "object_pose": TURNED.to_dict()}
    (tmp_path / "c.json").write_text(json.dumps(command))
    around = ["--table", "--obstacle", "ball@0.5,0.5,0.5", "--obstacle", "box:x=0.1,y=0.1,z=0.1@1,1,1"]
    assert main([*SOLVE, "--command", str(tmp_path / "c.json"), *around, "--json"]) in (0, 1)
    file = tmp_path / "solution.json"
    file.write_text(capsys.readouterr().out)
    solution = clench.GraspSolution.load(file)
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    scene = with_scene(mug, solution.object_pose, (), (around[2], around[4]))
    assert len(scene.bodies) == 4
    check_geometry(solution, hand, scene)
    with pytest.raises(clench.CommandError, match="with the same scale and obstacles"):
        check_geometry(solution, hand, mug)
    assert main(["execute", str(file), *around, "--json"]) in (0, 1)
    assert json.loads(capsys.readouterr().out)["schema"] == "clench.execution/1"
    assert main(["execute", str(file), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)["error"]
    assert "the same scale and obstacles (it was computed with obstacles 'table', 'obstacle1', 'obstacle2': " in told
    assert "add --table HEIGHT and --obstacle SHAPE@x,y,z)" in told
    assert main(["execute", str(file), "--table", "--json"]) == 2
    told = json.loads(capsys.readouterr().out)["error"]
    assert "(it was computed with obstacles 'obstacle1', 'obstacle2': add --obstacle SHAPE@x,y,z)" in told
    elsewhere = ["--table", "0.3", *around[1:]]
    assert main(["execute", str(file), *elsewhere, "--json"]) == 2
    assert "(--scale, --table, --obstacle)" in json.loads(capsys.readouterr().out)["error"]


@pytest.fixture(scope="module")
def on_a_table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a grasp of a turned mug on a table."""
    folder = tmp_path_factory.mktemp("table")
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug", pose=clench.Pose([0.3, 0.0, 0.1]))
    scene = with_scene(mug, None, (), ())
    poses = clench.approach_poses(hand, scene, 20, 0)
    solved = (clench.solve(hand, scene, clench.GraspCommand(hand_pose=pose, preshape="open")) for pose in poses)
    next(solution for solution in solved if solution.is_valid()).save(folder / "solution.json")
    return folder / "solution.json"


def test_a_solution_on_a_table_is_exported_with_it(on_a_table: Path, tmp_path: Path, capsys) -> None:
    solution = clench.GraspSolution.load(on_a_table)
    assert solution.obstacles == ("table",)
    out = ["--out", str(tmp_path / "grasp.yaml"), "--json"]
    assert main(["export", str(on_a_table), *out]) == 0
    (told,) = [n for n in json.loads(capsys.readouterr().out)["notes"] if "without the object" in n]
    assert "it was computed with obstacle 'table': add --table HEIGHT" in told
    assert main(["export", str(on_a_table), "--table", *out]) == 0
    assert not [n for n in json.loads(capsys.readouterr().out)["notes"] if "without the object" in n]
    assert main(["export", str(on_a_table), "--table", "0.7", *out]) == 2
    assert "another geometry of object" in json.loads(capsys.readouterr().out)["error"]
    assert main(["export", str(on_a_table), "--table", "--out", str(tmp_path / "scene.glb"), "--json"]) == 0
    assert not json.loads(capsys.readouterr().out)["notes"]


def test_a_batch_on_a_table_is_exported_with_it(tmp_path: Path, capsys) -> None:
    scene = ["--table", "--obstacle", "ball@0.5,0.5,0.5"]
    asked = ["batch", "--hand", "robonaut2", "--object", "mug", "--count", "12", "--json"]
    assert main([*asked, *scene, "--out", str(tmp_path / "b.npz")]) == 0
    capsys.readouterr()
    assert main(["export", str(tmp_path / "b.npz"), *scene, "--out", str(tmp_path / "g.yaml"), "--json"]) == 0
    assert not [n for n in json.loads(capsys.readouterr().out)["notes"] if "without the object" in n]


def test_approach_poses_of_the_command_line_keep_off_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    batch = ["batch", "--hand", "robonaut2", "--object", "mug", "--count", "30", "--json"]
    counts = []
    for around in ([], ["--table"], ["--table", "0.5"]):
        main([*batch, *around])
        counts.append(json.loads(capsys.readouterr().out)["status"]["grasp"])
    assert counts[1] >= 0.7 * counts[0] > 0
    # A table half a metre up goes through nothing, but the mug is below it: other poses, other answers.
    assert counts[2] != counts[0]
    assert main([*SOLVE, "--table", "--json"]) == 0
    solution = clench.GraspSolution.from_dict(json.loads(capsys.readouterr().out))
    palm = solution.hand_pose.apply(clench.Hand.load("robonaut2").palm_center)
    assert palm[2] > 0.0
