"""Wrong types at the public functions: each is told in one sentence what is expected."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench

MAKERS = {
    "hand": r"clench\.Hand\.load",
    "obj": r"clench\.GraspObject\.load",
    "solution": r"clench\.solve",
    "command": r"clench\.(GraspCommand|load_command)",
    "hand_pose": r"clench\.Pose",
    "object_pose": r"clench\.Pose",
    "pose": r"clench\.Pose",
}


@pytest.fixture(scope="module")
def inputs() -> dict[str, Any]:
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    command = clench.GraspCommand(clench.Pose([0.0, 0.0, 5.0]))
    return {"hand": hand, "obj": obj, "command": command, "solution": clench.solve(hand, obj, command)}


#: Every function, with arguments by name; what is not given is of the right type.
CALLS: list[tuple[Callable[..., Any], tuple[str, ...], dict[str, Any]]] = [
    (clench.solve, ("hand", "obj", "command"), {}),
    (clench.solve_batch, ("hand", "obj", "command"), {"hand_poses": [clench.Pose()]}),
    (clench.solve_stream, ("hand", "obj", "command"), {"hand_poses": [clench.Pose()]}),
    (clench.Tracker, ("hand", "obj", "command"), {}),
    (clench.pose_error, ("hand", "obj", "command"), {}),
    (clench.sensitivity, ("solution", "hand", "obj"), {}),
    (clench.grasp_quality, ("solution", "hand", "obj"), {}),
    (clench.plan_squeeze, ("solution", "hand", "obj"), {}),
    (clench.plan_trajectory, ("solution", "hand", "obj"), {}),
    (clench.plan_pregrasp, ("solution", "hand", "obj"), {}),
    (clench.complete, ("solution", "hand", "obj"), {}),
    (clench.approach_poses, ("hand", "obj"), {"count": 1, "seed": 0}),
    (clench.check_hand, ("hand",), {}),
    (clench.SimulatedHand, ("hand", "obj"), {}),
    (clench.HardwareHand, ("hand",), {"driver": None}),
    (clench.plan_grasps, ("hand", "obj"), {"count": 1}),
    (clench.stable_poses, ("obj",), {}),
    (clench.draw_solution, ("hand", "obj", "command", "solution"), {"directory": "none"}),
    (clench.write_page, ("hand", "obj"), {"path": "none.html", "shown": None}),
]
WRONG = ["mug", (0.0, 0.0, 0.1), np.zeros(7), {"hand_pose": {"position": [0, 0, 0]}}, 3]


@pytest.mark.parametrize(
    ("function", "names", "others", "wrong"),
    [(f, names, others, wrong) for f, names, others in CALLS for wrong in names],
    ids=[f"{f.__name__}-{wrong}" for f, names, _ in CALLS for wrong in names],
)
def test_each_argument_of_another_type_is_named(
    inputs: dict[str, Any],
    function: Callable[..., Any],
    names: tuple[str, ...],
    others: dict[str, Any],
    wrong: str,
) -> None:
    right = {name: inputs[name] for name in names}
    another = inputs["solution"] if wrong != "solution" else inputs["hand"]
    for value in [*WRONG, another]:
        with pytest.raises(clench.CommandError, match=rf"^{wrong}: expected a clench\.\w+.*{MAKERS[wrong]}") as error:
            function(**{**right, wrong: value}, **others)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("wrong", ["x", (0.0, 0.0, 0.1), 3])
def test_surroundings_of_another_type_are_named(wrong: object) -> None:
    ball = clench.GraspObject.load("ball")
    with pytest.raises(clench.CommandError, match=r"^body: expected a clench\.Body, got .*; clench\.obstacle\("):
        ball.with_body(wrong)
    with pytest.raises(clench.CommandError, match=r"^other: expected a clench\.GraspObject, got"):
        ball.with_object(wrong)
    with pytest.raises(clench.CommandError, match=r"^pose: expected a clench\.Pose, got"):
        clench.obstacle("sphere:r=0.01", wrong)
    if wrong != 3:
        with pytest.raises(clench.ObjectError, match=r"^table: expected a finite height"):
            clench.table(wrong)


@pytest.mark.parametrize("wrong", ["x", (0.0, 0.0, 0.1), np.eye(4), None])
def test_a_command_takes_a_pose_alone(wrong: object) -> None:
    with pytest.raises(clench.CommandError, match=r"^hand_pose: expected a clench\.Pose, got .*; clench\.Pose\("):
        clench.GraspCommand(wrong)
    if wrong is not None:
        with pytest.raises(clench.CommandError, match=r"^object_pose: expected a clench\.Pose"):
            clench.GraspCommand(clench.Pose(), object_pose=wrong)
    with pytest.raises(clench.CommandError, match=r"^pose: expected a clench\.Pose"):
        clench.GraspObject.load("ball", pose=wrong if wrong is not None else 0)


def test_text_is_told_how_to_load_it(inputs: dict[str, Any]) -> None:
    hand, obj, command = inputs["hand"], inputs["obj"], inputs["command"]
    for arguments, advice in [
        (("robonaut2", obj, command), "clench.Hand.load('robonaut2') makes one."),
        ((hand, "ball", command), "clench.GraspObject.load('ball') makes one."),
        ((hand, obj, "c.json"), "clench.load_command('c.json') makes one."),
    ]:
        with pytest.raises(clench.CommandError) as error:
            clench.solve(*arguments)
        assert str(error.value).endswith(advice)


def test_a_hand_is_no_actuator(inputs: dict[str, Any]) -> None:
    with pytest.raises(clench.CommandError, match=r"^actuator: .*clench\.SimulatedHand\(hand, obj\), got Hand\.$"):
        clench.execute(inputs["solution"], inputs["hand"])


@pytest.mark.parametrize("load", [clench.Hand.load, clench.GraspObject.load, clench.load_command])
@pytest.mark.parametrize("wrong", [3, None, ["mug"]])
def test_what_is_loaded_is_text_or_a_path(load: Callable[[Any], Any], wrong: object) -> None:
    with pytest.raises(clench.CommandError, match=r"expected text or a pathlib\.Path, got"):
        load(wrong)
    with pytest.raises(clench.FileError):
        load(Path("nowhere.xml"))


def test_a_pose_is_a_command_that_asks_for_nothing_else(inputs: dict[str, Any]) -> None:
    hand, obj, command = inputs["hand"], inputs["obj"], inputs["command"]
    pose = command.hand_pose
    assert clench.solve(hand, obj, pose).joint_angles == inputs["solution"].joint_angles
    tracked = [clench.Tracker(hand, obj, asked).update().joint_angles for asked in (pose, command)]
    assert np.array_equal(*tracked)
    errors = [clench.pose_error(hand, obj, asked).to_dict() for asked in (pose, command)]
    assert errors[0] == errors[1]


@pytest.mark.parametrize("wrong", [None, "mug", 3, [3]])
def test_a_page_takes_grasps_alone(inputs: dict[str, Any], wrong: Any, tmp_path: Path) -> None:
    with pytest.raises(clench.CommandError, match=r"^shown: expected solutions, a plan or a planned grasp, got \w+\.$"):
        clench.write_page(tmp_path / "page.html", inputs["hand"], inputs["obj"], wrong)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("key", "wrong", "said"),
    [
        ("order", "toghether", r"order: expected one of proximal-first, together, fingertip, got 'toghether'\."),
        ("order", None, r"order: expected one of proximal-first, together, fingertip, got None\."),
        ("orders", "together", r"orders: expected a list of closing orders, got 'together'\."),
        ("orders", ["together", "x"], r"orders\[1\]: expected one of proximal-first, .*, got 'x'\."),
        ("collision_source", "hull", r"collision_source: expected one of engine, raw, visual, got 'hull'\."),
    ],
)
def test_a_command_refuses_a_wrong_name_when_it_is_made(key: str, wrong: object, said: str) -> None:
    with pytest.raises(clench.CommandError, match=f"^{said}$"):
        clench.GraspCommand(clench.Pose(), **{key: wrong})


def test_a_command_takes_names_and_members_alike() -> None:
    by_name = clench.GraspCommand(clench.Pose(), order="together", orders=["fingertip"], collision_source="raw")
    assert by_name.order.is_simultaneous
    assert [order.is_of_tips for order in by_name.orders] == [True]
    assert by_name.collision_source is clench.types.CollisionSource.RAW
