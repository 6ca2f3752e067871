"""Links that only move along curl planes which lie apart never meet (docs/method.md section 1)."""

from __future__ import annotations

import math

from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays
from clench.kernels.toi.separating_planes import lanes_apart
from clench.kernels.toi.toi_links import lane_of

from .finger_motion import SPREAD
from .meeting_layout import FingerLinks, MeetingWork


@kernel
def put_finger_lanes(
    full_width: FullWidthArrays, fingers: FingerLinks, finger_posture: int, n: Vector, workspace: MeetingWork
) -> None:
    """Write between which coordinates along a unit vector the links of a finger stay, however it moves.

    A turn about an axis moves nothing along it, and a turn about another one at most by its arc times the sine of the
    angle between them.
    """
    first, last = full_width.joint_first[finger_posture], full_width.joint_first[finger_posture + 1]
    spread = SPREAD * (last - first) * fingers.tilt[finger_posture]
    for k in range(fingers.first[finger_posture], fingers.first[finger_posture + 1]):
        link, way = fingers.link[k], 0.0
        for j in range(first, fingers.joint[k] + 1):
            across = cross((full_width.axis[j, 0], full_width.axis[j, 1], full_width.axis[j, 2]), n)
            sine = min(math.sqrt(dot(across, across)) + spread, 1.0)
            way += sine * abs(workspace.final[j]) * fingers.arm[k, j]
        low, high = lane_of(full_width.links.box[link], full_width.link_pose[finger_posture, link], n[0], n[1], n[2])
        workspace.lane[k, 0], workspace.lane[k, 1] = low - way, high + way


@kernel
def leave_out_lanes(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    one: int,
    other: int,
    begin: int,
    end: int,
    workspace: MeetingWork,
) -> None:
    """Mark as free to the end the pairs of two fingers' links that lie apart along an axis of either.

    Args:
        one, other: finger postures of the fingers. begin, end: range of their pairs.
    """
    for turn in range(2):
        finger_posture = one if turn == 0 else other
        for j in range(full_width.joint_first[finger_posture], full_width.joint_first[finger_posture + 1]):
            n = (full_width.axis[j, 0], full_width.axis[j, 1], full_width.axis[j, 2])
            put_finger_lanes(full_width, fingers, one, n, workspace)
            put_finger_lanes(full_width, fingers, other, n, workspace)
            for p in range(begin, end):
                m, r = workspace.lane[workspace.pair[p, 2]], workspace.lane[workspace.pair[p, 3]]
                if lanes_apart((m[0], m[1]), (r[0], r[1])):
                    workspace.at[p] = math.inf
