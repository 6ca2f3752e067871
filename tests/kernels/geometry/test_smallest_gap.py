"""Where fingers that move at once first meet: closed forms, dense stepping and what is left out."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, turned
from clench.closing.link_bodies import hand_bodies
from clench.core.pose import Pose
from clench.kernels.geometry.smallest_gap import link_gap
from clench.models.shapes import CollisionSource

ENGINE = CollisionSource.ENGINE
SHAPES, LENGTHS = [along_x(0.006, 0.04), along_x(0.006, 0.03)], [0.04, 0.03]
FAR = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0.0, 0.0]))


def two_fingers(base: np.ndarray, rotation: np.ndarray | None = None) -> clench.Hand:
    builder = HandBuilder().finger("index", SHAPES, LENGTHS, upper=2.0)
    return builder.finger("thumb", SHAPES, LENGTHS, base=mount(base, rotation), upper=2.0, thumb=True).hand()


def crossing_fingers(seed: int) -> clench.Hand:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    rotation = turned(axis / np.linalg.norm(axis), float(rng.uniform(2.0, 4.0)))
    return two_fingers(rng.uniform([0.04, -0.01, 0.0], [0.09, 0.01, 0.04]), rotation)


def close(hand: clench.Hand, obj: clench.GraspObject = FAR, **changes) -> clench.GraspSolution:
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=1, order="together", preshape="open", **changes)
    return clench.solve(hand, obj, command)


def stepped_until_they_meet(hand: clench.Hand, step: float) -> float | None:
    """Return the turn of all joints at which links of different fingers are first nearer than a few steps' motion."""
    bodies, out = hand_bodies(hand, ENGINE), np.empty(6)
    pairs = [(m, r) for m in hand.fingers[0].links for r in hand.fingers[1].links]
    for turn in np.arange(0.0, 2.0, step):
        poses = np.ascontiguousarray(hand.link_poses(np.full(4, turn))[:, :3])
        if min(link_gap(bodies.links, m, r, poses, 1.0, 1.0, out) for m, r in pairs) < 1e-6:
            return float(turn)
    return None


def test_fingers_side_by_side_never_meet():
    solution = close(two_fingers([0.0, 0.013, 0.0]))
    assert list(solution.joint_angles.values()) == pytest.approx([2.0] * 4)


@pytest.mark.parametrize("seed", range(6))
def test_fingers_are_held_where_dense_steps_first_find_them_together(seed):
    hand, step = crossing_fingers(seed), 2e-3
    solution = close(hand)
    found = stepped_until_they_meet(hand, step)
    first = min(solution.joint_angles.values())
    if found == 0.0:
        assert not solution.certified
    elif found is None:
        assert first == 2.0
    else:
        assert solution.certified
        assert found - 2.0 * step < first <= found


def test_a_meeting_leaves_a_gap_of_a_hundredth_of_a_nanometre_at_most():
    hand = crossing_fingers(1)
    solution = close(hand)
    bodies, q = hand_bodies(hand, ENGINE), np.array(list(solution.joint_angles.values()))
    poses = np.ascontiguousarray(hand.link_poses(q)[:, :3])
    pairs = [(m, r) for m in hand.fingers[0].links for r in hand.fingers[1].links]
    assert solution.certified
    assert 0.0 < min(link_gap(bodies.links, m, r, poses, 1.0, 1.0, np.empty(6)) for m, r in pairs) <= 1.1e-11


def test_a_ball_between_fingers_side_by_side_is_closed_on():
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.03, 0.01, 0.035]))
    solution = close(two_fingers([0.0, 0.02, 0.0]), ball)
    assert solution.certified
    assert {c.finger for c in solution.contacts} == {"index", "thumb"}
