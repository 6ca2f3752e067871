"""Where the links of a hand are, and its joints' angles when groups have travelled: kinematics for kernels."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiling import allocating_kernel, inner_allocating_kernel
from .family_pose import compose, compose_inverse
from .layout import Floats, Ints


class FrameArrays(NamedTuple):
    """Hold the kinematics of a whole hand; L links, J joints, C couplings, E entries, G groups.

    Args:
        parent: of each link, -1 for the root, (L,). joint: that moves it, -1 when fixed, (L,).
        T_parent_link: at the joint's reference angle, (L, 3, 4).
        axis, anchor: of each joint in the frame of its link [m], (J, 3). reference: angle [rad], (J,).
        palm: index of the palm, (1,).
        direction: in which joints close, (J,). lower, upper: limits [rad], (J,).
        leader, follower: of each coupling, (C,). ratio: [-], offset: [rad], (C,).
        posture: open angles of each entry [rad], (E, J). group_leader: joint that leads each group, (G,).
        chain_joint: joint of the hand that each joint of `ChainArrays` is.
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
    group_leader: Ints
    chain_joint: Ints


@inner_allocating_kernel
def turn_link(axis: Floats, anchor: Floats, angle: float, T: Floats) -> None:
    """Turn a link's pose about an axis of its own frame that goes through an anchor, in place (Rodrigues)."""
    x, y, z = axis[0], axis[1], axis[2]
    s, v = math.sin(angle), 1.0 - math.cos(angle)
    R = np.empty((3, 4))
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - v * (y * y + z * z), v * x * y - s * z, v * x * z + s * y
    R[1, 0], R[1, 1], R[1, 2] = v * x * y + s * z, 1.0 - v * (x * x + z * z), v * y * z - s * x
    R[2, 0], R[2, 1], R[2, 2] = v * x * z - s * y, v * y * z + s * x, 1.0 - v * (x * x + y * y)
    for r in range(3):
        R[r, 3] = anchor[r] - R[r, 0] * anchor[0] - R[r, 1] * anchor[1] - R[r, 2] * anchor[2]
    out = np.empty((3, 4))
    compose(T, R, out)
    T[:] = out


@allocating_kernel
def place_links(frames: FrameArrays, q: Floats, poses: Floats) -> None:
    """Write `T_palm_link` of every link at a posture (J,) [rad] to `poses`, (L, 3, 4)."""
    links = frames.parent.shape[0]
    in_root = np.empty((links, 3, 4))
    local = np.empty((3, 4))
    for i in range(links):
        local[:] = frames.T_parent_link[i]
        j = frames.joint[i]
        if j >= 0:
            turn_link(frames.axis[j], frames.anchor[j], q[j] - frames.reference[j], local)
        if frames.parent[i] < 0:
            in_root[i] = local
        else:
            compose(in_root[frames.parent[i]], local, in_root[i])
    for i in range(links):
        compose_inverse(in_root[frames.palm[0]], in_root[i], poses[i])


@inner_allocating_kernel
def put_angles(frames: FrameArrays, entry: int, first: int, last: int, travel: Floats, q: Floats) -> None:
    """Write all joints' angles when the groups `first` to `last` of an entry have travelled (G,); see `FingerPlan`."""
    q[:] = frames.posture[entry]
    for g in range(first, last):
        j = frames.group_leader[g]
        q[j] = inside(q[j] + frames.direction[j] * travel[g], frames.lower[j], frames.upper[j])
    couple(frames, q)


@inner_allocating_kernel
def couple(frames: FrameArrays, q: Floats) -> None:
    """Make followers obey their couplings, each inside its limits, in place; see `Hand.coupled`."""
    for c in range(frames.leader.shape[0]):
        f = frames.follower[c]
        angle = frames.ratio[c] * q[frames.leader[c]] + frames.offset[c]
        q[f] = inside(angle, frames.lower[f], frames.upper[f])


@inner_allocating_kernel
def inside(value: float, low: float, high: float) -> float:
    """Return a value, or the limit that it passes."""
    if low > value:
        value = low
    return high if high < value else value


@allocating_kernel
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


@inner_allocating_kernel
def put_pose(wxyz_xyz: Floats, out: Floats) -> None:
    """Write a pose as a matrix, (3, 4)."""
    w, x, y, z = wxyz_xyz[0], wxyz_xyz[1], wxyz_xyz[2], wxyz_xyz[3]
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    for k in range(3):
        out[k, 3] = wxyz_xyz[4 + k]
