"""Compute the pose of an axis group from the turns of the joints before it."""

from __future__ import annotations

from clench.kernels.closing.layout import Floats, HandArrays, Work
from clench.kernels.runtime.compiling import kernel

from .advance import place_joints


@kernel
def copy_pose(T: Floats, out: Floats) -> None:
    """Write a pose elsewhere, shape (3, 4) each."""
    for r in range(3):
        for c in range(4):
            out[r, c] = T[r, c]


@kernel
def put_point(T: Floats, p: Floats, out: Floats) -> None:
    """Write a point in the frame that a pose leads to."""
    for r in range(3):
        out[r] = T[r, 0] * p[0] + T[r, 1] * p[1] + T[r, 2] * p[2] + T[r, 3]


@kernel
def back(T: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Map a point by the inverse of a pose, (3, 4)."""
    x, y, z = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    return (
        T[0, 0] * x + T[1, 0] * y + T[2, 0] * z,
        T[0, 1] * x + T[1, 1] * y + T[2, 1] * z,
        T[0, 2] * x + T[1, 2] * y + T[2, 2] * z,
    )


@kernel
def compose(a: Floats, b: Floats, out: Floats) -> None:
    """Write the product of two rigid poses, shape (3, 4) each."""
    for r in range(3):
        for c in range(4):
            total = a[r, 3] if c == 3 else 0.0
            for k in range(3):
                total += a[r, k] * b[k, c]
            out[r, c] = total


@kernel
def compose_inverse(a: Floats, b: Floats, out: Floats) -> None:
    """Write `a⁻¹ b` for rigid poses, shape (3, 4) each."""
    for r in range(3):
        for c in range(4):
            total = 0.0
            for k in range(3):
                value = b[k, c] - a[k, 3] if c == 3 else b[k, c]
                total += a[k, r] * value
            out[r, c] = total


@kernel
def pose_axis_group(hand: HandArrays, axis_group: int, first: bool, turns: Floats, work: Work, poses: Floats) -> None:
    """Write `T_palm_axis_group` from that of the axis group before and the turns of its joints.

    Args:
        hand: the fingers. axis_group: its index. first: it is its finger posture's first axis group, which nothing
            moves.
        turns: of every joint [rad]. work: scratch space. poses: (F, 3, 4), read and written.
    """
    if first:
        for r in range(3):
            for k in range(4):
                poses[axis_group, r, k] = hand.axis_group_pose[axis_group, r, k]
        return
    place, step, before = work.place, work.pose[0], work.pose[1]
    place_joints(hand.chain, axis_group - 1, turns, place)
    last = 0
    for j in range(turns.shape[0]):
        if hand.chain.joint_axis_group[j] == axis_group - 1:
            last = j
    c, s = place[last, 3], place[last, 4]
    step[0, 0], step[0, 1], step[0, 2], step[0, 3] = c, 0.0, -s, place[last, 0]
    step[1, 0], step[1, 1], step[1, 2], step[1, 3] = 0.0, 1.0, 0.0, 0.0
    step[2, 0], step[2, 1], step[2, 2], step[2, 3] = s, 0.0, c, place[last, 1]
    compose(poses[axis_group - 1], step, before)
    compose(before, hand.axis_group_pose[axis_group], poses[axis_group])


@kernel
def pose_axis_groups(hand: HandArrays, finger_posture: int, turns: Floats, work: Work, poses: Floats) -> None:
    """Write `T_palm_axis_group` of a finger posture's axis groups after the first, which has been written."""
    for axis_group in range(hand.first_axis_group[finger_posture] + 1, hand.first_axis_group[finger_posture + 1]):
        pose_axis_group(hand, axis_group, False, turns, work, poses)
