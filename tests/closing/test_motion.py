"""The commanded motion is split: posture from the command, closing to be solved, alternatives inside the limits."""

from dataclasses import replace

import numpy as np
import pytest

from clench.closing.motion import alternatives, asked_fingers, decompose, next_postures, open_posture, palm_pose
from clench.core.pose import Pose
from clench.models.command import GraspCommand
from small_chain import CLOSING, POSTURE, chain


def command(**changes):
    return GraspCommand(**{"hand_pose": Pose.identity(), **changes})


def test_the_open_posture_takes_the_preshape_and_keeps_couplings():
    hand = chain([POSTURE, CLOSING, CLOSING], couplings=[(1, 2, 0.5)])
    np.testing.assert_array_equal(open_posture(hand, command()), [0.0, 0.0, 0.0])
    q = open_posture(hand, command(preshape={"j0": -0.2, "j1": 0.4}))
    np.testing.assert_allclose(q, [-0.2, 0.4, 0.2])


def test_a_preshape_that_leaves_a_limit_by_rounding_is_taken_back():
    hand = chain([CLOSING], lower=-0.5, upper=1.0)
    assert open_posture(hand, command(preshape={"j0": 1.0 + 1e-12}))[0] == 1.0


def test_the_pose_of_a_root_link_places_the_palm():
    hand = chain([POSTURE, CLOSING])
    q = np.array([0.3, 0.4])
    T = Pose([0.1, 0.2, 0.3], wxyz=[0.6, 0.0, 0.8, 0.0])
    for link in hand.links:
        pose = palm_pose(hand, command(hand_pose=T, root_link=link.name), q)
        placed = pose.matrix @ hand.link_poses(q)[hand.link_index(link.name)]
        np.testing.assert_allclose(placed, T.matrix, atol=1e-14)
    assert palm_pose(hand, command(hand_pose=T), q) == T


def test_fingers_come_in_the_order_of_the_command():
    hand = chain([CLOSING], names=("a", "b", "c"))
    assert [f.name for f in asked_fingers(hand, command())] == ["a", "b", "c"]
    assert [f.name for f in asked_fingers(hand, command(fingers=("c", "a")))] == ["c", "a"]


def test_the_commanded_posture_is_the_first_alternative():
    hand = chain([POSTURE, CLOSING, CLOSING])
    q = np.array([0.1, 0.2, 0.3])
    (only,) = alternatives(hand, hand.fingers[0], q, command())
    np.testing.assert_array_equal(only, q)


def test_yaw_and_open_values_vary_the_right_joints():
    hand = chain([POSTURE, POSTURE, CLOSING, CLOSING], directions=[1, 1, 1, -1])
    q = np.zeros(4)
    found = alternatives(hand, hand.fingers[0], q, command(yaw_grid=(0.1, 0.0, -0.1), open_variants=(0.2,)))
    expected = [[0, y, c, -c] for y in (0.0, 0.1, -0.1) for c in (0.0, 0.2)]
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_alternatives_stay_inside_limits_and_none_comes_twice():
    hand = chain([POSTURE, CLOSING], lower=-0.1, upper=0.5)
    found = alternatives(hand, hand.fingers[0], np.zeros(2), command(yaw_grid=(0.0, 0.6, 0.5, 0.9)))
    np.testing.assert_allclose(found, [[0, 0], [0.5, 0]])


def test_opposition_varies_the_first_posture_joint_of_a_thumb_alone():
    asked = command(opposition_grid=(0.3, -0.3), yaw_grid=(0.1,))
    thumb = chain([POSTURE, POSTURE, CLOSING], names=("thumb",))
    found = alternatives(thumb, thumb.fingers[0], np.zeros(3), asked)
    np.testing.assert_allclose(found, [[o, y, 0.0] for o in (0.0, 0.3, -0.3) for y in (0.0, 0.1)])
    finger = chain([POSTURE, POSTURE, CLOSING])
    np.testing.assert_allclose(alternatives(finger, finger.fingers[0], np.zeros(3), asked), [[0, 0, 0], [0, 0.1, 0]])
    one = chain([POSTURE, CLOSING], names=("thumb",))
    found = alternatives(one, one.fingers[0], np.zeros(2), asked)
    np.testing.assert_allclose(sorted(q[0] for q in found), [-0.3, -0.2, 0.0, 0.1, 0.3, 0.4])


def test_next_steps_leave_joints_alone_that_they_do_not_name_and_carry_followers():
    hand = chain([POSTURE, CLOSING, CLOSING, CLOSING], couplings=[(1, 2, 0.5)])
    steps = next_postures(hand, ({"j1": 0.4, "j2": 0.9}, {"j3": 0.1}, {}))
    np.testing.assert_array_equal(steps[0], [np.nan, 0.4, 0.2, np.nan])
    np.testing.assert_array_equal(steps[1], [np.nan, np.nan, np.nan, 0.1])
    assert np.isnan(steps[2]).all()


def test_without_a_posture_joint_before_the_closing_ones_there_is_no_yaw():
    hand = chain([CLOSING, POSTURE, CLOSING])
    assert len(alternatives(hand, hand.fingers[0], np.zeros(3), command(yaw_grid=(0.1, -0.1)))) == 1


def test_followers_stay_with_their_leader_in_every_alternative():
    hand = chain([CLOSING, CLOSING], couplings=[(0, 1, 0.5)])
    for q in alternatives(hand, hand.fingers[0], np.zeros(2), command(open_variants=(0.3, 0.6))):
        assert q[1] == pytest.approx(0.5 * q[0])


def test_decomposition_gives_every_joint_once():
    hand = chain([POSTURE, CLOSING, CLOSING])
    parts = decompose(hand, np.array([0.1, 0.2, 0.3]))
    assert parts == {"posture": {"j0": 0.1}, "closing": {"j1": 0.2, "j2": 0.3}}
    upstream = replace(hand, joints=(replace(hand.joints[0], role="upstream"), *hand.joints[1:]))
    assert decompose(upstream, np.zeros(3))["posture"].keys() == {"j0"}
