"""The last piece of the way: all contacts of all fingers at once, slowly, and clear of the object before."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x
from clench.closing.collision.packed_object import pack_object
from clench.closing.collision.path_check import find_path_overlap
from clench.closing.collision.reach import nearest_link
from clench.core.pose import FloatArray, Pose, invert
from clench.execution.landing import LANDING_SPEED, plan_landing
from clench.execution.step_check import placed_object
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

CLEARANCE = 0.005
Grip = tuple[Hand, GraspObject, GraspSolution]


@pytest.fixture(scope="module")
def grip() -> Grip:
    """A grasp in which index and middle finger touch with two links each."""
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball", collision_source="engine")
    pose = clench.approach_poses(hand, ball, 5, 1)[4]
    return hand, ball, clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))


def gap_of(grip: Grip, link: str, q: FloatArray) -> float:
    """Exact distance of one link from the object."""
    hand, ball, solution = grip
    T = invert(solution.hand_pose.matrix) @ solution.object_pose.matrix
    number = (hand.link_index(link),)
    bodies = pack_object(ball).bodies
    return nearest_link(hand, q, number, CollisionSource(solution.collision_source), bodies, T)[0]


def touching(solution: GraspSolution) -> list[str]:
    return sorted({c.link for c in solution.contacts if not c.passed})


def touch(grip: Grip) -> FloatArray:
    return np.array(list(grip[2].joint_angles.values()))


def test_every_touching_link_comes_near_at_the_same_speed(grip: Grip) -> None:
    """Near the touch, gaps by exact distance queries grow alike, per finger several links too."""
    hand, _, solution = grip
    landing = plan_landing(solution, hand, CLEARANCE)
    assert landing is not None
    step = 0.01
    q = touch(grip) + step * (landing - touch(grip))
    found = {link: gap_of(grip, link, q) for link in touching(solution)}
    assert len(found) == 7
    np.testing.assert_allclose(list(found.values()), step * CLEARANCE, rtol=0.02)


def test_joints_stay_inside_their_limits_and_coupled(grip: Grip) -> None:
    hand, _, solution = grip
    landing = plan_landing(solution, hand, CLEARANCE)
    assert landing is not None
    for joint, angle in zip(hand.joints, landing, strict=True):
        assert joint.lower - 1e-12 <= angle <= joint.upper + 1e-12
    for c in hand.couplings:
        limits = hand.joints[c.follower].lower, hand.joints[c.follower].upper
        assert landing[c.follower] == pytest.approx(np.clip(c.ratio * landing[c.leader] + c.offset, *limits))


def test_the_trajectory_lands_slowly_and_nothing_is_near_before(grip: Grip) -> None:
    hand, ball, solution = grip
    trajectory = plan_trajectory(solution, hand, obj=ball)
    assert trajectory.pregrasp is not None
    np.testing.assert_array_equal(trajectory.positions[-1], touch(grip))
    links = touching(solution)
    before = [min(gap_of(grip, link, q) for link in links) for q in trajectory.positions[: trajectory.pregrasp + 1]]
    assert min(before) > 0.5 * CLEARANCE
    landing = range(trajectory.pregrasp, len(trajectory.times))
    gaps = np.array([[gap_of(grip, link, trajectory.positions[k]) for link in links] for k in landing])
    speed = -np.diff(gaps, axis=0) / np.diff(trajectory.times[list(landing)])[:, None]
    assert speed.max() < 1.5 * LANDING_SPEED
    assert speed[-1].max() < LANDING_SPEED
    # Near the touch all gaps are alike; farther off, links turn.
    near = gaps[gaps.min(axis=1) < 1e-3]
    assert len(near) > 3
    assert (near.max(axis=1) < 1.1 * near.min(axis=1) + 1e-6).all()


def test_the_file_keeps_the_pregrasp(grip: Grip, tmp_path: Path) -> None:
    hand, ball, solution = grip
    trajectory = plan_trajectory(solution, hand, obj=ball)
    document = trajectory.to_dict()
    assert trajectory.pregrasp is not None
    phases = [point["phase"] for point in document["points"]]
    assert phases[trajectory.pregrasp] == "pregrasp"
    assert phases[-1] == "touch"
    assert list(document["pregrasp"].values()) == trajectory.positions[trajectory.pregrasp].tolist()
    trajectory.save(tmp_path / "t.json")
    assert Trajectory.load(tmp_path / "t.json").to_dict() == document


def test_a_path_through_the_object_is_not_clear(grip: Grip) -> None:
    hand, ball, solution = grip
    q, source = touch(grip), CollisionSource(solution.collision_source)
    opened = np.array(list(solution.open_angles.values()))
    deeper = q + 0.05 * (q - opened)

    def overlaps(*path: FloatArray) -> bool:
        found = find_path_overlap(hand, np.array(path), source, placed_object(solution, ball))
        return found is not None and found.with_object

    assert not overlaps(q, q)
    assert overlaps(q, deeper)
    assert overlaps(opened, deeper, opened)


def test_a_joint_without_room_to_open(grip: Grip) -> None:
    """A finger whose joints stand at the limits behind them cannot be taken off."""
    hand, _, solution = grip
    joints = tuple(replace(j, lower=a, upper=a) for j, a in zip(hand.joints, touch(grip), strict=True))
    assert plan_landing(solution, replace(hand, joints=joints), CLEARANCE) is None


def coupled_grip(upper: float, *, breakaway: bool) -> tuple[Hand, GraspSolution]:
    """Return a finger whose first link touches a bar at 0.307 rad; the second joint follows up to a limit."""
    builder = HandBuilder().finger("index", [along_x(0.006, 0.05), along_x(0.006, 0.04)], [0.05, 0.04], upper=1.5)
    hand = builder.couple("index_0", "index_1", 1.0, breakaway=breakaway).hand()
    hand = replace(hand, joints=(hand.joints[0], replace(hand.joints[1], upper=upper)))
    half = np.sqrt(0.5)
    bar = GraspObject.load("cylinder:r=0.004,h=0.1", pose=Pose([0.03, 0.0, 0.02], wxyz=[half, half, 0, 0]))
    return hand, clench.solve(hand, bar, clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open"))


def test_a_follower_that_has_broken_away_does_not_land_on_a_straight_line() -> None:
    """It would first have to wait for its leader to come to where it is."""
    hand, solution = coupled_grip(1.5, breakaway=True)
    assert solution.joint_angles["index_1"] > solution.joint_angles["index_0"] + 1.0
    assert plan_landing(solution, hand, CLEARANCE) is None


def test_a_follower_that_has_broken_away_stays_where_nothing_moves_it() -> None:
    hand, solution = coupled_grip(1.5, breakaway=True)
    landing = plan_landing(replace(solution, contacts=()), hand, CLEARANCE)
    assert landing is not None
    np.testing.assert_array_equal(landing, list(solution.joint_angles.values()))


def test_a_follower_at_its_limit_waits_only_while_its_leader_is_beyond() -> None:
    """The leader is 0.107 rad beyond the follower's limit: enough for 3 mm, and too little for 5 mm."""
    hand, solution = coupled_grip(0.2, breakaway=False)
    assert list(solution.joint_angles.values()) == pytest.approx([0.307, 0.2], abs=1e-4)
    landing = plan_landing(solution, hand, 0.003)
    assert landing is not None
    assert 0.2 < landing[0] < 0.24
    assert landing[1] == 0.2
    assert plan_landing(solution, hand, 0.005) is None
