"""Sets that decide nothing are made when they are read, and are what they are when all are made at once."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import clench
from clench.closing import packed_problem
from clench.closing.packed_problem import pack_problem
from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.scoring import criterion_registry
from clench.solver import alternatives, pose_solver
from clench.solver.planning import plan_hand
from clench.solver.problem import make_problem

HANDS = {name: clench.Hand.load(name) for name in ("robonaut2", "patent15")}
ASKED: dict[str, dict[str, Any]] = {
    "ball": {"planes": 3},
    "box:x=0.05,y=0.06,z=0.08": {"planes": 2, "criteria": "steady"},
    "cylinder:r=0.004,h=0.2": {"planes": 2, "order": "together"},
    "mug": {"planes": 2, "criteria": {"pose_sensitivity": 1.0, "limit_distance": 0.5}},
    "sphere:r=0.035": {"planes": 3, "full_width": False, "measure": False},
}


def in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let solves close all sets, and choose among them in Python."""

    def all_sets(problem: Any, calibration: Any) -> alternatives.Candidates:
        tip_only = problem.command.order == clench.ClosingOrder.FINGERTIP
        packed = pack_problem(plan_hand(problem), problem.packed, (), tip_only)
        return alternatives.Candidates(packed, by_kernel=False)

    monkeypatch.setattr(pose_solver, "candidates_of", all_sets)


def documents(hand: clench.Hand, obj: clench.GraspObject, commands: list[clench.GraspCommand]) -> list[dict[str, Any]]:
    return [{**clench.solve(hand, obj, c).to_dict(), "timing": {}} for c in commands]


def commands(hand: clench.Hand, obj: clench.GraspObject, **asked: Any) -> list[clench.GraspCommand]:
    """Return commands at approach poses, and at one inside the object."""
    poses = clench.approach_poses(hand, obj, 3, 0)
    return [
        clench.GraspCommand(hand_pose=p, **{"preshape": "open", **asked})
        for p in (*poses, Pose(obj.pose.position, poses[0].wxyz))
    ]


@pytest.mark.parametrize("model", ASKED)
@pytest.mark.parametrize("name", HANDS)
def test_documents_are_those_of_a_choice_among_all(name: str, model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    hand, obj = HANDS[name], clench.GraspObject.load(model)
    asked = commands(hand, obj, **ASKED[model])
    late = documents(hand, obj, asked)
    in_full(monkeypatch)
    assert late == documents(hand, obj, asked)


def test_fingers_that_the_others_made_close_again_are_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("cylinder:r=0.004,h=0.2")
    poses = clench.approach_poses(hand, obj, 12, 0)
    asked = [clench.GraspCommand(hand_pose=pose, planes=2, criteria="steady", preshape="open") for pose in poses]
    late = documents(hand, obj, asked)
    assert any(f["closed_again"] for d in late for f in d["choice"]["fingers"].values())
    in_full(monkeypatch)
    assert late == documents(hand, obj, asked)


@pytest.mark.parametrize(
    ("asked", "at_once", "when_read"),
    [
        ({}, "full width", ["planes"]),
        ({"criteria": "steady"}, "full width", ["planes"]),
        ({"full_width": False}, "all", []),
        ({"check_candidates": True}, "all", []),
        ({"open_variants": (0.0, 0.2)}, "all", []),
        ({"rounds": 2}, "full width", ["planes"]),
        ({"criteria": {"own": 1.0}}, "all", []),
    ],
    ids=str,
)
def test_only_what_may_be_chosen_is_closed(
    asked: dict[str, Any], at_once: str, when_read: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    register(monkeypatch, "own", lambda: 1.0)
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    command = commands(hand, obj, planes=2, **asked)[0]
    late: list[int] = []
    close = alternatives.close_candidates

    def counted(problem: Any, *rest: Any) -> Any:
        late.append(len(problem.plan.candidates.finger_posture))
        return close(problem, *rest)

    monkeypatch.setattr(alternatives, "close_candidates", counted)
    made: list[int] = []
    first = pose_solver.candidates_of
    monkeypatch.setattr(
        pose_solver,
        "candidates_of",
        lambda *given: made.append(len((c := first(*given)).plan.candidates.finger_posture)) or c,
    )
    every, fingers = len(plan_hand(make_problem(hand, obj, command)).candidates.finger_posture), len(hand.fingers)
    numbers = {"all": every, "full width": fingers, "planes": every - fingers}
    solution = clench.solve(hand, obj, command)
    assert solution.contacts
    for finger in solution.fingers.values():
        best = finger.best
        assert best is not None
        assert all(solution.joint_angles[name] == angle for name, angle in best.joint_angles.items())
    assert (made, late) == ([numbers[at_once]], [])
    assert solution.choice is not None
    assert len(solution.choice["fingers"]) == fingers
    assert late == [numbers[what] for what in when_read]


def test_threads_that_read_at_once_get_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    command = commands(hand, obj, planes=2, criteria="steady")[0]
    alone = documents(hand, obj, [command])[0]
    calls = []
    choose = alternatives.choose
    monkeypatch.setattr(alternatives, "choose", lambda *given: calls.append(1) or choose(*given))
    solution = clench.solve(hand, obj, command)
    assert calls == []
    with ThreadPoolExecutor(4) as threads:
        read = list(threads.map(lambda _: {**solution.to_dict(), "timing": {}}, range(8)))
    assert read == [alone] * 8
    assert calls == [1]


@pytest.mark.parametrize("name", ["own", "range_of_motion"])
def test_what_a_criterion_of_others_raises_is_raised_by_the_solve(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, name, lambda: np.nan)
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    command = commands(hand, obj, planes=2, criteria={name: 1.0})[0]
    with pytest.raises(CommandError, match="expected a finite number"):
        clench.solve(hand, obj, command)


def register(monkeypatch: pytest.MonkeyPatch, called: str, value: Callable[[], float]) -> None:
    """Register a criterion, for one test, that gives planes a value."""

    class Own:
        name = called
        unit = source = "test"
        scale = 1.0
        larger_is_better = True

        def score(self, candidate: Any, context: Any) -> float | None:
            return None if candidate.plane is None else value()

    monkeypatch.setattr(criterion_registry, "_registry", dict(criterion_registry._registry))
    clench.register_criterion(Own())


@pytest.mark.parametrize("full_width", [True, False])
def test_changes_of_what_was_given_do_not_reach_what_is_read_later(full_width: bool) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    pose = commands(hand, obj)[0].hand_pose
    fingers, grid, preshape = ["thumb", "index"], [0.0], {hand.joints[hand.fingers[0].joints[-1]].name: 0.1}
    given: dict[str, Any] = {"fingers": fingers, "open_variants": grid, "preshape": preshape}
    command = clench.GraspCommand(hand_pose=pose, planes=2, full_width=full_width, **{"preshape": "open", **given})
    right = documents(hand, obj, [command])[0]
    solution = clench.solve(hand, obj, command)
    fingers.reverse()
    fingers.append("middle")
    grid.append(0.2)
    preshape.clear()
    assert {**solution.to_dict(), "timing": {}} == right


def test_problems_are_packed_once_whatever_their_criteria_are(monkeypatch: pytest.MonkeyPatch) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    pose, made = commands(hand, obj)[0].hand_pose, []
    pack = packed_problem._pack
    monkeypatch.setattr(packed_problem, "_pack", lambda *given: made.append(1) or pack(*given))
    joint = hand.joints[hand.fingers[0].joints[-1]].name
    several = [{joint: 0.01 * k} for k in range(1, 13)]
    for full_width, criteria in ((True, {"limit_distance": 1.0}), (False, {"limit_distance": 2.0})):
        for _ in range(2):
            for preshape in several:
                asked: dict[str, Any] = {"criteria": dict(criteria), "preshape": preshape, "full_width": full_width}
                clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, planes=4, **{"preshape": "open", **asked}))
    assert len(made) == 2 * len(several)


def test_a_certificate_and_limits_are_plain_values() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    solution = clench.solve(hand, obj, commands(hand, obj, planes=2)[0])
    assert solution.certified
    assert type(solution.joint_limits) is dict
    assert type(solution.certificate) is dict
