"""Links that only move along curl planes which lie apart never meet (docs/method.md section 1)."""

from __future__ import annotations

import math

from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import ExactArrays
from clench.kernels.toi.separating_planes import lanes_apart
from clench.kernels.toi.toi_links import lane_of

from .finger_motion import SPREAD
from .meeting_layout import FingerLinks, MeetingWork


@kernel
def put_finger_lanes(exact: ExactArrays, fingers: FingerLinks, entry: int, n: Vector, room: MeetingWork) -> None:
    """Write between which coordinates along a unit vector the links of an entry's finger stay, however it moves.

    A turn about an axis moves nothing along it, and a turn about another one at most by its arc times the sine of the
    angle between them.
    """
    first, last = exact.joint_first[entry], exact.joint_first[entry + 1]
    spread = SPREAD * (last - first) * fingers.tilt[entry]
    for k in range(fingers.first[entry], fingers.first[entry + 1]):
        link, way = fingers.link[k], 0.0
        for j in range(first, fingers.joint[k] + 1):
            across = cross((exact.axis[j, 0], exact.axis[j, 1], exact.axis[j, 2]), n)
            sine = min(math.sqrt(dot(across, across)) + spread, 1.0)
            way += sine * abs(room.final[j]) * fingers.arm[k, j]
        low, high = lane_of(exact.links.box[link], exact.link_pose[entry, link], n[0], n[1], n[2])
        room.lane[k, 0], room.lane[k, 1] = low - way, high + way


@kernel
def leave_out_lanes(
    exact: ExactArrays, fingers: FingerLinks, one: int, other: int, begin: int, end: int, room: MeetingWork
) -> None:
    """Mark as free to the end the pairs of two fingers' links that lie apart along an axis of either.

    Args:
        one, other: entries of the fingers. begin, end: range of their pairs.
    """
    for turn in range(2):
        entry = one if turn == 0 else other
        for j in range(exact.joint_first[entry], exact.joint_first[entry + 1]):
            n = (exact.axis[j, 0], exact.axis[j, 1], exact.axis[j, 2])
            put_finger_lanes(exact, fingers, one, n, room)
            put_finger_lanes(exact, fingers, other, n, room)
            for p in range(begin, end):
                m, r = room.lane[room.pair[p, 2]], room.lane[room.pair[p, 3]]
                if lanes_apart((m[0], m[1]), (r[0], r[1])):
                    room.at[p] = math.inf
