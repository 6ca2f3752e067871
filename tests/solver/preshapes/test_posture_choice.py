"""The posture that clench chooses: what is compared, what decides, and where there is no choice."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import clench
from clench.core.caching.deferring import DeferredMapping
from clench.models.command_file import command_from_dict, command_to_dict
from clench.models.hand.hand import JointRole
from clench.solver.batch.saved_question import SavedBatch
from clench.solver.orders import settled
from clench.solver.preshapes.postures import MOST_COMPARED, posture_options
from clench.solver.preshapes.preshapes import opposition_zones, posture_joints
from clench.solver.solution import posture_reason

HAND = clench.Hand.load("robonaut2")
MUG = clench.GraspObject.load("mug")
#: Where the palm holds the wall of the mug.
HELD = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
POSES = clench.approach_poses(HAND, MUG, 6, 0)
#: Statuses, best first.
BEST = ("grasp", "partial", "no_contact", "blocked")


def command(pose: clench.Pose = HELD, **changes: Any) -> clench.GraspCommand:
    return clench.GraspCommand(hand_pose=pose, **{"measure": False, **changes})


def said(solution: clench.GraspSolution) -> Any:
    assert solution.choice is not None
    return solution.choice["preshapes"]


def total(solution: clench.GraspSolution) -> float:
    """Return the weighted sum of the default preset, with the motion from the open hand, by hand."""
    q = np.array([solution.joint_angles[name] for name in HAND.joint_names])
    motion, links, left = 0.0, set(), 0.0
    for finger in HAND.fingers:
        motion += float(np.abs(q - HAND.open_angles())[list(finger.joints)].sum())
        closing = [j for j in finger.joints if HAND.joints[j].role is JointRole.CLOSING]
        ends = [HAND.joints[j].upper if HAND.joints[j].direction > 0 else HAND.joints[j].lower for j in closing]
        spans = [HAND.joints[j].upper - HAND.joints[j].lower for j in closing]
        left += min(abs(end - q[j]) / span for j, end, span in zip(closing, ends, spans, strict=True))
        links |= {c.link for c in solution.contacts if c.finger == finger.name and not c.passed}
    return len(links) - motion + 0.2 * left / 0.5


@pytest.mark.parametrize("pose", [HELD, *POSES])
def test_the_best_of_all_preshapes_is_chosen(pose: clench.Pose) -> None:
    solution = clench.solve(HAND, MUG, command(pose))
    options = posture_options(HAND, command(pose))
    assert 2 < len(options) <= MOST_COMPARED
    assert options[0].name == "open"
    assert list(said(solution)["compared"]) == [option.name for option in options]
    alone = {o.name: clench.solve(HAND, MUG, command(pose, preshape=o.name)) for o in options}
    assert {name: s.status for name, s in alone.items()} == {
        name: each["status"] for name, each in said(solution)["compared"].items()
    }
    best = min(BEST.index(s.status) for s in alone.values())
    assert BEST.index(solution.status) == best
    if best < 2:
        compared = said(solution)["compared"]
        totals = {name: total(s) for name, s in alone.items() if BEST.index(s.status) == best and s.certified}
        assert {name: compared[name]["total"] for name in totals} == pytest.approx(totals, abs=1e-9)
        closed = {name: value for name, value in totals.items() if compared[name]["epsilon_bound"] > 0.0}
        assert totals[said(solution)["chosen"]] == pytest.approx(max((closed or totals).values()), abs=1e-9)
    else:
        assert said(solution)["chosen"] == "open"
    assert dict(alone[said(solution)["chosen"]].joint_angles) == dict(solution.joint_angles)


def test_a_grasp_that_resists_every_wrench_comes_before_one_that_moves_less() -> None:
    """The bound is never above epsilon, and the chosen grasp holds the mug, which the best by its sum does not."""
    solution = clench.solve(HAND, MUG, command())
    compared = said(solution)["compared"]
    for name, each in compared.items():
        alone = clench.solve(HAND, MUG, command(preshape=name))
        exact = clench.grasp_quality(alone, HAND, MUG).epsilon.radius if alone.contacts else 0.0
        assert each["epsilon_bound"] <= exact + 1e-9
    by_sum = max((n for n in compared if compared[n]["status"] == "grasp"), key=lambda n: compared[n]["total"])
    assert compared[by_sum]["epsilon_bound"] == 0.0 < compared[said(solution)["chosen"]]["epsilon_bound"]
    assert clench.plan_squeeze(solution, HAND, MUG).feasible
    assert not clench.plan_squeeze(clench.solve(HAND, MUG, command(preshape=by_sum)), HAND, MUG).feasible


def test_the_reason_names_force_closure() -> None:
    texts = [said(clench.solve(HAND, MUG, command(pose)))["text"] for pose in clench.approach_poses(HAND, MUG, 40, 3)]
    assert any(text.endswith("because it alone resists every wrench.") for text in texts)


def test_it_grasps_where_the_open_hand_does_not() -> None:
    opened = [clench.solve(HAND, MUG, command(pose, preshape="open")).status for pose in POSES]
    chosen = [clench.solve(HAND, MUG, command(pose)).status for pose in POSES]
    ranks = [(BEST.index(a), BEST.index(b)) for a, b in zip(chosen, opened, strict=True)]
    assert all(a <= b for a, b in ranks)
    assert any(a < b for a, b in ranks)


def test_the_motion_of_posture_joints_counts() -> None:
    compared = said(clench.solve(HAND, MUG, command()))["compared"]
    for option in posture_options(HAND, command()):
        alone = clench.solve(HAND, MUG, command(preshape=dict(option.angles)))
        closing = sum(f.best.scores["range_of_motion"] for f in alone.fingers.values() if f.best is not None)
        set_apart = sum(abs(option.angles[n] - HAND.joints[HAND.joint_index(n)].open_value) for n in option.angles)
        motion = compared[option.name]["scores"]["range_of_motion"]
        assert motion <= closing + set_apart * len(HAND.joints) + 1e-9
        assert (motion > closing + 1e-3) == (set_apart > 0.0)


def test_of_equal_ones_the_nearest_to_open_is_chosen() -> None:
    far = clench.Pose([0.0, 0.0, 9.0])
    solution = clench.solve(HAND, MUG, command(far))
    assert solution.status == "no_contact"
    assert said(solution)["chosen"] == "open"
    runner_up = said(solution)["compared"][said(solution)["runner_up"]]
    assert runner_up["away"] == min(e["away"] for n, e in said(solution)["compared"].items() if n != "open")
    assert said(solution)["text"].endswith("score the same; open is nearer to the open hand.")


def test_the_choice_says_why() -> None:
    solution = clench.solve(HAND, MUG, command())
    text = said(solution)["text"]
    assert text.startswith(f"{said(solution)['chosen']} leads {said(solution)['runner_up']} by ")
    assert "decided it" in text
    by_status = next(
        s for s in (clench.solve(HAND, MUG, command(pose)) for pose in POSES) if "because it ends as" in said(s)["text"]
    )
    runner_up = said(by_status)["compared"][said(by_status)["runner_up"]]
    assert BEST.index(by_status.status) < BEST.index(runner_up["status"])
    assert solution.timing["total"] > solution.timing["posture"] > 0.0


def test_documents_keep_it(tmp_path) -> None:
    solution = clench.solve(HAND, MUG, command())
    solution.save(tmp_path / "s.json")
    again = clench.GraspSolution.load(tmp_path / "s.json")
    assert said(again) == said(solution)
    assert dict(again.timing) == dict(solution.timing)
    assert said(pickle.loads(pickle.dumps(solution))) == said(solution)


@pytest.mark.parametrize(
    "asked",
    [
        {"preshape": "open"},
        {"preshape": {"thumb_roll": -0.1}},
        {"yaw_grid": (0.0, 0.1)},
        {"opposition_grid": (0.0, 0.1)},
        {"fingers": ("index",)},
        {"fingers": ("ring", "little")},
    ],
    ids=str,
)
def test_commands_without_a_choice(asked: dict[str, Any]) -> None:
    solution = clench.solve(HAND, MUG, command(**asked))
    assert "preshapes" not in (solution.choice or {})
    assert "posture" not in solution.timing
    batch = clench.solve_batch(HAND, MUG, [HELD], command(**asked))
    assert batch.preshape.tolist() == [""]
    assert dict(zip(batch.joint_names, batch.joint_angles[0], strict=True)) == dict(solution.joint_angles)


def test_hands_without_posture_joints_and_whole_postures_have_none() -> None:
    still = clench.Hand.load("patent15")
    assert not posture_options(still, command())
    whole = clench.GraspCommand.from_posture(HAND, HAND.open_angles(), HELD)
    assert not posture_options(HAND, whole)


def test_open_is_one_closing_of_the_open_hand() -> None:
    opened = {name: HAND.joints[HAND.joint_index(name)].open_value for name in posture_joints(HAND)}
    by_name = clench.solve(HAND, MUG, command(preshape="open"))
    by_angles = clench.solve(HAND, MUG, command(preshape=opened))
    assert dict(by_name.joint_angles) == dict(by_angles.joint_angles)
    assert dict(by_name.open_angles) == dict(zip(HAND.joint_names, HAND.open_angles().tolist(), strict=True))


def test_open_values_of_closing_joints_leave_the_choice() -> None:
    solution = clench.solve(HAND, MUG, command(preshape={"ring_proximal": 0.3}))
    assert said(solution)["angles"]["ring_proximal"] == 0.3
    assert solution.open_angles["ring_proximal"] == 0.3


def test_fingers_that_rest_stay_open() -> None:
    asked = command(fingers=("thumb", "middle"))
    for option in posture_options(HAND, asked):
        assert not {name for name in option.angles if not name.startswith(("thumb", "middle"))}
    solution = clench.solve(HAND, MUG, asked)
    assert solution.joint_angles["index_yaw"] == HAND.joints[HAND.joint_index("index_yaw")].open_value


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"full_width": False},
        {"order": clench.ClosingOrder.TOGETHER, "fingers": ("thumb", "index")},
        {"orders": (clench.ClosingOrder.PROXIMAL_FIRST, clench.ClosingOrder.TOGETHER), "fingers": ("thumb", "index")},
        {"criteria": {"range_of_motion": 1.0, "epsilon": 30.0}},
        {"preshape": {"ring_proximal": 0.3}},
    ],
    ids=["usual", "planes", "together", "orders", "epsilon", "closing joint"],
)
def test_batches_and_streams_have_the_bits_of_solves(asked: dict[str, Any], tmp_path) -> None:
    poses = [HELD, *POSES[:2]] if asked else [HELD, *POSES]
    asked_for = command(planes=2, **asked)
    batch = clench.solve_batch(HAND, MUG, poses, asked_for, threads=2, chunk=2, out=tmp_path / "b.npz")
    singles = [clench.solve(HAND, MUG, replace(asked_for, hand_pose=pose)) for pose in poses]
    assert batch.preshape.tolist() == [said(s)["chosen"] for s in singles]
    assert batch.joint_angles.tolist() == [list(s.joint_angles.values()) for s in singles]
    assert batch.status.tolist() == [s.status.value for s in singles]
    assert batch.certified.tolist() == [s.certified for s in singles]
    streamed = [row for part in clench.solve_stream(HAND, MUG, poses, asked_for, chunk=2) for row in part.joint_angles]
    assert np.array_equal(streamed, batch.joint_angles)
    assert batch.solution(1).joint_angles == singles[1].joint_angles
    assert {**batch.solution(1).to_dict(), "timing": {}} == {**singles[1].to_dict(), "timing": {}}
    # The file has the angles that were chosen. Solved again from it, the grasps are the same.
    arrays = np.load(tmp_path / "b.npz")
    for i, single in enumerate(singles):
        angles = dict(zip(arrays["preshape_joints"].tolist(), arrays["preshape_angles"][:, i].tolist(), strict=True))
        assert angles.items() >= said(single)["angles"].items()
    grasps = [s for s in singles if s.status == "grasp"]
    again = list(SavedBatch(tmp_path / "b.npz").solutions(HAND, MUG))
    assert [s.joint_angles for s in again] == [s.joint_angles for s in grasps]


def test_a_batch_goes_on_where_it_ended(tmp_path, monkeypatch) -> None:
    from clench.solver.preshapes.posture_choice import PostureSolver

    whole = clench.solve_batch(HAND, MUG, POSES, chunk=2)
    solve, calls = PostureSolver.solve, []

    def ends(self: Any, *args: Any) -> Any:
        if len(calls) == 2:
            raise KeyboardInterrupt
        calls.append(args)
        return solve(self, *args)

    monkeypatch.setattr(PostureSolver, "solve", ends)
    with pytest.raises(KeyboardInterrupt):
        clench.solve_batch(HAND, MUG, POSES, chunk=2, out=tmp_path / "b.npz")
    calls.clear()
    again = clench.solve_batch(HAND, MUG, POSES, chunk=2, out=tmp_path / "b.npz")
    assert len(calls) == 1
    assert np.array_equal(again.joint_angles, whole.joint_angles)
    assert np.array_equal(again.preshape, whole.preshape)


def test_postures_by_pose_win_over_open() -> None:
    columns = {"ring_proximal": [0.1, 0.2]}
    batch = clench.solve_batch(HAND, MUG, [HELD, HELD], command(preshape="open"), preshapes=columns)
    assert batch.preshape.tolist() == ["", ""]
    chosen = clench.solve_batch(HAND, MUG, [HELD, HELD], command(), preshapes=columns)
    for i in range(2):
        asked = batch.command(i)
        assert asked.angles["ring_proximal"] == columns["ring_proximal"][i]
        assert dict(batch.solution(i).joint_angles) == dict(zip(batch.joint_names, batch.joint_angles[i], strict=True))
        single = clench.solve(HAND, MUG, command(preshape={"ring_proximal": columns["ring_proximal"][i]}))
        assert chosen.preshape[i] == said(single)["chosen"]
        assert chosen.joint_angles[i].tolist() == list(single.joint_angles.values())
        assert list(chosen.solution(i).joint_angles.values()) == chosen.joint_angles[i].tolist()


def test_settling_a_named_posture_leaves_the_reasons_for_the_candidates_unread() -> None:
    """For these reasons, clench would close all sets on planes."""
    asked = command(preshape="open")
    solution = clench.solve(HAND, MUG, asked)
    assert settled(asked, solution) == asked
    assert posture_reason(solution) is None
    assert isinstance(solution.choice, DeferredMapping)
    assert not solution.choice.is_made
    assert solution.choice["criteria"]
    assert posture_reason(solution) is None
    free = clench.solve(HAND, MUG, command())
    assert posture_reason(free) == said(free)


def test_trackers_and_pose_errors_keep_the_first_choice() -> None:
    first = clench.solve(HAND, MUG, command(planes=1))
    kept = settled(command(planes=1), first)
    assert kept.preshape == said(first)["angles"]
    tracker = clench.Tracker(HAND, MUG, command(planes=1))
    report = clench.pose_error(HAND, MUG, command(planes=1), 0.004, 0.05, solution=first)
    posture = [HAND.joint_index(name) for name in posture_joints(HAND)]
    assert all((corner.change[posture] == 0.0).all() for corner in report.corners)
    choices = set()
    for step in range(5):
        pose = clench.Pose([0.0, 0.004 * step, 0.0], MUG.pose.wxyz)
        there = clench.solve(HAND, MUG, command(planes=1, object_pose=pose))
        choices.add(said(there)["chosen"])
        answer = tracker.update(object_pose=pose)
        assert answer.joint_angles[0].tolist() == list(
            clench.solve(HAND, MUG, replace(kept, object_pose=pose)).joint_angles.values()
        )
        assert answer.joint_angles[0, posture].tolist() == [first.joint_angles[HAND.joint_names[j]] for j in posture]
    assert len(choices) > 1, "nothing would have jumped"


def test_preshapes_by_name_in_commands_and_files(tmp_path) -> None:
    shape = opposition_zones(HAND)[3]
    for name in ("open", shape.name):
        asked = command_from_dict(json.loads(json.dumps(command_to_dict(command(preshape=name)))))
        assert asked.preshape == name
    solution = clench.solve(HAND, MUG, command(preshape=shape.name))
    assert all(solution.open_angles[joint] == angle for joint, angle in shape.angles.items())
    batch = clench.solve_batch(HAND, MUG, [HELD], command(preshape=shape.name))
    assert batch.joint_angles[0].tolist() == list(solution.joint_angles.values())
    with pytest.raises(clench.UnknownNameError, match=r"Preshape 'pinch-13mm' is not in hand 'robonaut2'\. Did you"):
        clench.solve(HAND, MUG, command(preshape="pinch-13mm"))
    with pytest.raises(clench.CommandError, match=r"preshape: expected an object of names with a number in rad each"):
        clench.solve(HAND, MUG, command(preshape=3))


@pytest.mark.shared
@pytest.mark.parametrize("model", ["allegro_urdf/allegro_hand_right.urdf", "leap_hand_urdf/leap_hand_right.urdf"])
def test_hands_of_makers_grasp_more_often(shared_data, model) -> None:
    hand, box = clench.Hand.load(shared_data / "hands" / model), clench.GraspObject.load("box:x=0.05,y=0.05,z=0.12")
    poses = clench.approach_poses(hand, box, 24, 1)
    opened = clench.solve_batch(hand, box, poses, command(preshape="open"))
    chosen = clench.solve_batch(hand, box, poses, command())
    assert chosen.counts()["grasp"] > opened.counts()["grasp"]
    assert len(set(chosen.preshape.tolist())) > 1
    first = clench.solve(hand, box, command(poses[0]))
    assert said(first)["chosen"] == chosen.preshape[0]
