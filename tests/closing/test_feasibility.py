"""Which alternative sets a rigid hand could take: what is known without measuring, and what measuring finds."""

from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.closing.candidates import FingerCandidate
from clench.closing.collision.packed_object import pack_object
from clench.closing.feasibility import judge_candidates
from clench.closing.finger_plan import plan_finger
from clench.core.pose import Pose
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.shapes import CollisionSource
from small_chain import CLOSING, chain

HAND = chain([CLOSING], upper=2.0)
PLAN = plan_finger(HAND, HAND.fingers[0], np.zeros(1), 3, CollisionSource.ENGINE)
WALL = clench.GraspObject.load("box:x=0.02,y=0.1,z=0.02", pose=Pose([0.02, 0.0, 0.03]))


def at(travel, plane=None):
    travel = np.array([travel])
    return FingerCandidate(PLAN, 0, plane, travel, PLAN.angles(HAND, travel), (), None)


def judge(candidates, *, measure, hand=HAND, obj=WALL):
    judge_candidates(hand, candidates, pack_object(obj), obj.pose.matrix, CollisionSource.ENGINE, measure)
    return candidates


def first_touch():
    corner = np.array([0.03, 0.02])
    return float(np.arctan2(corner[1], corner[0]) - np.arcsin(0.006 / np.hypot(*corner)))


def test_without_measuring_only_equality_with_the_full_width_is_known():
    judged = judge([at(0.3, 0), at(0.4, 1), at(0.3)], measure=False)
    assert [c.clear for c in judged] == [True, False, True]
    assert all(c.penetration is None for c in judged)


def test_measuring_finds_how_deep_the_path_goes():
    touch = first_touch()
    judged = judge([at(touch, 0), at(touch + 0.05, 1), at(touch - 1e-4)], measure=True)
    assert [c.feasible for c in judged] == [True, False, True]
    corner = np.array([0.03, 0.02])
    turned = touch + 0.05
    above = -np.sin(turned) * corner[0] + np.cos(turned) * corner[1]
    assert judged[1].penetration == pytest.approx(0.006 - above, abs=3e-5)


def test_a_path_that_passes_through_is_infeasible_though_its_end_is_free():
    bead = clench.GraspObject.load("sphere:r=0.002", pose=Pose([0.03, 0.0, 0.02]))
    (judged,) = judge([at(1.9)], measure=True, obj=bead)
    assert judged.feasible is False
    assert judged.penetration > 1e-3


@pytest.mark.parametrize(("together", "feasible"), [(False, False), (True, True)])
def test_the_path_is_that_of_the_order(together, feasible):
    """A bead beyond the tip of the straight finger: joint after joint sweeps over it, all at once curls in before."""
    hand = chain([CLOSING, CLOSING])
    plan = plan_finger(hand, hand.fingers[0], np.zeros(2), 3, CollisionSource.ENGINE)
    travel = np.array([1.4, 1.4])
    candidate = FingerCandidate(plan, 0, None, travel, plan.angles(hand, travel), (), None)
    bead = clench.GraspObject.load("sphere:r=0.002", pose=Pose([0.087 * np.cos(1.2), 0.0, 0.087 * np.sin(1.2)]))
    packed, place = pack_object(bead), bead.pose.matrix
    judge_candidates(hand, [candidate], packed, place, CollisionSource.ENGINE, True, together)
    assert candidate.feasible is feasible


def test_pads_may_be_indented():
    touch = first_touch()
    padded = replace(HAND, links=(HAND.links[0], replace(HAND.links[1], pad_indentation=0.001)))
    for depth_angle, feasible in ((0.015, True), (0.05, False)):
        (judged,) = judge([at(touch + depth_angle)], measure=True, hand=padded)
        assert judged.feasible is feasible
    (rigid,) = judge([at(touch + 0.015)], measure=True)
    assert rigid.feasible is False


def test_joints_that_close_at_once_may_pass_through_something_on_the_way():
    """The bead lies on the second link when both joints are half closed; the end is far from it."""
    hand = chain([CLOSING, CLOSING])
    plan = plan_finger(hand, hand.fingers[0], np.zeros(2), 3, CollisionSource.ENGINE)
    travel = np.array([1.4, 1.4])
    candidate = FingerCandidate(plan, 0, None, travel, plan.angles(hand, travel), (), None)
    place = 0.04 * np.array([np.cos(0.7), 0.0, np.sin(0.7)]) + 0.02 * np.array([np.cos(1.4), 0.0, np.sin(1.4)])
    bead = clench.GraspObject.load("sphere:r=0.002", pose=Pose(place))
    judge_candidates(hand, [candidate], pack_object(bead), bead.pose.matrix, CollisionSource.ENGINE, True, True)
    assert candidate.feasible is False
    assert candidate.penetration == pytest.approx(0.006, abs=1e-4)


def test_a_path_is_looked_at_at_the_speeds_of_its_joints():
    """The first joint closes twice as fast; the bead lies on the second link after nine of sixteen equal times."""
    hand = chain([CLOSING, CLOSING])
    plan = replace(plan_finger(hand, hand.fingers[0], np.zeros(2), 3, CollisionSource.ENGINE), speeds=(2.0, 1.0))
    travel = np.array([1.4, 0.7])
    candidate = FingerCandidate(plan, 0, None, travel, plan.angles(hand, travel), (), None)
    first, second = 9 / 16 * travel[0], 9 / 16 * travel.sum()
    place = 0.04 * np.array([np.cos(first), 0.0, np.sin(first)])
    place += 0.03 * np.array([np.cos(second), 0.0, np.sin(second)])
    bead = clench.GraspObject.load("sphere:r=0.002", pose=Pose(place))
    judge_candidates(hand, [candidate], pack_object(bead), bead.pose.matrix, CollisionSource.ENGINE, True, True)
    assert candidate.penetration == pytest.approx(0.006, abs=1e-4)


def test_a_joint_that_is_stopped_stays_while_the_others_close_on():
    """The bead lies where the first link would be if it went on with the second one."""
    hand = chain([CLOSING, CLOSING])
    plan = plan_finger(hand, hand.fingers[0], np.zeros(2), 3, CollisionSource.ENGINE)
    travel = np.array([0.3, 1.4])
    candidate = FingerCandidate(plan, 0, None, travel, plan.angles(hand, travel), (), None)
    bead = clench.GraspObject.load("sphere:r=0.002", pose=Pose([0.02 * np.cos(1.0), 0.0, 0.02 * np.sin(1.0)]))
    judge_candidates(hand, [candidate], pack_object(bead), bead.pose.matrix, CollisionSource.ENGINE, True, True)
    assert candidate.feasible is True


def test_a_candidate_that_was_swept_over_the_whole_width_needs_no_measuring():
    (judged,) = judge([replace(at(1.9), swept=True)], measure=True)
    assert (judged.clear, judged.feasible, judged.penetration) == (True, True, 0.0)


def test_a_little_more_than_is_allowed_is_infeasible():
    touch = first_touch()
    for share, feasible in ((0.5, True), (1.5, False)):
        (judged,) = judge([at(touch + share * ALLOWED_PENETRATION / np.hypot(0.03, 0.02))], measure=True)
        assert judged.feasible is feasible
