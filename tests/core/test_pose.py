"""Poses: three ways to write a rotation, and what is refused."""

from __future__ import annotations

import math
from functools import reduce

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clench.core.exceptions import CommandError
from clench.core.pose import Pose, rotation_about

HALF, TURN = math.pi / 2.0, 2.0 * math.pi
#: Roll, pitch and yaw: none, one each, both gimbal locks, half turns, whole turns, tiny ones, and random ones.
ANGLES = [
    (0.0, 0.0, 0.0),
    *((a, 0.0, 0.0) for a in (HALF, math.pi, -math.pi, TURN, 1e-12)),
    *((0.0, a, 0.0) for a in (HALF, -HALF, math.pi, -TURN)),
    *((0.0, 0.0, a) for a in (HALF, -math.pi, 3.0 * TURN, -1e-300)),
    *((0.3, a, -0.7) for a in (HALF, -HALF, math.nextafter(HALF, 0.0))),
    (math.pi, math.pi, math.pi),
    *map(tuple, np.random.default_rng(0).uniform(-10.0, 10.0, (50, 3)).tolist()),
]


@pytest.mark.parametrize("rpy", ANGLES, ids=str)
def test_roll_pitch_and_yaw_turn_about_the_fixed_axes_in_this_order(rpy: tuple[float, float, float]) -> None:
    pose = Pose([1.0, 2.0, 3.0], rpy=rpy)
    turns = [rotation_about(axis, angle) for axis, angle in zip(np.eye(3), rpy, strict=True)]
    assert np.allclose(pose.rotation, reduce(lambda so_far, turn: turn @ so_far, turns), rtol=0.0, atol=1e-14)
    assert np.allclose(pose.rotation, Rotation.from_euler("xyz", rpy).as_matrix(), rtol=0.0, atol=1e-14)
    assert abs(math.hypot(*pose.wxyz) - 1.0) <= 4e-16
    assert pose.position.tolist() == [1.0, 2.0, 3.0]


def test_yaw_turns_x_to_y_and_pitch_turns_z_to_x() -> None:
    assert np.allclose(Pose(rpy=[0.0, 0.0, HALF]).apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-15)
    assert np.allclose(Pose(rpy=[0.0, HALF, 0.0]).apply([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0], atol=1e-15)
    # Roll comes first: afterwards yaw turns what was z and is -y by now.
    assert np.allclose(Pose(rpy=[HALF, 0.0, HALF]).apply([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0], atol=1e-15)


def test_urdf_means_the_same_by_rpy() -> None:
    import mujoco

    rpy = (0.4, -1.2, 2.5)
    text = (
        '<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f'<joint name="j" type="revolute"><origin xyz="1 2 3" rpy="{" ".join(map(str, rpy))}"/><parent link="a"/>'
        '<child link="b"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    quaternion = mujoco.MjModel.from_xml_string(text).body("b").quat
    assert abs(abs(quaternion @ Pose(rpy=rpy).wxyz) - 1.0) < 1e-12


@pytest.mark.parametrize(
    "xyzw",
    [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.1, -0.7, 0.5, 0.5], [0.5, 0.5, 0.5, 0.4999]],
)
def test_scalar_last_is_scalar_first_rolled(xyzw: list[float]) -> None:
    pose = Pose([0.0, 0.0, 1.0], xyzw=xyzw)
    assert pose == Pose([0.0, 0.0, 1.0], [xyzw[3], *xyzw[:3]])
    assert pose.xyzw.tolist() == [*pose.wxyz[1:], pose.wxyz[0]]
    assert Pose(xyzw=pose.xyzw).wxyz.tolist() == pose.wxyz.tolist()


@pytest.mark.parametrize(
    ("rotation", "message"),
    [
        ({"wxyz": [1, 0, 0, 0], "rpy": [0, 0, 0]}, r"^pose: expected one rotation, .*, got wxyz and rpy\.$"),
        ({"wxyz": [1, 0, 0, 0], "xyzw": [0, 0, 0, 1]}, r"^pose: expected one rotation, .*, got wxyz and xyzw\.$"),
        (
            {"wxyz": [1, 0, 0, 0], "xyzw": [0, 0, 0, 1], "rpy": [0, 0, 0]},
            r"^pose: expected one rotation, .*, got wxyz and xyzw and rpy\.$",
        ),
        ({"xyzw": [0, 0, 0, 0]}, r"^pose\.xyzw: expected a unit quaternion \[x, y, z, w\], got norm 0\.$"),
        ({"xyzw": [0, 0, 1]}, r"^pose\.xyzw: expected 4 numbers \[x, y, z, w\]"),
        ({"xyzw": [0, 0, 0, math.nan]}, r"^pose\.xyzw: expected finite numbers"),
        ({"rpy": [0, 0, 0, 1]}, r"^pose\.rpy: expected 3 numbers \[roll, pitch, yaw\] in radians"),
        ({"rpy": [0, math.inf, 0]}, r"^pose\.rpy: expected finite numbers"),
        ({"rpy": "0 0 0"}, r"^pose\.rpy: expected \[roll, pitch, yaw\] in radians"),
        ({"wxyz": [1, 1, 0, 0]}, r"^pose\.wxyz: expected a unit quaternion \[w, x, y, z\], got norm 1\.41421\.$"),
    ],
)
def test_malformed_rotations_are_refused(rotation: dict[str, object], message: str) -> None:
    with pytest.raises(CommandError, match=message):
        Pose(**rotation)


def test_a_null_in_a_file_is_no_rotation() -> None:
    with pytest.raises(CommandError, match=r"^pose\.wxyz: expected \[w, x, y, z\], got None\.$"):
        Pose.from_dict({"position": [0.0, 0.0, 0.0], "wxyz": None})
    assert Pose.from_dict({"position": [0.0, 0.0, 1.0]}) == Pose([0.0, 0.0, 1.0])
