"""A tracker: every answer as true as a fresh solve, and no hopping between planes that are about as good."""

from __future__ import annotations

import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

import clench
from clench.core.exceptions import CommandError
from clench.core.pose import Pose

HAND = clench.Hand.load("patent15")
BALL = clench.GraspObject.load("ball")
START = clench.approach_poses(HAND, BALL, 1, 0)[0]


def moved(k: int) -> Pose:
    return Pose(BALL.pose.position + 0.0004 * k * np.array([1.0, -0.5, 0.3]))


def test_the_bits_of_fresh_solves() -> None:
    command = clench.GraspCommand(hand_pose=START, planes=3, preshape="open")
    tracker = clench.Tracker(HAND, BALL, command)
    for k in range(5):
        answer = tracker.update(object_pose=moved(k))
        fresh = clench.solve(HAND, BALL, replace(command, object_pose=moved(k)))
        assert answer.joint_angles[0].tolist() == list(fresh.joint_angles.values())
        assert (answer.status[0], answer.certified[0]) == (fresh.status, fresh.certified)
        assert answer.solution(0).joint_angles == fresh.joint_angles
    wrist = Pose(START.position + np.array([0.0, 0.001, 0.0]), START.wxyz)
    answer = tracker.update(hand_pose=wrist)  # the object stays where it was
    fresh = clench.solve(HAND, BALL, replace(command, hand_pose=wrist, object_pose=moved(4)))
    assert answer.joint_angles[0].tolist() == list(fresh.joint_angles.values())
    again = tracker.update()
    np.testing.assert_array_equal(again.joint_angles, answer.joint_angles)


@pytest.mark.parametrize("full_width", [True, False])
def test_contacts_are_those_of_a_batch_whenever_they_are_read(full_width: bool) -> None:
    command = clench.GraspCommand(hand_pose=START, planes=3, full_width=full_width, preshape="open")
    tracker = clench.Tracker(HAND, BALL, command, margin=0.0)
    answers = [tracker.update(object_pose=moved(k)) for k in range(3)]
    copied = pickle.loads(pickle.dumps(answers[0]))
    later = tracker.update(object_pose=moved(0))
    later.hand_poses[0, 4:] += 1.0
    np.testing.assert_array_equal(later.contacts.position, copied.contacts.position)
    for k, answer in enumerate([*answers, copied]):
        batch = clench.solve_batch(HAND, BALL, [START], command=command, object_poses=[moved(k % 3)])
        assert len(batch.contacts.link) > 0
        for one, other in ((answer, batch), (answer.contacts, batch.contacts)):
            for f in fields(other):
                if f.name not in ("question", "contacts"):
                    np.testing.assert_array_equal(getattr(one, f.name), getattr(other, f.name), err_msg=f.name)
    with pytest.raises(AttributeError, match="has no attribute 'contact'"):
        answers[0].contact  # noqa: B018


def trembling(k: int) -> Pose:
    return Pose(BALL.pose.position + np.array([0.0005 * (k % 2), 0.0, 0.0]))


def test_a_finger_stays_on_its_plane_unless_another_is_clearly_better() -> None:
    command = clench.GraspCommand(hand_pose=START, planes=5, full_width=False, preshape="open")
    changes = {}
    for margin in (0.0, 0.02, 1e9):
        tracker = clench.Tracker(HAND, BALL, command, margin=margin)
        planes = []
        for k in range(6):
            answer = tracker.update(object_pose=trembling(k))
            fresh = clench.solve(HAND, BALL, replace(command, object_pose=trembling(k)))
            for f, name in enumerate(answer.finger_names):
                finger = fresh.fingers[name]
                best = finger.candidates[finger.chosen]
                taken = next(c for c in finger.candidates if c.plane == answer.planes[0, f])
                # Whatever the plane, its angles are those that a fresh solve has for it.
                own = [answer.joint_names.index(joint) for joint in taken.joint_angles]
                assert answer.joint_angles[0, own].tolist() == list(taken.joint_angles.values())
                if margin == 0.0:
                    assert taken is best
                elif k and taken is not best and any(not c.passed for c in best.contacts):
                    assert taken.plane == planes[-1][f]
                    assert worth(best) - worth(taken) <= margin + 1e-9
            planes.append(answer.planes[0].tolist())
        changes[margin] = int((np.diff(planes, axis=0) != 0).sum())
    assert changes[0.0] > changes[0.02] >= changes[1e9]


def worth(candidate: clench.Candidate) -> float:
    scores = candidate.scores  # weights and scales of the preset `balanced`
    return -scores["range_of_motion"] + scores["touching_links"] + 0.2 * scores["limit_distance"] / 0.5


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"orders": ("proximal-first", "together")}, "expected a command with one closing order"),
        ({"yaw_grid": (0.0, 0.1), "open_variants": (0.1,)}, "and one open posture per finger"),
        ({"criteria": "steady", "full_width": False}, "criteria that are range_of_motion"),
    ],
)
def test_what_is_not_tracked_is_said(asked: dict[str, object], sentence: str) -> None:
    with pytest.raises(CommandError, match=sentence):
        clench.Tracker(HAND, BALL, clench.GraspCommand(hand_pose=START, planes=1, **{"preshape": "open", **asked}))  # type: ignore[arg-type]


def test_bad_numbers() -> None:
    command = clench.GraspCommand(hand_pose=START, planes=1, preshape="open")
    with pytest.raises(CommandError, match="margin: expected a finite number of at least 0, got -1"):
        clench.Tracker(HAND, BALL, command, margin=-1)
    with pytest.raises(CommandError, match=r"object_pose: expected a clench\.Pose, got list"):
        clench.Tracker(HAND, BALL, command).update(object_pose=[0, 0, 0])  # type: ignore[arg-type]


@pytest.mark.parametrize("asked", [{"order": clench.ClosingOrder.TOGETHER}, {"rounds": 2}], ids=str)
def test_other_orders_are_tracked_with_the_bits_of_a_solve(asked: dict[str, object]) -> None:
    command = clench.GraspCommand(hand_pose=START, planes=1, **{"preshape": "open", **asked})  # type: ignore[arg-type]
    answer = clench.Tracker(HAND, BALL, command).update()
    solution = clench.solve(HAND, BALL, command)
    assert answer.joint_angles[0].tolist() == list(solution.joint_angles.values())
    assert answer.status[0] == solution.status
    assert len(answer.contacts) == len(solution.contacts) > 0
