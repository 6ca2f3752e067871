"""Command files: what is read, what is refused and with which words, and the check against a hand."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.core.pose import Pose
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.command_file import KEYS, check_command, command_from_dict, command_to_dict, load_command
from clench.models.shapes import CollisionSource
from models.small_hand import small_hand

POSE = {"position": [0.0, 0.1, 0.2], "wxyz": [1, 0, 0, 0]}


def refused(data):
    with pytest.raises(CommandError) as caught:
        command_from_dict(data, "c.json")
    return str(caught.value)


def test_a_full_file_is_read_and_written_back(tmp_path):
    document = {
        "hand_pose": {"position": [0.0, 0.1, 0.2], "wxyz": [0.0, 1.0, 0.0, 0.0]},
        "root_link": "forearm",
        "object_pose": POSE,
        "preshape": {"index_yaw": 0.1, "wrist": -1},
        "fingers": ["index"],
        "order": "proximal-first",
        "orders": ["together", "proximal-first"],
        "rounds": 2,
        "speeds": {"index_0": 2.0},
        "planes": 3,
        "full_width": False,
        "yaw_grid": [0.0, -0.1],
        "open_variants": [0.0, 0.2],
        "check_candidates": True,
        "measure": False,
        "collision_source": "raw",
        "opposition_grid": [0.0, 0.2],
        "criteria": {"range_of_motion": 1, "limit_distance": 0.5},
        "next_steps": [{"index_yaw": 0.1}, {}],
        "task_wrenches": [{"force": [0, 0, -5], "torque": [0, 0.1, 0]}, {"force": [1, 0, 0]}],
        "seed": 7,
    }
    assert set(document) == set(KEYS)
    path = tmp_path / "c.json"
    path.write_text(json.dumps(document))
    command = load_command(path)
    assert command.hand_pose == Pose([0, 0.1, 0.2], [0, 1, 0, 0])
    assert command.preshape == {"index_yaw": 0.1, "wrist": -1.0}
    assert command.fingers == ("index",)
    assert (command.order, command.rounds, command.planes) == (ClosingOrder.PROXIMAL_FIRST, 2, 3)
    assert command.collision_source is CollisionSource.RAW
    assert command.full_width is False
    assert command_from_dict(json.loads(json.dumps(command_to_dict(command)))) == command


def test_only_the_hand_pose_is_needed_and_null_is_not_given():
    command = command_from_dict({"hand_pose": POSE, "root_link": None, "criteria": None, "fingers": None})
    assert command == GraspCommand(Pose([0, 0.1, 0.2]))
    assert command_to_dict(command) == {"hand_pose": command.hand_pose.to_dict()}


def test_a_calibration_file_is_looked_for_beside_the_command(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"hand_pose": POSE, "criteria": "weights.toml"}))
    assert load_command(path).criteria == tmp_path / "weights.toml"


def test_a_name_without_an_ending_is_a_preset(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"hand_pose": POSE, "criteria": "steady"}))
    command = load_command(path)
    assert command.criteria == "steady"
    assert command_to_dict(command)["criteria"] == "steady"


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("preshape", {"index_yaw": "x"}, "preshape.index_yaw: expected a number in rad, got 'x'"),
        ("preshape", {"index_yaw": True}, "preshape.index_yaw: expected a number in rad, got True"),
        (
            "preshape",
            {"index_yaw": float("nan")},
            "preshape.index_yaw: expected a number in rad that is finite, got nan",
        ),
        (
            "preshape",
            {"index_yaw": 10**400},
            "preshape.index_yaw: expected a number in rad that is finite, got 1000000",
        ),
        ("preshape", [0.1], "preshape: expected an object"),
        ("hand_pose", {"position": [0, 0]}, "hand_pose.position: expected 3 numbers"),
        ("hand_pose", {"position": [0, 0, float("inf")]}, "hand_pose.position: expected finite numbers"),
        ("hand_pose", {"position": ["0", "0", "0"]}, "hand_pose.position: expected numbers [x, y, z] in metres"),
        ("hand_pose", {"position": [0, 0, 0], "wxyz": [1, 1, 0, 0]}, "hand_pose.wxyz: expected a unit quaternion"),
        ("hand_pose", {"position": [0, 0, 0], "wxyz": [1, 0, 0]}, "hand_pose.wxyz: expected 4 numbers"),
        ("hand_pose", {"position": [0, 0, 0], "xyzw": [0, 0, 0, 1]}, "hand_pose.xyzw: unknown key"),
        ("hand_pose", None, "hand_pose: expected an object"),
        ("object_pose", {"wxyz": [1, 0, 0, 0]}, "object_pose.position: missing"),
        ("root_link", 3, "root_link: expected a name, got 3"),
        ("fingers", "index", "fingers: expected a list of at least one name"),
        ("fingers", [], "fingers: expected a list of at least one name"),
        ("fingers", ["index", "index"], "fingers[1]: 'index' is named twice"),
        ("fingers", ["index", 1], "fingers[1]: expected a name, got 1"),
        ("order", "fastest", "order: expected one of proximal-first"),
        ("orders", [], "orders: expected a list of at least one name"),
        ("orders", "together", "orders: expected a list of at least one name"),
        (
            "orders",
            ["together", "quick"],
            "orders[1]: expected one of proximal-first, together",
        ),
        ("orders", ["together", "together"], "orders[1]: 'together' is named twice"),
        ("rounds", -1, "rounds: expected at least 0, got -1"),
        ("planes", -3, "planes: expected at least 1, got -3"),
        ("planes", 2.5, "planes: expected a whole number, got 2.5"),
        ("planes", None, "planes: expected a whole number, got None"),
        ("full_width", 1, "full_width: expected true or false, got 1"),
        ("yaw_grid", [], "yaw_grid: expected a list of at least one number"),
        ("yaw_grid", [0.0, None], "yaw_grid[1]: expected a number"),
        ("collision_source", "mesh", "collision_source: expected one of engine, raw, visual"),
        ("criteria", {"range_of_motion": "high"}, "criteria.range_of_motion: expected a weight, got 'high'"),
        ("criteria", 4, "criteria: expected an object"),
        ("criteria", "", "criteria: expected a name"),
        ("next_steps", {"index_yaw": 0.1}, "next_steps: expected a list of postures"),
        ("next_steps", [0.1], "next_steps[0]: expected an object"),
        ("next_steps", [{}, {"index_yaw": None}], "next_steps[1].index_yaw: expected a number in rad"),
        ("task_wrenches", [], "task_wrenches: expected a list of at least one wrench to hold, got []"),
        ("task_wrenches", None, "task_wrenches: expected a list of at least one wrench to hold, got None"),
        ("task_wrenches", [[0, 0, 1]], "task_wrenches[0]: expected {'force': [x, y, z], 'torque': [x, y, z]}"),
        ("task_wrenches", [{}], "task_wrenches[0]: expected {'force': [x, y, z], 'torque': [x, y, z]}"),
        ("task_wrenches", [{"moment": [0, 0, 1]}], "task_wrenches[0]: expected {'force': [x, y, z], 'torque'"),
        ("task_wrenches", [{"force": [0, 1]}], "task_wrenches[0].force: expected [x, y, z] in N, got [0, 1]"),
        ("task_wrenches", [{"torque": [0, 1, "x"]}], "task_wrenches[0].torque[2]: expected a number, in Nm, got 'x'"),
        ("task_wrenches", [{"force": [0, 0, 0]}], "task_wrenches[0]: expected a force or torque that is not 0"),
        ("opposition_grid", [], "opposition_grid: expected a list of at least one number"),
        ("seed", "one", "seed: expected a whole number"),
        ("plane", 3, "plane: unknown key; expected one of hand_pose"),
    ],
)
def test_every_malformed_value_is_named_by_its_path(key, value, words):
    message = refused({"hand_pose": POSE, key: value})
    assert message.startswith(f"c.json: {words}"), message


@pytest.mark.parametrize(
    ("data", "words"), [({}, "hand_pose: missing"), ([], "expected an object"), (None, "expected an")]
)
def test_documents_without_a_hand_pose(data, words):
    assert refused(data).startswith(f"c.json: {words}")


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("{", FileError, "not JSON"),
        ("", FileError, "not JSON"),
        ('{"hand_pose": {"position": [0, 0, NaN]}}', CommandError, "hand_pose.position: expected finite numbers"),
        ('{"planes": 1, "planes": 2}', CommandError, "planes: the key is given twice"),
    ],
)
def test_files_that_are_not_commands(tmp_path, text, error, words):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(error) as caught:
        load_command(path)
    assert str(caught.value).startswith(f"{path}: {words}")


def test_missing_file_directory_and_bytes(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        load_command(tmp_path / "none.json")
    with pytest.raises(FileError, match="cannot be read"):
        load_command(tmp_path)
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00\x01\x02")
    with pytest.raises(FileError, match="not JSON"):
        load_command(tmp_path / "b.json")


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)


@given(key=st.sampled_from(KEYS), value=JSON)
def test_whatever_stands_in_a_file_gives_a_command_or_one_sentence(key, value):
    try:
        command = command_from_dict({"hand_pose": POSE, key: value})
    except CommandError as error:
        message = str(error)
    else:
        message = f"command: {key}"
        assert command_from_dict(command_to_dict(command)) == command
    assert message.startswith(f"command: {key}")


def test_check_accepts_what_the_hand_has():
    command = GraspCommand(
        Pose(),
        root_link="forearm",
        preshape={"wrist": 1.0, "index_yaw": -0.3, "index_proximal": 0.2},
        fingers=("index",),
    )
    check_command(small_hand(), command)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (
            {"preshape": {"indx_yaw": 0.1}},
            UnknownNameError,
            "Joint 'indx_yaw' is not in hand 'small'. Did you mean 'index_yaw'?",
        ),
        (
            {"preshape": {"index_yaw": 0.31}},
            CommandError,
            "preshape.index_yaw: 0.31 rad is outside the joint's limits [-0.3, 0.3] rad",
        ),
        (
            {"preshape": {"index_distal": 0.1}},
            CommandError,
            "preshape.index_distal: this joint follows 'index_proximal'",
        ),
        (
            {"preshape": {"index_yaw": np.nan}},
            CommandError,
            "preshape.index_yaw: expected a number in rad that is finite",
        ),
        ({"fingers": ("thumb",)}, UnknownNameError, "Finger 'thumb' is not in hand 'small'. Fingers: index."),
        ({"fingers": ()}, CommandError, "fingers: expected a list of at least one name"),
        ({"root_link": "arm"}, UnknownNameError, "Link 'arm' is not in hand 'small'. Did you mean 'forearm'?"),
        ({"root_link": "index_distal"}, CommandError, "root_link: 'index_distal' moves with finger 'index'"),
        ({"planes": 0}, CommandError, "planes: expected at least 1, got 0"),
        ({"rounds": -1}, CommandError, "rounds: expected at least 0, got -1"),
        ({"yaw_grid": ()}, CommandError, "yaw_grid: expected a list"),
        ({"open_variants": (np.inf,)}, CommandError, "open_variants[0]: expected a number"),
        ({"order": "sideways"}, CommandError, "order: expected one of"),
        ({"next_steps": ({"indx_yaw": 0.1},)}, UnknownNameError, "Joint 'indx_yaw' is not in hand 'small'."),
        ({"next_steps": ({}, {"index_yaw": 0.31})}, CommandError, "next_steps[1].index_yaw: 0.31 rad is outside"),
        ({"opposition_grid": (np.nan,)}, CommandError, "opposition_grid[0]: expected a number"),
        ({"criteria": {"range_of_motion": None}}, CommandError, "criteria.range_of_motion: expected a weight"),
    ],
)
def test_check_refuses_what_the_hand_has_not(change, error, words):
    with pytest.raises(error) as caught:
        check_command(small_hand(), replace(GraspCommand(Pose()), **change))
    assert str(caught.value).startswith(words), str(caught.value)


def test_a_step_may_name_followers_which_a_whole_posture_has():
    check_command(small_hand(), GraspCommand(Pose(), next_steps=({"index_proximal": 0.2, "index_distal": 0.2},)))


def test_a_limit_itself_is_inside_and_numpy_numbers_are_numbers():
    command = GraspCommand(
        Pose(), preshape={"index_yaw": np.float64(0.3)}, planes=np.int64(2), yaw_grid=(np.float32(0.5),)
    )
    check_command(small_hand(), command)


def test_a_misspelt_key_is_guessed():
    assert refused({"hand_pose": POSE, "plane": 3}).endswith(". Did you mean 'planes'?")
