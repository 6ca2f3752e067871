"""Exported files, read by readers that are written from the documentation of the formats, without clench."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation
from six_directions import Settings, holds, read_grasp

import clench
from clench.apps.cli.main import main
from clench.core.exceptions import CommandError, UnknownNameError
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

Grip = tuple[Hand, GraspObject, GraspSolution]


def isaac_spec(path: Path) -> dict[str, Any]:
    """Read an isaac_grasp file as the Isaac documentation describes it: poses (4 x 4) of the gripper in the object."""
    document = yaml.safe_load(path.read_text())
    assert document["format"] == "isaac_grasp"
    assert float(document["format_version"]) == 1.0
    poses = {}
    for name, grasp in document["grasps"].items():
        assert 0.0 <= grasp["confidence"] <= 1.0
        T = np.eye(4)
        T[:3, 3] = grasp["position"]
        T[:3, :3] = Rotation.from_quat([*grasp["orientation"]["xyz"], grasp["orientation"]["w"]]).as_matrix()
        assert all(isinstance(angle, float) for angle in grasp["cspace_position"].values())
        assert set(grasp["pregrasp_cspace_position"]) == set(grasp["cspace_position"])
        poses[name] = T
    return document | {"poses": poses}


def moveit_grasps(path: Path) -> list[dict[str, Any]]:
    """Read messages moveit_msgs/Grasp from JSON; complain of fields that the message does not have."""
    fields = {
        *("id", "pre_grasp_posture", "grasp_posture", "grasp_pose", "grasp_quality", "pre_grasp_approach"),
        *("post_grasp_retreat", "post_place_retreat", "max_contact_force", "allowed_touch_objects"),
    }
    grasps = json.loads(path.read_text())["grasps"]
    for grasp in grasps:
        assert set(grasp) == fields
        for key in ("pre_grasp_posture", "grasp_posture"):
            assert len(grasp[key]["joint_names"]) == len(grasp[key]["points"][-1]["positions"])
        assert set(grasp["grasp_pose"]["pose"]["orientation"]) == set("xyzw")
    return grasps


def link_pose(hand: Hand, solution: GraspSolution, link: str) -> np.ndarray:
    """Return a link in the world by MuJoCo's kinematics, from the palm's pose."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(hand.spec_xml, dict(hand.assets))
    data = mujoco.MjData(model)
    for name, angle in solution.joint_angles.items():
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)

    def pose(body: str) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = data.body(body).xmat.reshape(3, 3), data.body(body).xpos
        return T

    T_world_palm = solution.hand_pose.matrix
    return T_world_palm @ np.linalg.inv(pose(hand.links[hand.palm].name)) @ pose(link)


@pytest.fixture(scope="module")
def grip() -> Grip:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    placed = clench.Pose([0.4, 0.1, -0.2], wxyz=[0.5, 0.5, -0.5, 0.5])
    for pose in clench.approach_poses(hand, ball, 20, 1):
        command = clench.GraspCommand(hand_pose=placed @ pose, object_pose=placed, preshape="open")
        solution = clench.solve(hand, ball, command)
        if solution.is_valid() and clench.plan_squeeze(solution, hand, ball, gravity=None).feasible:
            return hand, ball, solution
    raise AssertionError("no grip found")


@pytest.mark.parametrize("root", [None, "palm", "world"])
def test_the_gripper_frame_is_the_link_whose_pose_is_written(grip: Grip, tmp_path: Path, root: str | None) -> None:
    hand, ball, solution = grip
    clench.export_grasps(tmp_path / "g.yaml", solution, hand=hand, obj=ball, root=root, name="/World/ball")
    spec = isaac_spec(tmp_path / "g.yaml")
    frame = "world" if root == "world" else "palm"
    assert (spec["object_frame"], spec["gripper_frame"]) == ("/World/ball", frame)
    expected = np.linalg.inv(solution.object_pose.matrix) @ link_pose(hand, solution, frame)
    np.testing.assert_allclose(spec["poses"]["grasp_0"], expected, atol=1e-12)


@pytest.mark.parametrize("version", ["1.0", "'1.0'", "1", "'1'"])
def test_the_version_is_read_as_number_and_as_text(grip: Grip, tmp_path: Path, version: str) -> None:
    hand, ball, solution = grip
    file = tmp_path / "g.yaml"
    clench.export_grasps(file, solution, hand=hand, obj=ball)
    file.write_text(file.read_text().replace("format_version: 1.0", f"format_version: {version}"))
    assert len(clench.import_grasps(file)) == 1


@pytest.mark.parametrize("ending", ["yaml", "json", "npy"])
@pytest.mark.parametrize("root", [None, "palm", "world"])
def test_the_palm_comes_back_whatever_root_is_written(
    grip: Grip, tmp_path: Path, ending: str, root: str | None
) -> None:
    hand, ball, solution = grip
    file = tmp_path / f"g.{ending}"
    clench.export_grasps(file, solution, hand=hand, obj=ball, root=root)
    (read,) = clench.import_grasps(file)
    if ending == "json":  # the message has no place for the link's name
        read = replace(read, root=root)
    command = read.command(hand)
    T_object_palm = np.linalg.inv(read.object_pose.matrix) @ command.hand_pose.matrix
    if ending == "json":
        T_object_palm = np.linalg.inv(solution.object_pose.matrix) @ command.hand_pose.matrix
    expected = np.linalg.inv(solution.object_pose.matrix) @ solution.hand_pose.matrix
    np.testing.assert_allclose(T_object_palm, expected, atol=1e-12)


def test_confidence_says_what_is_known(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip

    def confidence(solution: GraspSolution, **given: Any) -> float:
        clench.export_grasps(tmp_path / "g.json", solution, hand=hand, obj=ball, **given)
        return moveit_grasps(tmp_path / "g.json")[0]["grasp_quality"]

    alone = replace(solution, contacts=tuple(c for c in solution.contacts if c.finger == "thumb"))
    assert confidence(solution) == 0.5
    assert confidence(alone) == 0.0
    assert confidence(replace(solution, status=clench.SolutionStatus.NO_CONTACT)) == 0.0
    assert confidence(solution, hold=clench.Hold(duration=0.2)) == 1.0
    assert confidence(solution, hold=clench.Hold(duration=0.2, squeeze=0.0)) == 0.0


def test_a_note_says_why_the_confidence_is_zero(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip
    alone = replace(solution, contacts=tuple(c for c in solution.contacts if c.finger == "thumb"))
    report = clench.export_grasps(tmp_path / "g.json", alone, hand=hand, obj=ball)
    assert report.confidences == (0.0,)
    plan = clench.plan_squeeze(alone, hand, ball, gravity=None)
    assert plan.text.startswith("No squeeze holds")
    assert plan.text in report.notes
    missed = replace(solution, status=clench.SolutionStatus.NO_CONTACT)
    notes = clench.export_grasps(tmp_path / "g.json", missed, hand=hand, obj=ball).notes
    assert any(note.startswith("The solution is not valid: ") for note in notes)


def test_the_command_prints_the_confidence_of_every_file(
    grip: Grip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    solution = grip[2]
    alone = replace(solution, contacts=tuple(c for c in solution.contacts if c.finger == "thumb"))
    Path("l.json").write_text(json.dumps([solution.to_dict(), alone.to_dict(), solution.to_dict()]))
    assert main(["export", "l.json", "--out", "g.yaml"]) == 0
    out = capsys.readouterr().out
    assert "  g.yaml: confidence 0.5 (2 grasps), 0 (1 grasp)\n" in out
    assert "note: No squeeze holds" in out
    assert main(["export", "l.json", "--out", "many"]) == 0
    out = capsys.readouterr().out
    for i, confidence in enumerate(["0.5", "0", "0.5"]):
        assert f"grasp_{i}.npy: confidence {confidence}\n" in out
    assert main(["export", "l.json", "--out", "many", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["confidences"] == [0.5, 0.0, 0.5]


def test_what_is_missing_is_planned_or_told(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip
    file = tmp_path / "g.npy"
    told = clench.export_grasps(file, solution)
    assert any("No pregrasp is planned" in note for note in told.notes)
    assert any("No squeeze is planned" in note for note in told.notes)
    assert any("named like the hand" in note for note in told.notes)
    complete = clench.export_grasps(file, solution, hand=hand, obj=ball)
    assert not any("planned" in note for note in complete.notes)
    grasp = read_grasp(file)
    assert np.abs(grasp["pregrasp_qpos"] - grasp["grasp_qpos"]).max() > 1e-3
    assert np.abs(grasp["squeeze_qpos"] - grasp["grasp_qpos"]).max() > 1e-3
    # Under gravity alone is not enough for a file that does not say where down is.
    down = replace(solution, squeeze=clench.plan_squeeze(solution, hand, ball, mass=0.05).to_dict())
    clench.export_grasps(file, down, hand=hand, obj=ball)
    anyhow = clench.plan_squeeze(solution, hand, ball, mass=0.05, gravity=None)
    offsets = dict(zip(grasp["joint_names"], (read_grasp(file)["squeeze_qpos"] - grasp["grasp_qpos"])[7:], strict=True))
    for name, offset in anyhow.offsets.items():
        assert offsets[name] == pytest.approx(offset, abs=1e-12)
    bare = replace(hand, joints=tuple(replace(j, stiffness=None) for j in hand.joints))
    (note,) = clench.export_grasps(tmp_path / "g.json", solution, hand=bare, obj=ball).notes
    pressing = [name for name, torque in anyhow.torques.items() if torque]
    first = ", ".join(f"'{name}'" for name in pressing[:3])
    assert len(pressing) > 4
    assert note.startswith(f"The model gives no servo gain of {first} and {len(pressing) - 3} more joints: ")
    assert note.endswith("Give the stiffness of the servos (--stiffness, stiffness=).")
    assert clench.export_grasps(tmp_path / "g.json", solution, hand=bare, obj=ball, stiffness=50.0).notes == ()


def test_one_call_writes_many_files(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip
    report = clench.export_grasps(tmp_path / "many", [solution] * 3, hand=hand, obj=ball)
    assert [file.name for file in report.files] == ["grasp_0.npy", "grasp_1.npy", "grasp_2.npy"]
    assert report.notes == ("The object 'sphere:r=0.03' was read from no file: obj_path is empty. (3 of 3 grasps)",)
    for file in report.files:
        read_grasp(file)


def test_batches_and_lists_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    batch = clench.solve_batch(
        hand, ball, clench.approach_poses(hand, ball, 6, 1), clench.GraspCommand(clench.Pose(), preshape="open")
    )
    batch.save(tmp_path / "b.npz")
    count = batch.counts()["grasp"]
    report = clench.export_grasps(tmp_path / "all.yaml", batch)
    assert len(isaac_spec(tmp_path / "all.yaml")["poses"]) == len(report.confidences) == count > 1
    assert main(["export", str(tmp_path / "b.npz"), "--out", str(tmp_path / "b.yaml"), "--name", "toy"]) == 0
    assert isaac_spec(tmp_path / "b.yaml")["object_frame"] == "toy"
    listed = [batch.solution(int(i)).to_dict() for i in np.flatnonzero(batch.status == "grasp")]
    (tmp_path / "l.json").write_text(json.dumps(listed))
    assert main(["export", str(tmp_path / "l.json"), "--out", str(tmp_path / "g.json")]) == 0
    assert len(moveit_grasps(tmp_path / "g.json")) == count
    capsys.readouterr()
    assert main(["export", str(tmp_path / "l.json"), "--out", str(tmp_path / "g.npy")]) == 2
    assert "Give a folder" in capsys.readouterr().err
    assert main(["export", str(tmp_path / "l.json"), "--out", str(tmp_path / "g.json"), "--mass", "1", "2", "3"]) == 2


def test_grasps_of_several_objects(
    grip: Grip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    hand, ball, solution = grip
    larger = clench.GraspObject.load("sphere:r=0.031")
    command = clench.GraspCommand(hand_pose=solution.hand_pose, object_pose=solution.object_pose, preshape="open")
    other = clench.solve(hand, larger, command)
    solution.save("a.json")
    other.save("b.json")
    assert main(["export", "a.json", "b.json", "--out", "g.json", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["confidences"]) == 2
    assert not told["notes"]
    touched = [grasp["allowed_touch_objects"] for grasp in moveit_grasps(Path("g.json"))]
    assert touched == [["sphere:r=0.03"], ["sphere:r=0.031"]]
    report = clench.export_grasps("g.json", [solution, other], hand=hand, obj=[ball, larger])
    assert list(report.confidences) == told["confidences"]
    assert main(["export", "a.json", "b.json", "--out", "many"]) == 0
    assert sorted(file.name for file in Path("many").iterdir()) == ["grasp_0.npy", "grasp_1.npy"]
    capsys.readouterr()
    assert main(["export", "a.json", "b.json", "--out", "g.yaml"]) == 2
    assert capsys.readouterr().err == (
        "clench: error: isaac_grasp: one file holds grasps of one hand and one object; 'a.json' (robonaut2 on "
        "sphere:r=0.03) and 'b.json' (robonaut2 on sphere:r=0.031) are of different ones. Export them separately.\n"
    )
    assert main(["export", "a.json", "b.json", "--out", "g.json", "--object", "sphere:r=0.03"]) == 2
    assert capsys.readouterr().err.startswith("clench: error: b.json: geometry_hash: ")
    with pytest.raises(CommandError, match=r"solution 0 is of robonaut2 on sphere:r=0.03, solution 1 is of .* separ"):
        clench.export_grasps("g.yaml", [solution, other], hand=hand, obj=[ball, larger])
    with pytest.raises(CommandError, match="obj: expected one object for each of 2 solutions, got 1"):
        clench.export_grasps("g.json", [solution, other], hand=hand, obj=[ball])
    replace(solution, hand="x", hand_model="x").save("c.json")
    assert main(["export", "a.json", "c.json", "--out", "g.json"]) == 2
    assert capsys.readouterr().err == (
        "clench: error: c.json: the solution is for hand 'x', not for 'robonaut2'. 'a.json' and 'c.json' are of "
        "different hands: export them separately.\n"
    )
    assert not Path("g.yaml").exists()


def test_bad_requests(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip
    with pytest.raises(UnknownNameError, match="Link 'hub' is not in hand 'robonaut2'"):
        clench.export_grasps(tmp_path / "g.yaml", solution, hand=hand, obj=ball, root="hub")
    with pytest.raises(CommandError, match="root: the pose of 'palm' cannot be told without the hand"):
        clench.export_grasps(tmp_path / "g.yaml", solution, root="palm")
    with pytest.raises(CommandError, match="name: dexgraspbench names an object by its folder"):
        clench.export_grasps(tmp_path / "g.npy", solution, hand=hand, obj=ball, name="x")
    with pytest.raises(CommandError, match="geometry_hash: the solution was computed for another geometry of object"):
        clench.export_grasps(tmp_path / "g.yaml", solution, hand=hand, obj=GraspObject.load("sphere:r=0.031"))
    with pytest.raises(CommandError, match="hold: a hold test needs the hand and the object"):
        clench.export_grasps(tmp_path / "g.yaml", solution, hold=clench.Hold())
    assert not list(tmp_path.iterdir())


def test_the_object_is_named_by_its_folder_and_scale(tmp_path: Path) -> None:
    import trimesh

    folder = tmp_path / "cup"
    (folder / "mesh").mkdir(parents=True)
    (folder / "info").mkdir()
    (folder / "info" / "simplified.json").write_text("{}")
    trimesh.creation.icosphere(radius=1.0).export(folder / "mesh" / "simplified.obj")
    hand = clench.Hand.load("robonaut2")
    ball = clench.GraspObject.load(folder / "mesh" / "simplified.obj", scale=0.03)
    solution = clench.solve(
        hand, ball, clench.GraspCommand(clench.approach_poses(hand, ball, 1, 1)[0], preshape="open")
    )
    solution.save(tmp_path / "s.json")
    for source in (solution, clench.GraspSolution.load(tmp_path / "s.json")):
        clench.export_grasps(tmp_path / "g.npy", source, hand=hand, obj=ball)
        grasp = read_grasp(tmp_path / "g.npy")
        assert (grasp["obj_path"], grasp["obj_scale"]) == (str(folder), 0.03)
    assert main(["export", str(tmp_path / "s.json"), "--out", str(tmp_path / "h.npy")]) == 0
    np.testing.assert_array_equal(read_grasp(tmp_path / "h.npy")["grasp_qpos"], grasp["grasp_qpos"])


@pytest.mark.shared
@pytest.mark.parametrize("stiffness", [None, 5.0])
def test_exported_grasps_hold_in_six_directions(shared_data: Path, tmp_path: Path, stiffness: float | None) -> None:
    """The Shadow hand's own file is told what clench wrote: root, joint order and offsets are right, or it drops."""
    import mujoco

    file = shared_data / "hands" / "shadow_hand_mjcf" / "right_hand.xml"
    hand, box = clench.Hand.load(file), clench.GraspObject.load("box:x=0.05,y=0.06,z=0.1")
    geoms = [{"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [0.025, 0.03, 0.05]}]
    best = clench.plan_grasps(hand, box, 3, most=120, path=False)
    clench.export_grasps(tmp_path, [planned.solution for planned in best], hand=hand, obj=box, stiffness=stiffness)
    test = Settings(kp=stiffness)
    grasps = [read_grasp(tmp_path / f"grasp_{i}.npy") for i in range(3)]
    assert all(holds(grasp, file, geoms, test) for grasp in grasps)
    for grasp, planned in zip(grasps, best, strict=True):
        moved = dict(zip(grasp["joint_names"], (grasp["squeeze_qpos"] - grasp["grasp_qpos"])[7:], strict=True))
        torques = clench.plan_squeeze(planned.solution, hand, box, gravity=None).torques
        assert all(moved[name] != 0.0 for name, torque in torques.items() if abs(torque) > 1e-9)
        assert {"rh_FFJ1", "rh_FFJ2"} <= set(moved)
    palm = planned.solution.hand_pose
    wrong = {key: np.array([*palm.position, *palm.wxyz, *grasp[key][7:]]) for key in grasp if key.endswith("_qpos")}
    assert not holds(grasp | wrong, file, geoms, test)
    assert not holds(grasp | {"squeeze_qpos": grasp["grasp_qpos"]}, file, geoms, test)
    wrist = clench.export_grasps(tmp_path / "w.npy", planned.solution, hand=hand, obj=box, root="rh_wrist")
    assert not wrist.notes or "obj_path" in wrist.notes[0]
    assert len(read_grasp(tmp_path / "w.npy")["grasp_qpos"]) == 7 + 23


@pytest.mark.parametrize(
    ("change", "key"),
    [({"torques": 3}, "torques"), ({"torques": {"a": "x"}}, "torques.a"), ({"mass_range": 1}, "mass_range")],
)
def test_a_squeeze_that_somebody_edited_is_refused(grip: Grip, change: dict[str, Any], key: str) -> None:
    document = grip[2].to_dict() | {"squeeze": {"feasible": True, **change}}
    with pytest.raises(clench.FileError, match=rf"squeeze.*{key}"):
        GraspSolution.from_dict(document)
