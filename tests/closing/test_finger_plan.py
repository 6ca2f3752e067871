"""Plans of a finger: degrees of freedom, axis groups, travel, and outlines that move as the links do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.closing.finger_plan import plan_finger
from clench.core.exceptions import HandError
from clench.core.pose import rotation_about
from clench.models.hand.hand import Coupling
from clench.models.shapes import CollisionSource
from small_chain import CLOSING, LENGTH, POSTURE, chain

ENGINE = CollisionSource.ENGINE


def plan(hand, q=None, planes=3):
    posture = np.zeros(len(hand.joints)) if q is None else np.array(q, dtype=float)
    return plan_finger(hand, hand.fingers[0], hand.coupled(posture), planes, ENGINE)


def test_parallel_joints_share_one_axis_group():
    found = plan(chain([POSTURE, CLOSING, CLOSING, CLOSING]))
    assert [p.axis_group for p in found.joints] == [0, 0, 0]
    assert [p.dof for p in found.joints] == [0, 1, 2]
    assert found.lengths == (1.5, 1.5, 1.5)
    np.testing.assert_allclose([p.pivot for p in found.joints], [[0, 0], [LENGTH, 0], [2 * LENGTH, 0]], atol=1e-15)


@pytest.mark.parametrize(("yaw", "axis_groups"), [(0.0, [0, 0]), (1e-10, [0, 0]), (1e-7, [0, 1]), (0.4, [0, 1])])
def test_a_turned_axis_starts_an_axis_group_of_its_own(yaw, axis_groups):
    found = plan(chain([CLOSING, POSTURE, CLOSING]), [0.0, yaw, 0.0])
    assert [p.axis_group for p in found.joints] == axis_groups


def test_every_axis_group_of_a_finger_has_as_many_planes():
    found = plan(chain([CLOSING, POSTURE, CLOSING]), [0.0, 0.4, 0.0], planes=5)
    assert len({len(f.offsets) for f in found.axis_groups}) == 1


def test_a_joint_of_negative_direction_travels_to_its_lower_limit():
    hand = chain([CLOSING, CLOSING], directions=[-1, 1])
    found = plan(hand)
    assert found.lengths == (0.5, 1.5)
    np.testing.assert_allclose(found.angles(hand, np.array([0.3, 0.2])), [-0.3, 0.2])
    assert found.joints[0].rate == pytest.approx(1.0)
    np.testing.assert_allclose(found.angles(hand, np.array([9.0, 9.0])), [-0.5, 1.5])


def test_a_joint_at_or_beyond_its_limit_has_no_travel():
    assert plan(chain([CLOSING]), [1.5]).lengths == (0.0,)


def test_a_follower_moves_while_its_own_angle_is_inside_its_limits():
    hand = chain([CLOSING, CLOSING], couplings=[(0, 1, 2.0)], upper=1.5)
    found = plan(hand)
    assert found.leaders == (0,)
    follower = found.joints[1]
    assert (follower.start, follower.stop) == pytest.approx((0.0, 0.75))
    assert follower.rate == pytest.approx(2.0 * found.joints[0].rate)
    np.testing.assert_allclose(found.angles(hand, np.array([1.0])), [1.0, 1.5])


def test_a_follower_with_an_offset_starts_late():
    hand = chain([CLOSING, CLOSING], lower=0.0)
    hand = replace(hand, couplings=(Coupling(0, 1, 1.0, -0.4, reason="test"),))
    follower = plan(hand).joints[1]
    assert (follower.start, follower.stop) == pytest.approx((0.4, 1.5))


def test_coupling_between_fingers_is_refused_by_name():
    hand = chain([CLOSING], names=("index", "ring"), couplings=[(1, 0, 1.0)])
    with pytest.raises(HandError, match=r"'j0'.*'index'.*'j1'"):
        plan(hand)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.tuples(*[st.floats(0.0, 1.0)] * 3), st.integers(1, 5))
def test_the_planar_chain_moves_as_the_hand_does(open_angles, travel, planes):
    """Turning pivots in the axis group's plane gives the places of the link frames that forward kinematics gives."""
    hand = chain([CLOSING, CLOSING, CLOSING])
    found = plan(hand, open_angles, planes)
    T = found.axis_groups[0].T_palm_axis_group
    q = found.angles(hand, np.array(travel))
    poses = hand.link_poses(q)
    place, angle, before = np.zeros(2), 0.0, np.zeros(2)
    for p, s in zip(found.joints, travel, strict=True):
        c, d = np.cos(angle), np.sin(angle)
        run = p.pivot - before
        place += [c * run[0] - d * run[1], d * run[0] + c * run[1]]
        before = p.pivot
        anchor = T[:3, :3] @ [place[0], 0.0, place[1]] + T[:3, 3]
        link = next(i for i, link in enumerate(hand.links) if link.joint == p.joint)
        np.testing.assert_allclose(poses[link][:3, 3], anchor, atol=1e-12)
        angle += p.rate * s


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.4, 0.4), st.floats(0.0, 1.2))
def test_the_frame_turns_x_towards_z(open_angle, turn):
    hand = chain([CLOSING])
    found = plan(hand, [open_angle])
    T = found.axis_groups[0].T_palm_axis_group
    axis = -T[:3, 1]
    np.testing.assert_allclose(rotation_about(axis, np.pi / 2) @ T[:3, 0], T[:3, 2], atol=1e-12)
    assert found.joints[0].rate == pytest.approx(1.0)
    assert found.joints[0].turn == pytest.approx(1.0)


def test_nothing_that_moves_gets_farther_than_the_reach():
    hand = chain([CLOSING, CLOSING])
    found = plan(hand, [0.3, -0.2])
    axis_group = found.axis_groups[0]
    origin = axis_group.T_palm_axis_group[:3, 3]
    for q in np.random.default_rng(0).uniform(-0.5, 1.5, (50, 2)):
        for link, pose in list(zip(hand.links, hand.link_poses(q), strict=True))[1:]:
            points = link.shapes[ENGINE][0].to_mesh(1e-4).vertices @ pose[:3, :3].T + pose[:3, 3]
            away = (points - origin) @ axis_group.T_palm_axis_group[:3, [0, 2]]
            assert np.linalg.norm(away, axis=1).max() <= axis_group.reach + 1e-12


def test_outlines_belong_to_the_joint_that_moves_their_link_last():
    found = plan(chain([CLOSING, POSTURE, CLOSING]), [0.0, 0.4, 0.0])
    first, second = found.axis_groups
    assert {(o.link, o.joint) for row in first.outlines for o in row} == {(1, 0), (2, 0), (3, 0)}
    assert {(o.link, o.joint) for row in second.outlines for o in row} == {(3, 1)}


@pytest.mark.parametrize("planes", [1, 3, 9])
def test_the_length_of_a_finger_bounds_its_cuts_and_ignores_their_number(planes):
    hand = chain([CLOSING, POSTURE, CLOSING])
    found = plan(hand, [0.0, 0.4, 0.0], planes)
    assert found.length == plan(hand, [0.0, 0.4, 0.0], 5).length
    reach = max(f.reach for f in found.axis_groups)
    assert reach <= found.length * (1.0 + 1e-3)
    assert found.length <= 1.5 * reach
