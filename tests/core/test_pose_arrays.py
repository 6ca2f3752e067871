"""Poses in arrays have the bits of poses one by one."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clench.core.pose import Pose, quaternion_from_rotation, quaternions_from_rotations
from clench.core.pose_arrays import pose_rows


@given(st.integers(0, 2**32 - 1), st.floats(-9e-4, 9e-4))
def test_rows_are_those_of_poses(seed, off):
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(5, 4))
    # Half turns, where another component is the largest.
    quaternions[:3, 0] = 0.0
    quaternions *= (1.0 + off) / np.linalg.norm(quaternions, axis=1, keepdims=True)
    rows = np.concatenate([quaternions, rng.normal(size=(5, 3))], axis=1)
    poses = [Pose(row[4:], row[:4]) for row in rows]
    expected = np.array([pose.wxyz_xyz for pose in poses])
    np.testing.assert_array_equal(pose_rows(rows, "poses"), expected)
    np.testing.assert_array_equal(pose_rows(poses, "poses"), expected)
    matrices = np.array([pose.matrix for pose in poses])
    again = [Pose.from_matrix(m).wxyz_xyz for m in matrices]
    np.testing.assert_array_equal(pose_rows(matrices, "poses"), again)
    np.testing.assert_allclose([Pose(r[4:], r[:4]).matrix for r in again], matrices, atol=1e-15 / math.sqrt(0.1))


@given(st.integers(0, 2**32 - 1))
def test_many_quaternions_are_those_of_one(seed):
    quaternions = np.random.default_rng(seed).normal(size=(6, 4))
    rotations = np.array([Pose(wxyz=q / np.linalg.norm(q)).rotation for q in quaternions])
    many = quaternions_from_rotations(rotations)
    np.testing.assert_array_equal(many, [quaternion_from_rotation(r) for r in rotations])
    unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    np.testing.assert_allclose(many, unit * np.sign(unit[:, :1]), atol=1e-14)
