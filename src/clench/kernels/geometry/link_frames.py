"""Compute the frames of a hand's links, and its joints' angles from the travels of degrees of freedom."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import ChainArrays, Floats, Ints
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose, compose_inverse, copy_pose


class FrameArrays(NamedTuple):
    """The kinematics of a whole hand; L links, J joints, C couplings, E finger postures, G degrees of freedom.

    Args:
        parent: of each link, -1 for the root, (L,). joint: that moves it, -1 when fixed, (L,).
        T_parent_link: at the joint's reference angle, (L, 3, 4).
        axis, anchor: of each joint in the frame of its link [m], (J, 3). reference: angle [rad], (J,).
        palm: index of the palm, (1,).
        direction: in which joints close, (J,). lower, upper: limits [rad], (J,).
        leader, follower: of each coupling, (C,). ratio: [-], offset: [rad], (C,).
        posture: open angles of each finger posture [rad], (E, J). dof_leader: joint that leads each degree of freedom,
            (G,).
        chain_joint: joint of the hand that each joint of `ChainArrays` is. chain_turn: +1 where its angle grows with
            its turn, else -1. breakaway: whether the follower of a coupling can stay behind, (C,).
    """

    parent: Ints
    joint: Ints
    T_parent_link: Floats
    axis: Floats
    anchor: Floats
    reference: Floats
    palm: Ints
    direction: Floats
    lower: Floats
    upper: Floats
    leader: Ints
    follower: Ints
    ratio: Floats
    offset: Floats
    posture: Floats
    dof_leader: Ints
    chain_joint: Ints
    chain_turn: Floats
    breakaway: Ints


@kernel
def turn_link(axis: Floats, anchor: Floats, angle: float, T: Floats, R: Floats, out: Floats) -> None:
    """Write a pose turned about an axis of its own frame through an anchor; R is scratch (Rodrigues)."""
    x, y, z = axis[0], axis[1], axis[2]
    s, v = math.sin(angle), 1.0 - math.cos(angle)
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - v * (y * y + z * z), v * x * y - s * z, v * x * z + s * y
    R[1, 0], R[1, 1], R[1, 2] = v * x * y + s * z, 1.0 - v * (x * x + z * z), v * y * z - s * x
    R[2, 0], R[2, 1], R[2, 2] = v * x * z - s * y, v * y * z + s * x, 1.0 - v * (x * x + y * y)
    for r in range(3):
        R[r, 3] = anchor[r] - R[r, 0] * anchor[0] - R[r, 1] * anchor[1] - R[r, 2] * anchor[2]
    compose(T, R, out)


@entry_kernel(allocates=True)
def place_links(frames: FrameArrays, q: Floats, poses: Floats) -> None:
    """Write `T_palm_link` of every link at a posture (J,) [rad] to `poses`, (L, 3, 4)."""
    put_links(frames, q, np.empty((frames.parent.shape[0] + 2, 3, 4)), poses)


@kernel
def put_links(frames: FrameArrays, q: Floats, scratch: Floats, poses: Floats) -> None:
    """Do as `place_links` with scratch space, (L + 2, 3, 4)."""
    links = frames.parent.shape[0]
    for i in range(links):
        put_link(frames, i, q, scratch[links], scratch[links + 1], scratch)
    for i in range(links):
        compose_inverse(scratch[frames.palm[0]], scratch[i], poses[i])


@kernel
def put_link(frames: FrameArrays, i: int, q: Floats, R: Floats, turned: Floats, poses: Floats) -> None:
    """Write the pose of one link in the frame of the root to `poses[i]`; that of its parent is there already.

    Args:
        q: the posture (J,) [rad]. R, turned: scratch space, (3, 4) each. poses: of the links, at least (L, 3, 4).
    """
    j, parent = frames.joint[i], frames.parent[i]
    if j >= 0:
        angle = q[j] - frames.reference[j]
        turn_link(frames.axis[j], frames.anchor[j], angle, frames.T_parent_link[i], R, turned)
    else:
        copy_pose(frames.T_parent_link[i], turned)
    if parent < 0:
        copy_pose(turned, poses[i])
    else:
        compose(poses[parent], turned, poses[i])


@kernel
def put_angles(frames: FrameArrays, finger_posture: int, first: int, last: int, travel: Floats, q: Floats) -> None:
    """Write all joints' angles when the degrees of freedom `first` to `last` have travelled (G,); see `FingerPlan`."""
    for j in range(q.shape[0]):
        q[j] = frames.posture[finger_posture, j]
    for g in range(first, last):
        j = frames.dof_leader[g]
        q[j] = inside(q[j] + frames.direction[j] * travel[g], frames.lower[j], frames.upper[j])
    couple(frames, q)


@kernel
def put_closed(
    frames: FrameArrays,
    chain: ChainArrays,
    finger_posture: int,
    first: int,
    last: int,
    travel: Floats,
    turn: Floats,
    q: Floats,
) -> None:
    """Do as `put_angles`, but by the turns of the joints (J,) where joints of a finger posture break away."""
    breaks = False
    for g in range(first, last):
        breaks = breaks or chain.breaks[g] != 0
    if not breaks:
        put_angles(frames, finger_posture, first, last, travel, q)
        return
    for j in range(q.shape[0]):
        q[j] = frames.posture[finger_posture, j]
    for k in range(turn.shape[0]):
        if first <= chain.joint_dof[k] < last:
            j = frames.chain_joint[k]
            q[j] = inside(q[j] + frames.chain_turn[k] * turn[k], frames.lower[j], frames.upper[j])


@kernel
def tie(frames: FrameArrays, q: Floats) -> None:
    """Do as `couple`, but leave followers that can break away where they are; see `Hand.tied`."""
    for c in range(frames.leader.shape[0]):
        if not frames.breakaway[c]:
            f = frames.follower[c]
            angle = frames.ratio[c] * q[frames.leader[c]] + frames.offset[c]
            q[f] = inside(angle, frames.lower[f], frames.upper[f])


@kernel
def couple(frames: FrameArrays, q: Floats) -> None:
    """Make followers obey their couplings, each inside its limits, in place; see `Hand.coupled`."""
    for c in range(frames.leader.shape[0]):
        f = frames.follower[c]
        angle = frames.ratio[c] * q[frames.leader[c]] + frames.offset[c]
        q[f] = inside(angle, frames.lower[f], frames.upper[f])


@kernel
def inside(value: float, low: float, high: float) -> float:
    """Return a value, or the limit that it passes."""
    if low > value:
        value = low
    return high if high < value else value


@entry_kernel(allocates=True)
def relate_poses(first: Floats, second: Floats, placed: Floats) -> None:
    """Write where the second pose is in the first one, row by row: `T_first_second`, (N, 3, 4).

    Args:
        first, second: unit quaternion `wxyz` and position [m], (N, 7). placed: written.
    """
    a, b = np.empty((3, 4)), np.empty((3, 4))
    for n in range(placed.shape[0]):
        put_pose(first[n], a)
        put_pose(second[n], b)
        compose_inverse(a, b, placed[n])


@kernel
def put_pose(wxyz_xyz: Floats, out: Floats) -> None:
    """Write a pose as a matrix, (3, 4)."""
    w, x, y, z = wxyz_xyz[0], wxyz_xyz[1], wxyz_xyz[2], wxyz_xyz[3]
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    for k in range(3):
        out[k, 3] = wxyz_xyz[4 + k]
