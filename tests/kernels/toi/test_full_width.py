"""Links of the hand that press on each other by rounding, and such that lie in each other."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clench
from chain_hands import HandBuilder, along_x, bipyramid
from clench.core.pose import Pose
from clench.kernels.toi.full_width import PRESSED, find_link_overlap
from clench.models.hand.hand import JointRole
from clench.models.shapes import Shape, ShapeKind
from clench.solver.planning import plan_hand
from clench.solver.problem import make_problem

BOX = Shape(ShapeKind.BOX, (0.01, 0.008, 0.005))


def overlap(one, other, R, offset):
    """Say whether two links overlap, the second one turned and shifted off the first."""
    roles = [JointRole.POSTURE, JointRole.CLOSING]
    builder = HandBuilder(palm=one).finger("index", [other, along_x(0.001, 0.01)], [0.5, 0.01], upper=0.1, roles=roles)
    hand = replace(builder.hand(), allowed_pairs=((1, 2),))
    problem = make_problem(
        hand, clench.GraspObject.load("ball"), clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    )
    poses = np.tile(np.eye(4)[:3], (3, 1, 1))
    poses[1, :, :3], poses[1, :, 3] = R, offset
    poses[2, :, 3] = [1.0, 0.0, 0.0]
    full_width = plan_hand(problem).full_width_arrays
    far = np.column_stack([np.eye(3), [5.0, 0.0, 0.0]])
    return (
        find_link_overlap(full_width._replace(checked=np.array([[0, 1, 1], [1, 0, 0], [1, 0, 0]])), poses, far, 1e-6)[0]
        >= 0
    )


def placed(seed, deep):
    """Return a pose of a box that goes into another by so much: at a face, a corner on a face, an edge on an edge."""
    rng = np.random.default_rng(seed)
    kind = seed % 3
    if kind == 0:
        return np.eye(3), np.array([*rng.uniform(-0.005, 0.005, 2), 0.01 - deep])
    R = Rotation.random(rng=rng).as_matrix()
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * BOX.size @ R.T
    low = corners[np.argmin(corners[:, 2])]
    if kind == 1:
        return R, np.array([0.0, 0.0, 0.005 - deep]) - low
    # An edge across another one: the boxes lie apart along the direction across both.
    u, v = np.array([0.0, 1.0, 0.0]), R[:, 0]
    n = np.cross(u, v)
    n *= np.sign(n[2]) / np.linalg.norm(n)
    here = np.array([np.sign(n[0]) * 0.01, 0.0, 0.005])
    bottom = corners[np.argmin(corners @ n)]
    middle = bottom - R[:, 0] * (R[:, 0] @ bottom)
    return R, here - middle - deep * n


@pytest.mark.parametrize("seed", range(12))
def test_links_that_press_on_each_other_by_rounding_do_not_overlap(seed):
    for deep in (-1e-9, 1e-11, 1e-10, 1e-9, 0.5 * PRESSED):
        assert not overlap(BOX, BOX, *placed(seed, deep))
    for deep in (3.0 * PRESSED, 1e-6, 1e-3):
        assert overlap(BOX, BOX, *placed(seed, deep))


@pytest.mark.parametrize("axis", range(3))
def test_links_that_lie_side_by_side_do_not_overlap(axis):
    """Their sides are flush with each other, their tops lie in one plane."""
    away = 2.0 * BOX.size[axis] * np.eye(3)[axis]
    assert not overlap(BOX, BOX, np.eye(3), away)
    assert overlap(BOX, BOX, np.eye(3), (1.0 - 1e-5) * away)


@pytest.mark.parametrize("corners", [3, 4, 12])
def test_links_that_share_a_ring_of_edges_and_lie_in_each_other_overlap(corners):
    assert overlap(bipyramid(75.0, 60.0, corners), bipyramid(60.0, 75.0, corners), np.eye(3), np.zeros(3))
