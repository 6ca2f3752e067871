"""The kernels' kinematics against the hand's own, which NumPy computes."""

import numpy as np
import pytest

import clench
from clench.closing.linkage import placed_links
from clench.core.pose import Pose, invert
from clench.kernels.geometry.link_frames import relate_poses


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_links_are_where_the_hand_says(name):
    hand = clench.Hand.load(name)
    rng = np.random.default_rng(0)
    low, high = (np.array([getattr(j, end) for j in hand.joints]) for end in ("lower", "upper"))
    for q in (hand.open_angles(), *(hand.coupled(rng.uniform(low, high)) for _ in range(5))):
        np.testing.assert_allclose(placed_links(hand, q), hand.link_poses(q)[:, :3], atol=1e-14)


def test_where_one_pose_is_in_another():
    rng = np.random.default_rng(1)
    quaternions = rng.normal(size=(2, 4, 4))
    quaternions /= np.linalg.norm(quaternions, axis=2, keepdims=True)
    a, b = ([Pose(rng.normal(size=3), q) for q in row] for row in quaternions)
    found = np.empty((4, 3, 4))
    relate_poses(np.array([p.wxyz_xyz for p in a]), np.array([p.wxyz_xyz for p in b]), found)
    expected = [(invert(p.matrix) @ q.matrix)[:3] for p, q in zip(a, b, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-14)
