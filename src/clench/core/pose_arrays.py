"""Many poses in one array: read from poses, quaternions or matrices, and checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from .exceptions import CommandError
from .numbers import real_array
from .pose import FloatArray, Pose, quaternions_from_rotations
from .tolerances import LARGEST_LENGTH, QUATERNION_NORM

_EXPECTED: Final = "expected poses, an array (N, 7) of rows [w, x, y, z, X, Y, Z], or one (N, 4, 4) of matrices"
#: A norm that is off by less is left alone, as `Pose` does.
_UNIT: Final = 4e-16


def pose_of_row(row: FloatArray) -> Pose:
    """Return the pose of a row [w, x, y, z, X, Y, Z], shape (7,)."""
    return Pose(row[4:], row[:4])


def pose_rows(poses: Sequence[Pose] | ArrayLike, key: str) -> FloatArray:
    """Return poses as rows of unit quaternion `wxyz` and position [m], shape (N, 7), bit-identical to `Pose`.

    Args:
        poses: a sequence of poses, rows (N, 7), or homogeneous matrices (N, 4, 4). key: names it in messages.

    Raises:
        CommandError: another shape, numbers that are not finite, a quaternion or a rotation that is none.
    """
    if isinstance(poses, Pose):
        raise CommandError(f"{key}: {_EXPECTED}, got one pose.")
    given = list(poses) if isinstance(poses, Sequence) else []
    if given and all(isinstance(pose, Pose) for pose in given):
        return np.array([pose.wxyz_xyz for pose in given])
    array = real_array(poses)
    if array is None:
        raise CommandError(f"{key}: {_EXPECTED}, of real numbers.")
    if array.size == 0 and array.ndim == 1:
        return np.empty((0, 7))
    if array.shape[1:] not in ((7,), (4, 4)):
        raise CommandError(f"{key}: {_EXPECTED}, got shape {array.shape}.")
    bad = ~np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
    if bad.any():
        raise CommandError(f"{key}[{int(bad.argmax())}]: expected finite numbers.")
    return _checked_rows(array.copy() if array.ndim == 2 else _from_matrices(array, key), key)


def _from_matrices(matrices: FloatArray, key: str) -> FloatArray:
    R = matrices[:, :3, :3]
    off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = (off > QUATERNION_NORM) | (np.linalg.det(R) < 0.0)
    if bad.any():
        i = int(bad.argmax())
        raise CommandError(
            f"{key}[{i}]: expected a rotation in the first three rows and columns; its columns are not orthonormal and "
            f"right-handed (off by {off[i]:.3g}, determinant {np.linalg.det(R[i]):.3g})."
        )
    bad = np.abs(matrices[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1, initial=0.0) > QUATERNION_NORM
    if bad.any():
        i = int(bad.argmax())
        raise CommandError(f"{key}[{i}]: expected the last row [0, 0, 0, 1], got {matrices[i, 3].tolist()}.")
    return np.concatenate([quaternions_from_rotations(R), matrices[:, :3, 3]], axis=1)


def _checked_rows(rows: FloatArray, key: str) -> FloatArray:
    """Return rows with unit quaternions, normalised as `Pose` does."""
    norms = np.array([math.hypot(*quaternion) for quaternion in rows[:, :4].tolist()])
    bad = np.abs(norms - 1.0) > QUATERNION_NORM
    if bad.any():
        i = int(bad.argmax())
        raise CommandError(f"{key}[{i}]: expected a unit quaternion [w, x, y, z] first, got norm {norms[i]:.6g}.")
    bad = np.abs(rows[:, 4:]).max(axis=1, initial=0.0) > LARGEST_LENGTH
    if bad.any():
        i = int(bad.argmax())
        raise CommandError(f"{key}[{i}]: expected metres up to {LARGEST_LENGTH:g}, got {rows[i, 4:].tolist()}.")
    off = np.abs(norms - 1.0) > _UNIT
    rows[off, :4] /= norms[off, None]
    return rows
