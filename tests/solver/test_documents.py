"""Solutions as documents: equal after a round trip, strict when read, judged by themselves."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import ClenchError, FileError
from clench.core.files.json_files import write_atomically
from clench.core.pose import Pose
from clench.models.hand.reading.extremes import LARGEST_ANGLE
from clench.solver.solution import FingerResult, FingerStatus, GraspSolution, SolutionStatus
from handmade import make_candidate, make_contact, make_solution

finite = st.floats(allow_nan=False, allow_infinity=False)


def test_the_documented_keys_are_there(solution: GraspSolution) -> None:
    document = solution.to_dict()
    assert document["schema"] == "clench.solution/1"
    documented = (
        "schema clench_version hand object geometry_hash seed status reason hand_pose object_pose decomposition "
        "joint_angles certified collision_source max_penetration fingers contacts quality squeeze pregrasp timing"
    )
    assert set(documented.split()) <= set(document)
    assert set(document["fingers"]["index"]) == {"status", "reason", "cause", "chosen", "candidates"}
    candidate = "plane offset order joint_angles feasible penetration scores contacts"
    assert set(candidate.split()) <= set(document["fingers"]["index"]["candidates"][0])
    contact = "finger link stops_joint plane offset kind passed position normal gap curve_angle link_angle"
    assert set(contact.split()) <= set(document["contacts"][0])
    assert document["hand_pose"].keys() == {"position", "wxyz"}
    assert document["quality"] is document["squeeze"] is document["pregrasp"] is None


def test_round_trip_through_a_file(solution: GraspSolution, tmp_path: Path) -> None:
    solution.save(tmp_path / "s.json")
    loaded = GraspSolution.load(tmp_path / "s.json")
    assert loaded == solution
    assert loaded.to_dict() == solution.to_dict()
    assert loaded != replace(solution, seed=8)
    assert [p.name for p in tmp_path.iterdir()] == ["s.json"]


@settings(deadline=None)
@given(
    finite,
    st.lists(st.floats(-1e8, 1e8), min_size=3, max_size=3),
    st.text(),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4),
)
def test_round_trip_keeps_every_bit(number: float, vector: list[float], text: str, quaternion: list[float]) -> None:
    norm = float(np.linalg.norm(quaternion))
    pose = Pose(vector, wxyz=np.array(quaternion) / norm if norm > 1e-3 else (1, 0, 0, 0))
    contact = make_contact(position=np.array(vector), gap=number, link=text)
    angles = {text: float(np.clip(number, -LARGEST_ANGLE, LARGEST_ANGLE))}
    solution = make_solution(
        hand_pose=pose, object_pose=pose.inverse(), joint_angles=angles, contacts=(contact,), hand=text
    )
    again = GraspSolution.from_dict(json.loads(json.dumps(solution.to_dict())))
    assert again == solution


def test_next_steps_come_back_and_older_documents_have_none(tmp_path: Path) -> None:
    steps = ({"index_curl": 0.1, "index_yaw": -0.2}, {})
    make_solution(next_steps=steps).save(tmp_path / "s.json")
    assert GraspSolution.load(tmp_path / "s.json").next_steps == steps
    document = make_solution().to_dict()
    assert document.pop("next_steps") == []
    assert GraspSolution.from_dict(document) == make_solution()


def test_the_choice_comes_back(tmp_path: Path) -> None:
    choice = {"text": "x", "fingers": {"index": {"totals": [0.5, -1.0], "pareto": [1], "runner_up": None}}}
    make_solution(choice=choice).save(tmp_path / "s.json")
    assert GraspSolution.load(tmp_path / "s.json").choice == choice


def test_numpy_values_become_plain_ones() -> None:
    solution = make_solution(
        seed=np.int64(3),
        certified=np.bool_(True),
        joint_angles={"a": np.float32(0.5)},
        reason={"code": "blocked", "text": "x", "place": np.zeros(3), "depth": np.float64(1e-3), "pair": ("a", "b")},
    )
    document = json.loads(json.dumps(solution.to_dict()))
    assert document["reason"]["place"] == [0.0, 0.0, 0.0]
    assert document["reason"]["pair"] == ["a", "b"]
    assert document["joint_angles"] == {"a": 0.5}
    assert document["certified"] is True


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite_is_refused_with_its_key(bad: float, tmp_path: Path) -> None:
    target = tmp_path / "s.json"
    with pytest.raises(ClenchError, match=r"solution\.fingers\.index\.candidates\[0\]\.joint_angles\.tip: is not a f"):
        make_solution(
            fingers={
                "index": FingerResult("index", FingerStatus.TOUCH, "", 0, (make_candidate(joint_angles={"tip": bad}),))
            }
        ).save(target)
    assert not target.exists()
    document = make_solution().to_dict()
    document["contacts"][0]["position"][1] = bad
    with pytest.raises(FileError, match=r"^here: contacts\[0\]\.position\[1\]: expected a finite number"):
        GraspSolution.from_dict(document, "here")


REMOVED = object()


def edited(path: str, value: Any) -> dict[str, Any]:
    document = copy.deepcopy(make_solution().to_dict())
    *parents, last = path.split("/")
    place: Any = document
    for key in parents:
        place = place[int(key) if isinstance(place, list) else key]
    if value is REMOVED:
        del place[last]
    else:
        place[last] = value
    return document


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("schema", "clench.solution/2", r"schema: expected 'clench.solution/1', got 'clench.solution/2'"),
        ("schema", REMOVED, r"schema: expected 'clench.solution/1', got None"),
        ("status", "great", r"status: invalid enum value 'great'"),
        ("joint_angles/index_curl", "half", r"joint_angles\.index_curl: expected 'float', got 'str'"),
        ("joint_angles", REMOVED, r"object missing required field 'joint_angles'"),
        ("reason", {"code": "x"}, r"reason\.text: missing"),
        ("hand_pose/wxyz", [1, 1, 0, 0], r"hand_pose\.wxyz: expected a unit quaternion .* norm 1\.41421"),
        ("hand_pose/position", [1, 2], r"hand_pose\.position: expected 3 numbers"),
        ("hand_pose/frame", "x", r"hand_pose\.frame: unknown key"),
        ("object_pose", 3, r"object_pose: expected an object"),
        ("fingers/index/chosen", 3, r"fingers\.index\.chosen: expected the index of a candidate, 0 to 2, got 3"),
        ("fingers/index/chosen", -1, r"fingers\.index\.chosen: expected the index"),
        ("fingers/index/candidates/1/plane", 0.5, r"fingers\.index\.candidates\[1\]\.plane: expected 'int \| null'"),
        (
            "fingers/index/candidates/1/scores/x",
            None,
            r"fingers\.index\.candidates\[1\]\.scores\.x: expected 'float', got 'null'",
        ),
        ("contacts/0/normal", [0, 1], r"contacts\[0\]\.normal: expected 'array' of length 3"),
        ("contacts/0/kind", "soft", r"contacts\[0\]\.kind: invalid enum value 'soft'"),
        ("contacts/0/gap", REMOVED, r"contacts\[0\]: object missing required field 'gap'"),
        ("decomposition/closing", [1], r"decomposition\.closing: expected 'object', got 'array'"),
        ("joint_limits/index_tip", [0.0], r"joint_limits\.index_tip: expected 'array' of length 2"),
        ("certified", 1, r"certified: expected 'bool', got 'int'"),
        ("next_steps", {"index_tip": 0.1}, r"next_steps: expected 'array', got 'object'"),
        ("next_steps", [{}, 0.1], r"next_steps\[1\]: expected 'object', got 'float'"),
        ("next_steps", [{"index_tip": "far"}], r"next_steps\[0\]\.index_tip: expected 'float', got 'str'"),
        ("collision_source", "thick", r"collision_source: invalid enum value 'thick'"),
        ("object_collision_source", "thick", r"object_collision_source: invalid enum value 'thick'"),
        ("squeeze", {"offsets": "none"}, r"squeeze\.offsets: expected 'object', got 'str'"),
        ("squeeze", {"offsets": {"index_tip": "a"}}, r"squeeze\.offsets\.index_tip: expected 'float', got 'str'"),
        ("squeeze", {"tensions": [1.0, "a"]}, r"squeeze\.tensions\[1\]: expected 'float', got 'str'"),
        ("squeeze", {"feasible": "yes"}, r"squeeze\.feasible: expected 'bool', got 'str'"),
    ],
)
def test_malformed_documents_name_file_and_key(path: str, value: Any, message: str, tmp_path: Path) -> None:
    file = tmp_path / "s.json"
    file.write_text(json.dumps(edited(path, value)))
    with pytest.raises(FileError, match=r"s\.json: " + message) as caught:
        GraspSolution.load(file)
    assert "\n" not in str(caught.value)


def test_keys_added_later_are_ignored() -> None:
    assert GraspSolution.from_dict(edited("invented_later", {"x": 1})) == make_solution()


@pytest.mark.parametrize(
    ("content", "message"), [(b"{", "not JSON"), (b"[1]", "expected an object"), (b"\xff", "not JSON")]
)
def test_files_that_hold_no_solution(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "s.json").write_bytes(content)
    with pytest.raises(FileError, match=message):
        GraspSolution.load(tmp_path / "s.json")


def test_missing_file_and_folder(tmp_path: Path, solution: GraspSolution) -> None:
    with pytest.raises(FileError, match=r"none\.json: no such file"):
        GraspSolution.load(tmp_path / "none.json")
    with pytest.raises(FileError, match=r"cannot be written \(No such file or directory\)"):
        solution.save(tmp_path / "absent" / "s.json")
    with pytest.raises(FileError, match="cannot be read"):
        GraspSolution.load(tmp_path)


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "s.json"
    target.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(FileError, match="No space left on device"):
        write_atomically(target, b"new")
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["s.json"]


def test_a_path_that_is_none_is_refused_in_a_sentence() -> None:
    with pytest.raises(FileError, match="is no path of a file"):
        write_atomically("a\0b", b"new")


def test_a_good_solution_has_no_violations(solution: GraspSolution) -> None:
    assert solution.violations() == ()
    assert solution.is_valid()


@pytest.mark.parametrize("status", [SolutionStatus.NO_CONTACT, SolutionStatus.BLOCKED])
def test_other_answers_are_not_valid_but_no_violation(status: SolutionStatus) -> None:
    solution = make_solution(status=status)
    assert not solution.is_valid()
    assert solution.violations() == ()


def with_chosen(**changes: object) -> dict[str, Any]:
    return {"fingers": {"index": FingerResult("index", FingerStatus.TOUCH, "", 0, (make_candidate(**changes),))}}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"max_penetration": 1.1e-6, "certified": True}, "penetrates the object by 1.1e-06 m"),
        ({"max_penetration": 1.1e-3}, "penetrates the object by 0.0011 m"),
        ({"joint_limits": {"index_curl": (0.0, 0.3)}}, "Joint 'index_curl' is at 0.333333 rad, outside its limits"),
        (with_chosen(feasible=False, penetration=2e-3), "finger 'index' is not feasible: .* by 0.002 m"),
        (with_chosen(joint_angles={"index_curl": 0.1}), "Joint 'index_curl' is at 0.333333333 rad in the solution"),
        (with_chosen(joint_angles={"other": 0.1}), "Joint 'other' of finger 'index' has no angle"),
        ({"fingers": {"index": FingerResult("index", FingerStatus.TOUCH, "", 0, ())}}, "touch but has no candidate"),
        ({"joint_angles": {"index_curl": np.nan}}, r"joint_angles\.index_curl is not a finite number"),
        ({"max_penetration": np.inf}, "max_penetration is not a finite number"),
        ({"contacts": (make_contact(gap=-2e-9),)}, r"Contact 0 \(index, index_distal\) overlaps the object by 2e-09 m"),
        ({"contacts": (make_contact(gap=2e-6),)}, "2e-06 m away from the object but not marked as passed"),
        ({"contacts": (make_contact(normal=np.array([0.0, 0.0, 2.0])),)}, "normal of length 2, expected 1"),
        ({"contacts": (make_contact(normal=np.array([0.0, 3e200, 4e200])),)}, r"normal of length 5e\+200, expected 1"),
        ({"contacts": (make_contact(position=np.array([0, np.nan, 0])),)}, r"contacts\[0\]\.position is not a finite"),
        ({"contacts": (make_contact(finger="toe"),)}, "belongs to a finger that the solution does not have"),
    ],
)
def test_violations(changes: dict[str, Any], sentence: str) -> None:
    import re

    solution = make_solution(**changes)
    found = [v for v in solution.violations() if re.search(sentence, v)]
    assert len(found) == 1, solution.violations()
    assert not solution.is_valid()


def test_bounds_are_not_violations() -> None:
    at_bounds = make_solution(
        max_penetration=1e-6,
        contacts=(make_contact(gap=-1e-9), make_contact(gap=1e-6), make_contact(gap=0.01, passed=True)),
        joint_limits={"index_curl": (1.0 / 3.0, 1.0)},
    )
    assert at_bounds.violations() == ()
    assert make_solution(max_penetration=None).is_valid()
