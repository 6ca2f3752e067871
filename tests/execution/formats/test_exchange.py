"""Other programs' files: read back the same, read by others, and harmless when they come from others."""

from __future__ import annotations

import json
import os
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import clench
from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.core.pose import Pose
from clench.execution.formats.exchange import GraspFormat, export_grasps, import_grasps
from clench.execution.formats.grasp_posture import GraspPosture
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution
from handmade import make_solution

ENDINGS = {GraspFormat.ISAAC_GRASP: "yaml", GraspFormat.DEXGRASPBENCH: "npy", GraspFormat.MOVEIT_GRASP: "json"}
OBJECT = Pose([0.4, 0.1, -0.2], wxyz=np.array([0.5, 0.5, -0.1, 0.7]))


@pytest.fixture
def placed() -> GraspSolution:
    return make_solution(object_pose=OBJECT)


@pytest.mark.parametrize("format", list(GraspFormat))
def test_there_and_back(placed: GraspSolution, tmp_path: Path, format: GraspFormat) -> None:
    file = tmp_path / f"g.{ENDINGS[format]}"
    export_grasps(file, placed)
    (read,) = import_grasps(file)
    assert read.joint_angles == placed.joint_angles
    assert read.name == "grasp_0"
    if format is GraspFormat.ISAAC_GRASP:
        assert read.object_pose == Pose.identity()
        np.testing.assert_allclose(OBJECT.matrix @ read.hand_pose.matrix, placed.hand_pose.matrix, atol=1e-15)
    else:
        assert read.hand_pose == placed.hand_pose
    if format is GraspFormat.DEXGRASPBENCH:
        assert read.object_pose == OBJECT


def test_isaac_grasp_as_yaml_says_it(placed: GraspSolution, tmp_path: Path) -> None:
    export_grasps(tmp_path / "g.yaml", [placed, placed])
    document = yaml.safe_load((tmp_path / "g.yaml").read_text())
    assert {k: v for k, v in document.items() if k != "grasps"} == {
        "format": "isaac_grasp",
        "format_version": 1.0,
        "object_frame": "ball",
        "gripper_frame": "pincer",
    }
    grasp = document["grasps"]["grasp_1"]
    assert list(grasp) == [
        *("confidence", "position", "orientation", "cspace_position", "pregrasp_cspace_position"),
    ]
    assert grasp["pregrasp_cspace_position"] == placed.open_angles
    assert grasp["confidence"] == 0.0  # no squeeze is known
    assert np.linalg.norm([grasp["orientation"]["w"], *grasp["orientation"]["xyz"]]) == pytest.approx(1.0)
    assert len(import_grasps(tmp_path / "g.yaml")) == 2


def test_dexgraspbench_as_numpy_says_it(placed: GraspSolution, tmp_path: Path) -> None:
    file = tmp_path / "g.npy"
    export_grasps(file, replace(placed, pregrasp={**placed.joint_angles, "index_curl": 0.1}))
    data: dict[str, Any] = np.load(file, allow_pickle=True).item()
    assert {"obj_pose", "obj_scale", "obj_path", "pregrasp_qpos", "grasp_qpos", "squeeze_qpos"} <= set(data)
    np.testing.assert_array_equal(data["obj_pose"], [*OBJECT.position, *OBJECT.wxyz])
    np.testing.assert_array_equal(data["grasp_qpos"][:7], [*placed.hand_pose.position, *placed.hand_pose.wxyz])
    np.testing.assert_array_equal(data["grasp_qpos"][7:], list(placed.joint_angles.values()))
    assert data["pregrasp_qpos"][8] == 0.1
    np.testing.assert_array_equal(data["squeeze_qpos"], data["grasp_qpos"])
    export_grasps(file, replace(placed, squeeze={"offsets": {"index_tip": 0.05}}))
    data = np.load(file, allow_pickle=True).item()
    np.testing.assert_array_equal(data["squeeze_qpos"] - data["grasp_qpos"], [0.0] * 9 + [0.25 - 0.2])


def test_moveit_grasp_has_the_fields_of_the_message(placed: GraspSolution, tmp_path: Path) -> None:
    export_grasps(tmp_path / "g.json", placed)
    (grasp,) = json.loads((tmp_path / "g.json").read_text())["grasps"]
    assert list(grasp) == [
        *("id", "pre_grasp_posture", "grasp_posture", "grasp_pose", "grasp_quality", "pre_grasp_approach"),
        *("post_grasp_retreat", "post_place_retreat", "max_contact_force", "allowed_touch_objects"),
    ]
    message = pytest.importorskip("trajectory_msgs.msg", reason="needs ROS messages")
    fields = message.JointTrajectory.get_fields_and_field_types()
    assert set(grasp["grasp_posture"]) == set(fields)
    point = message.JointTrajectoryPoint.get_fields_and_field_types()
    assert set(grasp["grasp_posture"]["points"][0]) == set(point)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7), st.lists(st.floats(-3, 3), min_size=2, max_size=2))
def test_any_numbers_come_back_to_the_bit(tmp_path_factory: Any, numbers: list[float], angles: list[float]) -> None:
    folder = tmp_path_factory.mktemp("g")
    wxyz = np.array(numbers[3:]) + 2.0
    pose = Pose(numbers[:3], wxyz=wxyz / np.linalg.norm(wxyz))
    solution = make_solution(
        hand_pose=pose,
        joint_angles=dict(zip(("a", "b"), angles, strict=True)),
        open_angles={
            "a": 0.0,
            "b": 0.0,
        },
    )
    for format, ending in ENDINGS.items():
        export_grasps(folder / f"g.{ending}", solution, format)
        (read,) = import_grasps(folder / f"g.{ending}", format)
        assert read.joint_angles == solution.joint_angles
        np.testing.assert_allclose(read.hand_pose.matrix, pose.matrix, atol=1e-15)


class Evil:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch clench_was_here",)


class EvilEval:
    def __reduce__(self) -> tuple[Any, ...]:
        return eval, ("open('clench_was_here', 'w')",)


@pytest.mark.parametrize("evil", [Evil(), EvilEval(), {"grasp_qpos": Evil()}, [np.zeros(3), EvilEval()]])
def test_a_pickle_that_wants_more_than_arrays_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, evil: object
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("g.npy").write_bytes(header() + pickle.dumps(evil))
    with pytest.raises(
        FileError, match=r"g\.npy: is refused: the pickle asks for '(posix|nt|builtins)\.\w+', which no"
    ):
        import_grasps("g.npy")
    assert not Path("clench_was_here").exists()


def header() -> bytes:
    import io

    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "|O", "fortran_order": False, "shape": ()})
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not an npy file"),
        (b"hello world, this is no numpy", "not an npy file"),
        (header(), "the pickle is damaged"),
        (header() + b"\x80\x04nonsense", "(the pickle is damaged|is refused)"),
        (header() + pickle.dumps([1, 2]), "expected a dictionary, got list"),
        (header() + pickle.dumps({}), "grasp_qpos: missing"),
        (header() + pickle.dumps({"grasp_qpos": [0.0] * 5}), "grasp_qpos: expected 7 numbers"),
        (header() + pickle.dumps({"grasp_qpos": ["x"] * 8}), "grasp_qpos: expected numbers"),
        (header() + pickle.dumps({"grasp_qpos": [np.nan] * 8}), "grasp_qpos: expected finite numbers"),
        (header() + pickle.dumps({"grasp_qpos": [0.0] * 9}), r"grasp_qpos\[0\].wxyz: expected a unit quaternion"),
        (header() + pickle.dumps({"grasp_qpos": [0.0] * 3 + [1.0] + [0.0] * 4, "joint_names": ["a", "b"]}), "1 names"),
        (
            header() + pickle.dumps({"grasp_qpos": [0.0] * 3 + [1.0] + [0.0] * 4, "obj_pose": [0.0]}),
            "obj_pose: expected",
        ),
    ],
)
def test_malformed_npy(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "g.npy").write_bytes(content)
    with pytest.raises(FileError, match=r"g\.npy: .*" + message):
        import_grasps(tmp_path / "g.npy")


def test_an_array_of_numbers_is_no_grasp(tmp_path: Path) -> None:
    np.save(tmp_path / "g.npy", np.zeros(3))
    with pytest.raises(FileError, match="expected one pickled dictionary, got an array of shape"):
        import_grasps(tmp_path / "g.npy")


def test_a_stack_of_grasps_without_names(tmp_path: Path, pincer: Hand) -> None:
    rows = np.zeros((3, 10))
    rows[:, 3] = 1.0
    rows[:, 7:] = [[0.1, 0.2, 0.2], [0.3, 0.1, 0.1], [0.5, 0.5, 0.5]]
    document = {"grasp_qpos": rows.astype(np.float32), "obj_pose": np.array([0, 0, 1.0, 1, 0, 0, 0])}
    np.save(tmp_path / "g.npy", np.array(document, dtype=object), allow_pickle=True)
    read = import_grasps(tmp_path / "g.npy")
    assert [g.name for g in read] == ["grasp_0", "grasp_1", "grasp_2"]
    assert read[2].object_pose == Pose([0, 0, 1])
    np.testing.assert_allclose(read[1].joint_angles, [0.3, 0.1, 0.1], rtol=1e-6)
    assert read[0].command(pincer).object_pose == Pose([0, 0, 1])
    with pytest.raises(CommandError, match="grasp_0: expected 3 joint angles in the order of hand 'pincer', got 2"):
        replace(read[0], joint_angles=[0.0, 0.0]).command(pincer)


GOOD = {"position": [0, 0, 1], "orientation": {"w": 1.0, "xyz": [0, 0, 0]}}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("a: [", "not YAML"),
        ("- 1", "format: expected 'isaac_grasp'"),
        ({"format": "x"}, "format: expected 'isaac_grasp'"),
        ({"format_version": 2.0}, "format_version: expected 1.0, got 2.0"),
        ({"grasps": []}, "grasps: expected at least one"),
        ({"grasps": {"a": 1}}, "grasps.a: expected a mapping, got 1"),
        ({"grasps": {"a": {**GOOD, "orientation": {"w": 1}}}}, "grasps.a.orientation: expected 'w' and 'xyz'"),
        ({"grasps": {"a": {**GOOD, "orientation": {"w": 1, "xyz": 3}}}}, "grasps.a.wxyz: expected 4 numbers"),
        ({"grasps": {"a": {**GOOD, "orientation": {"w": 2, "xyz": [0, 0, 0]}}}}, "grasps.a.wxyz: expected a unit"),
        ({"grasps": {"a": {**GOOD, "position": [1, 2]}}}, "grasps.a.position: expected 3 numbers"),
        ({"grasps": {"a": {**GOOD, "confidence": "x"}}}, "grasps.a.confidence: expected a number"),
        ({"grasps": {"a": {**GOOD, "cspace_position": [1]}}}, "grasps.a.cspace_position: expected angles by joint"),
        ({"grasps": {"a": {**GOOD, "cspace_position": {"j": "x"}}}}, r"grasps.a.cspace_position.j: expected a finite"),
    ],
)
def test_malformed_isaac_grasp(tmp_path: Path, change: Any, message: str) -> None:
    document = {"format": "isaac_grasp", "format_version": 1.0, "grasps": {"a": GOOD}}
    text = change if isinstance(change, str) else yaml.safe_dump({**document, **change})
    (tmp_path / "g.yaml").write_text(text)
    with pytest.raises(FileError, match=r"g\.yaml: " + message):
        import_grasps(tmp_path / "g.yaml")


def test_yaml_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("g.yaml").write_text("!!python/object/apply:os.system ['touch clench_was_here']")
    with pytest.raises(FileError, match="not YAML"):
        import_grasps("g.yaml")
    assert not Path("clench_was_here").exists()


def test_missing_angles_are_accepted(tmp_path: Path, pincer: Hand) -> None:
    document = {"format": "isaac_grasp", "format_version": 1.0, "grasps": {"a": GOOD}}
    (tmp_path / "g.yaml").write_text(yaml.safe_dump(document))
    (grasp,) = import_grasps(tmp_path / "g.yaml")
    assert grasp.confidence is None
    assert grasp.command(pincer) == clench.GraspCommand(Pose([0, 0, 1]), object_pose=Pose.identity())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("{", "not JSON"),
        ({"grasp_pose": 3}, r"grasp_pose: expected object, got int\."),
        ({"grasp_posture": {"joint_names": ["a"], "points": []}}, "grasp_posture: 1 joints, but 0 positions"),
        ({"grasp_pose": None}, "grasp_pose"),
    ],
)
def test_malformed_moveit_grasp(placed: GraspSolution, tmp_path: Path, change: Any, message: str) -> None:
    export_grasps(tmp_path / "g.json", placed)
    (grasp,) = json.loads((tmp_path / "g.json").read_text())["grasps"]
    (tmp_path / "g.json").write_text(change if isinstance(change, str) else json.dumps({**grasp, **change}))
    with pytest.raises(FileError, match=r"g\.json: .*" + message):
        import_grasps(tmp_path / "g.json")


def test_a_posture_of_the_built_in_hand_is_closed_anew() -> None:
    hand = clench.Hand.load("robonaut2")
    q = hand.open_angles()
    q[hand.joint_index("index_yaw")] = 0.1
    q[hand.joint_index("index_proximal")] = 0.7
    command = GraspPosture("g", Pose([0, 0, 0.1]), Pose([0, 0, 0.2]), q.tolist()).command(hand)
    assert command.preshape["index_yaw"] == 0.1
    assert "index_proximal" not in command.preshape
    assert command.object_pose == Pose([0, 0, 0.2])


def test_a_pregrasp_that_lacks_a_joint_of_the_grasp_is_refused(placed: GraspSolution, tmp_path: Path) -> None:
    lacking = replace(placed, pregrasp={"index_curl": 0.1})
    for ending in ("yaml", "npy", "json"):
        with pytest.raises(CommandError, match=r"pregrasp\.index_yaw: missing; every joint of joint_angles is needed"):
            export_grasps(tmp_path / f"g.{ending}", lacking)
    assert not list(tmp_path.iterdir())


def test_names_of_formats(placed: GraspSolution, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"g\.txt: the ending names no format; expected \.yaml") as caught:
        export_grasps(tmp_path / "g.txt", placed)
    listed = ".yml, .npy, .json, or a format by name: isaac_grasp, dexgraspbench, moveit_grasp."
    scenes = " A scene ends with .glb, .usd, .usda, .usdc; a dataset with .h5, .hdf5."
    assert str(caught.value).endswith(listed + scenes)
    # Scenes and datasets are written, and not read.
    with pytest.raises(FileError, match=r"moveit_grasp\.$"):
        import_grasps(tmp_path / "g.txt")
    with pytest.raises(UnknownNameError, match=r"Format 'isac' is not in clench\. Formats: isaac_grasp, dexg"):
        import_grasps(tmp_path / "g.txt", "isac")
    export_grasps(tmp_path / "g.txt", placed, "moveit_grasp")
    assert import_grasps(tmp_path / "g.txt", GraspFormat.MOVEIT_GRASP)[0].name == "grasp_0"
    with pytest.raises(CommandError, match=r"one file holds one grasp; 2 solutions were given .* Give a folder"):
        export_grasps(tmp_path / "g.npy", [placed, placed])
    with pytest.raises(CommandError, match="expected solutions of one hand and one object"):
        export_grasps(tmp_path / "g.yaml", [placed, replace(placed, hand="other")])
    for ending in ("yaml", "npy", "json"):
        with pytest.raises(FileError, match="no such file"):
            import_grasps(tmp_path / f"absent.{ending}")
