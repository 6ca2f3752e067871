"""The pregrasp: a clearance along the closing path; and solutions completed for their documents."""

from __future__ import annotations

import json

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main
from clench.closing.collision.packed_object import pack_object
from clench.closing.collision.reach import nearest_link
from clench.core.exceptions import CommandError
from clench.core.pose import invert
from clench.models.shapes import CollisionSource


@pytest.fixture(scope="module")
def grip():
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    pose = clench.approach_poses(hand, ball, 1, 1)[0]
    return hand, ball, clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))


def gaps(hand, ball, solution, angles) -> dict[str, float]:
    q = np.array([angles[name] for name in hand.joint_names])
    T = invert(solution.hand_pose.matrix) @ solution.object_pose.matrix
    body, source = pack_object(ball).bodies, CollisionSource(solution.collision_source)
    return {f.name: nearest_link(hand, q, f.links, source, body, T)[0] for f in hand.fingers}


def least_lift(hand, solution, angles, finger: str) -> float:
    """How far the touching points of a finger came off the tangent planes, from the poses of its links."""
    before, after = (
        hand.link_poses(np.array([a[name] for name in hand.joint_names])) for a in (solution.joint_angles, angles)
    )
    lifts = []
    for c in solution.contacts:
        if c.finger == finger and not c.passed:
            link = hand.link_index(c.link)
            T = solution.hand_pose.matrix @ after[link] @ invert(before[link]) @ invert(solution.hand_pose.matrix)
            lifts.append((T @ np.append(c.position, 1.0))[:3] @ c.normal - c.position @ c.normal)
    return min(lifts)


@pytest.mark.parametrize("clearance", [0.001, 0.005])
def test_touching_fingers_stand_off_by_the_clearance(grip, clearance: float) -> None:
    hand, ball, solution = grip
    touching = {c.finger for c in solution.contacts if not c.passed}
    assert touching
    before, after = solution.joint_angles, clench.plan_pregrasp(solution, hand, clearance=clearance)
    at_touch, off = gaps(hand, ball, solution, before), gaps(hand, ball, solution, after)
    for finger in hand.fingers:
        own = [hand.joints[j].name for j in finger.joints]
        if finger.name not in touching:
            assert [after[n] for n in own] == [before[n] for n in own]
            continue
        assert at_touch[finger.name] < 1e-8
        assert off[finger.name] > 0.5 * clearance
        assert least_lift(hand, solution, after, finger.name) == pytest.approx(clearance, abs=1e-8)
        # Backed off: every joint lies between the open and the closed angle.
        for n in own:
            low, high = sorted((solution.open_angles[n], before[n]))
            assert low - 1e-12 <= after[n] <= high + 1e-12


def test_a_finger_that_cannot_get_so_far_opens_as_far_as_it_may(grip) -> None:
    hand, _, solution = grip
    after = clench.plan_pregrasp(solution, hand, clearance=10.0)
    touching = {c.finger for c in solution.contacts if not c.passed}
    for finger in hand.fingers:
        expected = solution.open_angles if finger.name in touching else solution.joint_angles
        for j in finger.joints:
            assert after[hand.joints[j].name] == pytest.approx(expected[hand.joints[j].name], abs=1e-12)


def test_a_completed_solution_is_read_back_equal(grip, tmp_path) -> None:
    hand, ball, solution = grip
    full = clench.complete(solution, hand, ball, mass=0.1, friction=0.7)
    assert full.quality["actuation"]["mass"] == full.squeeze["mass"] == 0.1
    assert set(full.quality["friction"]) == {0.7}
    assert set(full.pregrasp) == set(hand.joint_names)
    assert full.is_valid() == solution.is_valid()
    full.save(tmp_path / "full.json")
    assert clench.GraspSolution.load(tmp_path / "full.json") == full


def test_with_the_object_it_is_the_trajectorys_own(grip) -> None:
    hand, ball, solution = grip
    found = clench.plan_pregrasp(solution, hand, obj=ball, clearance=0.004)
    trajectory = clench.plan_trajectory(solution, hand, obj=ball, clearance=0.004)
    assert trajectory.pregrasp is not None
    assert list(found.values()) == trajectory.positions[trajectory.pregrasp].tolist()
    touching = {c.finger for c in solution.contacts if not c.passed}
    off = gaps(hand, ball, solution, found)
    assert all(0.5 * 0.004 < off[name] < 2.0 * 0.004 for name in touching)
    assert clench.complete(solution, hand, ball).pregrasp == clench.plan_pregrasp(solution, hand, obj=ball)


def test_bad_clearance_is_refused(grip) -> None:
    for clearance in (0.0, -0.001, np.nan):
        with pytest.raises(CommandError, match=r"clearance: expected a finite number above 0 m"):
            clench.plan_pregrasp(grip[2], grip[0], clearance=clearance)


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    code = main(["solve", "--hand", "robonaut2", "--object", "sphere:r=0.03", "--seed", "1", *arguments])
    return (code, *capsys.readouterr())


def test_the_document_of_the_command_line_is_complete(capsys) -> None:
    code, out, _ = run(capsys, "--json", "--mass", "0.15", "--friction", "0.9")
    document = json.loads(out)
    assert code == 0
    assert document["quality"]["epsilon"] > 0.0
    assert document["squeeze"]["mass"] == 0.15
    assert document["squeeze"]["friction"][0] == 0.9
    assert len(document["squeeze"]["forces"]) == len(document["squeeze"]["contacts"])
    assert document["pregrasp"].keys() == document["joint_angles"].keys()


def test_forces_are_printed(capsys) -> None:
    _, out, _ = run(capsys, "--forces", "--friction", "0.8")
    assert "force closure: epsilon 0." in out
    assert "Holds 0.1 kg under gravity" in out
    assert "thumb_proximal" in out


@pytest.mark.parametrize(("option", "value"), [("--mass", "-1"), ("--friction", "0"), ("--mass", "nan")])
def test_bad_numbers_end_with_one_sentence(capsys, option: str, value: str) -> None:
    code, out, err = run(capsys, "--json", option, value)
    assert code == 2
    assert err.startswith(f"clench: error: {option}: expected a finite number")
    assert err == f"clench: error: {json.loads(out)['error']}\n"
