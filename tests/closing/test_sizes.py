"""Sizes and distances that suggest millimetres are told at once, and solved all the same."""

import re
import warnings

import pytest

import clench
from clench.apps.cli.main import main
from clench.closing.collision.sizes import hand_size
from clench.models.objects.grasp_object import BodyRole

INSIDE = clench.GraspCommand(hand_pose=clench.Pose([0.05, 0.02, 0.01]), preshape="open")


@pytest.fixture(scope="module")
def hand():
    return clench.Hand.load("robonaut2")


def test_the_size_of_a_hand(hand):
    assert 0.2 < hand_size(hand) < 0.4


@pytest.mark.parametrize(
    ("model", "scale", "advised"),
    [
        ("sphere:r=3", 1.0, "if its lengths are in millimetres, load it with a scale of 0.001 (--scale 0.001)"),
        ("sphere:r=30", 1.0, "if its lengths are in millimetres, load it with a scale of 0.001 (--scale 0.001)"),
        (
            "mug",
            1000.0,
            "if the scale of 1000 makes it a thousand times too large, load it with a scale of 1 (--scale 1)",
        ),
        (
            "mug",
            40.0,
            "if the scale of 40 makes it a thousand times too large, load it with a scale of 0.04 (--scale 0.04)",
        ),
    ],
)
def test_millimetres_taken_for_metres(model, scale, advised, hand):
    obj = clench.GraspObject.load(model, scale=scale)
    with pytest.warns(UserWarning, match=f"^{model} is .* m across, .* times the size of the hand {hand.name}"):
        solution = clench.solve(hand, obj, INSIDE)
    assert solution.status == "blocked"
    assert solution.reason["link"] == "palm"
    assert any(warning.endswith(f": {advised}.") for warning in obj.warnings)
    with pytest.warns(UserWarning, match=f": {re.escape(advised)}.$"):
        clench.solve_batch(hand, obj, [clench.Pose([0.05, 0.02, 0.01])])


def test_how_deep_a_hand_far_inside_is(hand):
    obj = clench.GraspObject.load("sphere:r=3")
    with pytest.warns(UserWarning, match="times the size of the hand"):
        solution = clench.solve(hand, obj, INSIDE)
    assert "palm overlaps sphere:r=3 by at least 1" in solution.reason["text"]
    assert 0.1 < solution.max_penetration < 0.2
    assert solution.reason["retreat"] == pytest.approx(3.12, abs=0.01)


def test_a_large_table_is_no_mistake(hand):
    scene = clench.GraspObject.load("mug").with_object(
        clench.GraspObject.load("box:x=5,y=5,z=0.1"), clench.Pose([0.0, 0.0, -0.05]), BodyRole.OBSTACLE
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clench.solve(hand, scene, clench.GraspCommand(hand_pose=clench.Pose([-0.05, -0.1, 0.3]), preshape="open"))


def test_the_command_line_says_it_once(tmp_path, capsys):
    (tmp_path / "c.json").write_text('{"hand_pose": {"position": [0.05, 0.02, 0.01], "wxyz": [1, 0, 0, 0]}}')
    call = ["--hand", "robonaut2", "--object", "sphere:r=3", "--command", str(tmp_path / "c.json")]
    assert main(["solve", *call]) == 1
    heard = capsys.readouterr()
    assert " across" not in heard.out
    told = heard.err.splitlines()
    assert [line for line in told if "times the size of the hand" in line] == told[:1]
    assert told[0].startswith("clench: warning: sphere:r=3 is 6 m across, ")


@pytest.mark.parametrize(
    ("model", "scale", "advised"),
    [
        (
            "mug",
            0.001,
            "if the scale of 0.001 makes it a thousand times too small, load it with a scale of 1 (--scale 1)",
        ),
        ("sphere:r=0.0004", 1.0, "if its units are not metres, load it with another scale (--scale)"),
    ],
)
def test_a_speck(model, scale, advised, hand):
    obj = clench.GraspObject.load(model, scale=scale)
    told = rf"^{model} is .* m across, 1/\d+ of the size of the hand {hand.name} .*: {re.escape(advised)}\.$"
    with pytest.warns(UserWarning, match=told):
        clench.solve(hand, obj, INSIDE)
    assert any(warning.endswith(f": {advised}.") for warning in obj.warnings)


def test_a_small_thing_is_no_mistake(hand):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clench.solve(hand, clench.GraspObject.load("sphere:r=0.003"), INSIDE)


def test_a_pose_in_millimetres(hand, tmp_path, capsys):
    mug, far = clench.GraspObject.load("mug"), clench.Pose([200.0, -100.0, 60.0])
    asked = "m away from mug: are the lengths of its pose in millimetres?"
    solution = clench.solve(hand, mug, clench.GraspCommand(hand_pose=far))
    assert solution.status == "no_contact"
    assert solution.reason["text"].startswith(f"The hand is 231 {asked} No finger touches")
    near = clench.Pose([0.0, 0.0, 0.6])
    with pytest.warns(UserWarning, match=r"^1 of 2 poses place the hand 231 m or more away from mug: are their"):
        batch = clench.solve_batch(hand, mug, [near, far])
    assert asked in batch.solution(1).reason["text"]
    assert asked not in batch.solution(0).reason["text"]
    (tmp_path / "c.json").write_text('{"hand_pose": {"position": [200, -100, 60], "wxyz": [1, 0, 0, 0]}}')
    assert main(["solve", "--hand", "robonaut2", "--object", "mug", "--command", str(tmp_path / "c.json")]) == 1
    assert asked in " ".join(capsys.readouterr().out.split())
