"""The kind of a solution: its contacts as they count, and the palm where the object is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.mechanics.grasp.contact_kinds import KINDS, contact_kinds
from clench.models.objects.obstacles import obstacle
from clench.solver.analysis.grasp_kinds import PALM_NEAR


@pytest.fixture(scope="module")
def hand() -> clench.Hand:
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="module")
def ball() -> clench.GraspObject:
    return clench.GraspObject.load("ball")


@pytest.fixture(scope="module")
def grasp(hand: clench.Hand, ball: clench.GraspObject) -> clench.GraspSolution:
    """Return a grasp of the ball in which the palm does not touch."""
    (pose,) = clench.approach_poses(hand, ball, 5, 1)[4:]
    return clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose))


def with_links(
    solution: clench.GraspSolution, hand: clench.Hand, fingers: dict[str, int], **changes: object
) -> clench.GraspSolution:
    """Return a solution that touches with one link of some fingers, counted from the tip."""
    one = solution.contacts[0]
    contacts = []
    for name, back in fingers.items():
        links = hand.finger(name).links
        link = hand.links[links[links.index(hand.finger(name).tip_link) - back]].name
        contacts.append(replace(one, finger=name, link=link, **changes))  # type: ignore[arg-type]
    return replace(solution, contacts=tuple(contacts))


def test_tips_only(hand: clench.Hand, grasp: clench.GraspSolution) -> None:
    names = [finger.name for finger in hand.fingers]
    kinds = [clench.grasp_kind(with_links(grasp, hand, dict.fromkeys(names[:n], 0)), hand) for n in range(6)]
    assert kinds == [None, None, "pinch", "tripod", "precision", "precision"]
    assert clench.grasp_kind(with_links(grasp, hand, {"index": 0, "thumb": 1}), hand) is clench.GraspKind.POWER


def test_a_contact_that_opened_again_does_not_count(hand: clench.Hand, grasp: clench.GraspSolution) -> None:
    tips = with_links(grasp, hand, {"index": 0, "thumb": 0})
    passed = with_links(grasp, hand, {"index": 1}, passed=True)
    both = replace(grasp, contacts=(*tips.contacts, *passed.contacts))
    assert clench.grasp_kind(both, hand) == "pinch"


def test_obstacles_count_only_when_the_object_is_unknown(
    hand: clench.Hand, ball: clench.GraspObject, grasp: clench.GraspSolution
) -> None:
    tips = with_links(grasp, hand, {"index": 0, "thumb": 0}, body="ball")
    leaning = with_links(grasp, hand, {"middle": 0}, body="wall")
    both = replace(grasp, contacts=(*tips.contacts, *leaning.contacts))
    wall = obstacle("box:x=0.1,y=0.1,z=0.1", clench.Pose([0.0, 0.0, 5.0]), name="wall")
    assert clench.grasp_kind(both, hand, ball.with_body(wall)) == "pinch"
    assert clench.grasp_kind(both, hand) == "tripod"


def test_the_palm_touches_when_it_is_near_the_object(
    hand: clench.Hand, ball: clench.GraspObject, grasp: clench.GraspSolution
) -> None:
    """The ball is moved along the palm's normal until it is just nearer, or farther, than what counts."""
    tips = with_links(grasp, hand, {"index": 0, "thumb": 0}, body="ball")
    normal = grasp.hand_pose.rotation @ hand.palm_normal

    def placed(out: float) -> clench.GraspSolution:
        moved = clench.Pose(grasp.object_pose.position + out * normal, grasp.object_pose.wxyz)
        return replace(tips, object_pose=moved)

    def near(out: float) -> bool:
        return clench.grasp_kind(placed(out), hand, ball) == "power"

    far, close = 0.1, -0.1
    assert not near(far)
    steps = [out for out in np.linspace(far, close, 201) if near(out)]
    assert steps
    edge = max(steps)
    assert not near(edge + 0.001 + PALM_NEAR)
    assert clench.grasp_kind(placed(edge), hand) == "pinch"


def test_a_batch_has_the_kinds_of_its_solutions(hand: clench.Hand) -> None:
    small = clench.GraspObject.load("sphere:r=0.02")
    poses = clench.approach_poses(hand, small, 12, 1)
    command = clench.GraspCommand(hand_pose=poses[0], order="fingertip")
    batch = clench.solve_batch(hand, small, poses, command)
    links = np.array([hand.link_index(name) for name in batch.link_names])[batch.contacts.link]
    codes = contact_kinds(hand, batch.contacts.first, links, ~batch.contacts.passed)
    kinds = [clench.grasp_kind(batch.solution(i), hand) for i in range(len(poses))]
    assert [None if code < 0 else KINDS[code] for code in codes] == kinds
    assert len(set(kinds)) > 2


def test_a_solution_of_another_hand_is_refused(solution: clench.GraspSolution, hand: clench.Hand) -> None:
    with pytest.raises(clench.CommandError, match="joint_angles: the solution does not fit hand 'robonaut2'"):
        clench.grasp_kind(solution, hand)
