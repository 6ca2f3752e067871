"""Rigid poses in three dimensions, immutable, with quaternions in `wxyz` order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .exceptions import CommandError
from .numbers import real_array
from .tolerances import LARGEST_LENGTH, QUATERNION_NORM

FloatArray = NDArray[np.float64]


#: The quaternion `wxyz` of frames whose axes are parallel.
_PARALLEL: Final = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, init=False, eq=False)
class Pose:
    """Map coordinates of one frame to another: `p_a = T_a_b.apply(p_b)`.

    At most one of the three rotations is given. Without a rotation, the axes of the two frames are parallel.

    Args:
        position: origin of frame `b` in frame `a` [m], shape (3,).
        wxyz: unit quaternion, scalar first, shape (4,); normalised when its norm is off by less than 1e-3.
        xyzw: the same with the scalar last, as ROS and SciPy write it.
        rpy: roll, pitch and yaw [rad], shape (3,): turns about the fixed axes x, then y, then z of frame `a`, as in
            URDF. The rotation matrix is `Rz(yaw) @ Ry(pitch) @ Rx(roll)`.

    Raises:
        CommandError: wrong length, not finite, farther than 1e9 m, a norm off by more than 1e-3, or two rotations.
    """

    wxyz_xyz: FloatArray

    def __init__(
        self,
        position: ArrayLike = (0.0, 0.0, 0.0),
        wxyz: ArrayLike | None = None,
        *,
        xyzw: ArrayLike | None = None,
        rpy: ArrayLike | None = None,
        key: str = "pose",
    ) -> None:
        xyz = checked_vector(position, 3, f"{key}.position", "[x, y, z] in metres")
        given = [name for name, value in (("wxyz", wxyz), ("xyzw", xyzw), ("rpy", rpy)) if value is not None]
        if len(given) > 1:
            raise CommandError(f"{key}: expected one rotation, wxyz, xyzw or rpy, got {' and '.join(given)}.")
        if rpy is not None:
            quaternion = _from_rpy(checked_vector(rpy, 3, f"{key}.rpy", "[roll, pitch, yaw] in radians"))
        elif xyzw is not None:
            quaternion = np.roll(_unit(xyzw, f"{key}.xyzw", "[x, y, z, w]"), 1)
        else:
            quaternion = _unit(_PARALLEL if wxyz is None else wxyz, f"{key}.wxyz", "[w, x, y, z]")
        if np.abs(xyz).max() > LARGEST_LENGTH:
            raise CommandError(f"{key}.position: expected metres up to {LARGEST_LENGTH:g}, got {xyz.tolist()}.")
        data = np.concatenate([quaternion, xyz])
        data.flags.writeable = False
        object.__setattr__(self, "wxyz_xyz", data)

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose that changes nothing."""
        return cls()

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """Make a pose from a homogeneous matrix, shape (4, 4)."""
        m = np.asarray(matrix, dtype=np.float64)
        return cls(m[:3, 3], quaternion_from_rotation(m[:3, :3]))

    @property
    def position(self) -> FloatArray:
        """Origin of the inner frame [m], shape (3,)."""
        return self.wxyz_xyz[4:]

    @property
    def wxyz(self) -> FloatArray:
        """Unit quaternion, scalar first, shape (4,)."""
        return self.wxyz_xyz[:4]

    @property
    def xyzw(self) -> FloatArray:
        """Unit quaternion, scalar last, shape (4,)."""
        return np.roll(self.wxyz, -1)

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation matrix, shape (3, 3), read-only."""
        w, x, y, z = self.wxyz.tolist()
        matrix = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        matrix.flags.writeable = False
        return matrix

    @property
    def matrix(self) -> FloatArray:
        """Homogeneous matrix, shape (4, 4)."""
        m = np.eye(4)
        m[:3, :3] = self.rotation
        m[:3, 3] = self.position
        return m

    def inverse(self) -> Pose:
        """Return the pose that maps back."""
        return Pose.from_matrix(invert(self.matrix))

    def __matmul__(self, other: Pose) -> Pose:
        """Compose: `T_a_c = T_a_b @ T_b_c`."""
        return Pose.from_matrix(self.matrix @ other.matrix)

    def apply(self, points: ArrayLike) -> FloatArray:
        """Map points, shape (..., 3) [m]."""
        p = np.asarray(points, dtype=np.float64)
        return p @ self.rotation.T + self.position

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pose) and bool(np.array_equal(self.wxyz_xyz, other.wxyz_xyz))

    def __hash__(self) -> int:
        return hash(self.wxyz_xyz.tobytes())

    def __repr__(self) -> str:
        return f"Pose({self.position.tolist()}, wxyz={self.wxyz.tolist()})"

    def to_dict(self) -> dict[str, list[float]]:
        """Return the form used in files: `position` and `wxyz`."""
        return {"position": self.position.tolist(), "wxyz": self.wxyz.tolist()}

    @classmethod
    def from_dict(cls, data: Any, key: str = "pose") -> Pose:
        """Read the form used in files.

        Raises:
            CommandError: not an object, or unknown, missing or malformed keys.
        """
        if not isinstance(data, dict):
            raise CommandError(f"{key}: expected an object with 'position' and 'wxyz', got {type(data).__name__}.")
        unknown = sorted(set(data) - {"position", "wxyz"})
        if unknown:
            raise CommandError(f"{key}.{unknown[0]}: unknown key; expected 'position' and 'wxyz'.")
        if "position" not in data:
            raise CommandError(f"{key}.position: missing; expected [x, y, z] in metres.")
        # A null is no rotation, but the constructor takes None as the identity.
        wxyz = checked_vector(data.get("wxyz", _PARALLEL), 4, f"{key}.wxyz", "[w, x, y, z]")
        return cls(data["position"], wxyz, key=key)


def _unit(value: ArrayLike, key: str, order: str) -> FloatArray:
    """Return a quaternion that is normalised, in the order that it was given, shape (4,)."""
    quaternion = checked_vector(value, 4, key, order)
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > QUATERNION_NORM:
        raise CommandError(f"{key}: expected a unit quaternion {order}, got norm {norm:.6g}.")
    # A pose that is read back stays the same to the bit.
    return quaternion / norm if abs(norm - 1.0) > 4e-16 else quaternion


def _from_rpy(rpy: FloatArray) -> FloatArray:
    """Return the unit quaternion `wxyz` of turns about the fixed axes x, y and z [rad], shape (4,)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * rpy), np.sin(0.5 * rpy)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    y, z = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
    quaternion = np.array([w, x, y, z])
    return np.asarray(quaternion / math.hypot(*quaternion))


def invert(matrix: FloatArray) -> FloatArray:
    """Invert a rigid homogeneous matrix, shape (4, 4)."""
    m = np.eye(4)
    m[:3, :3] = matrix[:3, :3].T
    m[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return m


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation matrix about a unit axis by an angle [rad] (Rodrigues), shape (3, 3)."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    return rotation


def quaternion_from_rotation(rotation: FloatArray) -> FloatArray:
    """Return the unit quaternion `wxyz` of a rotation matrix, with w >= 0 (Shepperd's method)."""
    q: FloatArray = quaternions_from_rotations(np.asarray(rotation)[None])[0]
    return q


def quaternions_from_rotations(rotations: FloatArray) -> FloatArray:
    """Return the unit quaternions `wxyz` of rotation matrices (N, 3, 3), with w >= 0, shape (N, 4)."""
    m = np.moveaxis(rotations, 0, -1)
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    largest = np.argmax(np.stack([trace, m[0, 0], m[1, 1], m[2, 2]]), axis=0)
    q = np.empty((4, len(rotations)))
    q[:] = 1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    for i in (1, 2, 3):
        if (here := largest == i).any():
            a, b, c = (i - 1), i % 3, (i + 1) % 3
            n = m[:, :, here]
            rows = {0: n[c, b] - n[b, c], 1 + a: 1 + n[a, a] - n[b, b] - n[c, c]}
            rows |= {1 + b: n[a, b] + n[b, a], 1 + c: n[a, c] + n[c, a]}
            for row, values in rows.items():
                q[row, here] = values
    # Sums in a fixed order: one matrix gives the same bits as many.
    q /= np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return np.ascontiguousarray(np.where(q[0] < 0, -q, q).T)


def checked_vector(value: ArrayLike | Sequence[object], length: int, key: str, expected: str) -> FloatArray:
    """Return finite numbers as an array, shape (length,).

    Args:
        value: to check. length: how many. key: names it in messages. expected: description of the value.

    Raises:
        CommandError: something else.
    """
    array = real_array(value)
    if array is None:
        raise CommandError(f"{key}: expected {expected}, got {value!r}.")
    if array.shape != (length,):
        raise CommandError(f"{key}: expected {length} numbers {expected}, got {value!r}.")
    if not np.isfinite(array).all():
        raise CommandError(f"{key}: expected finite numbers {expected}, got {array.tolist()}.")
    return array.copy()
