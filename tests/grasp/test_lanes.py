"""Links whose curl planes lie apart: they never meet, however far their fingers turn."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, turned
from clench.base.pose import Pose
from clench.grasp.exact import hand_bodies
from clench.grasp.lanes import links_that_may_meet
from clench.grasp.plan import FingerPlan, plan_finger
from clench.kernels.nearness import link_gap
from clench.models.shapes import CollisionSource

ENGINE = CollisionSource.ENGINE
SHAPES, LENGTHS = [along_x(0.006, 0.04), along_x(0.006, 0.03)], [0.04, 0.03]


def two_fingers(base: np.ndarray, rotation: np.ndarray | None = None) -> clench.Hand:
    builder = HandBuilder().finger("index", SHAPES, LENGTHS, upper=2.0)
    return builder.finger("thumb", SHAPES, LENGTHS, base=mount(base, rotation), upper=2.0, thumb=True).hand()


def may_meet(hand: clench.Hand, arc: float) -> set[tuple[int, int]]:
    plans: list[FingerPlan] = [plan_finger(hand, f, hand.open_angles(), 1, ENGINE) for f in hand.fingers]
    index, thumb = ({link: np.full(2, arc) for link in f.links} for f in hand.fingers)
    return links_that_may_meet(hand, (plans[0], plans[1]), (index, thumb), hand_bodies(hand, ENGINE))


def test_fingers_side_by_side_never_meet_and_those_in_line_may():
    assert may_meet(two_fingers([0.0, 0.013, 0.0]), 0.3) == set()
    assert len(may_meet(two_fingers([0.0, 0.011, 0.0]), 0.3)) == 4


def test_a_finger_that_turns_about_another_axis_comes_nearer_by_its_arc():
    tilted = two_fingers([0.0, 0.03, 0.0], turned(np.array([0.0, 0.0, 1.0]), -0.1))
    assert may_meet(tilted, 1e-3) == set()
    assert len(may_meet(tilted, 0.3)) == 4


@pytest.mark.parametrize("seed", range(3))
def test_what_is_left_out_never_touches(seed):
    rng = np.random.default_rng(seed)
    left_out = 0
    for _ in range(12):
        away = rng.uniform([-0.02, 0.012, -0.02], [0.04, 0.05, 0.03])
        hand = two_fingers(away, turned(np.array([0.0, 0.0, 1.0]), float(rng.choice([0.0, rng.normal(scale=0.1)]))))
        # No point of a finger is farther than this from a joint, and no joint turns farther than 2 rad.
        pairs = may_meet(hand, 2.0 * 0.076)
        apart = {(m, r) for m in hand.fingers[0].links for r in hand.fingers[1].links} - pairs
        left_out += len(apart)
        bodies = hand_bodies(hand, ENGINE)
        for _ in range(20):
            poses = np.ascontiguousarray(hand.link_poses(rng.uniform(0.0, 2.0, 4))[:, :3])
            assert all(link_gap(bodies.links, m, r, poses, 1.0, 1.0, np.empty(6)) > 0.0 for m, r in apart)
    assert left_out > 10


def test_a_ball_between_fingers_side_by_side_is_closed_on_as_before():
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.03, 0.01, 0.035]))
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), planes=1, order=clench.ClosingOrder.TOGETHER, preshape="open"
    )
    solution = clench.solve(two_fingers([0.0, 0.02, 0.0]), ball, command)
    assert solution.certified
    assert {c.finger for c in solution.contacts} == {"index", "thumb"}
