"""Compute how links of simultaneously closing fingers move: places, speeds, bend of their paths along a direction."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import ChainArrays, ClosingArrays, Floats
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.full_width import ExactArrays, turn_about
from clench.kernels.toi.spatial_motion import turned_about

from .meeting_layout import FingerLinks, MeetingWork

#: Motions that differ by less are one [-].
ROUNDING = 1e-12
#: Axes of an entry whose directions differ by less keep to each other within so many times that.
SPREAD = 4.0


@kernel
def put_motion(
    exact: ExactArrays, chain: ChainArrays, entry: int, blocked: bool, answer: ClosingArrays, i: int, room: MeetingWork
) -> None:
    """Write the part of the motion in which each joint of an item moves, its speed and its travel.

    Args:
        blocked: nothing moves. answer, i: how the item closed.
    """
    for j in range(exact.joint_first[entry], exact.joint_first[entry + 1]):
        speed = chain.speed[chain.joint_group[j]]
        room.rate[j] = abs(chain.rate[j]) * speed
        room.final[j] = 0.0 if blocked else answer.turn[i, j]
        room.begin[j], room.end[j] = chain.start[j] / speed, 0.0
        if room.final[j] != 0.0:
            room.end[j] = room.begin[j] + abs(room.final[j]) / room.rate[j]


@kernel
def place_link(
    exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, at: float, room: MeetingWork, T: Floats
) -> None:
    """Write `T_palm_link` of a link at a place of the motion, and the turns of the joints that move it.

    Args:
        entry, k: of `fingers`. T: written, (3, 4).
    """
    copy_pose(exact.link_pose[entry, fingers.link[k]], T)
    for j in range(fingers.joint[k], exact.joint_first[entry] - 1, -1):
        turn = min(room.rate[j] * max(at - room.begin[j], 0.0), abs(room.final[j]))
        room.turns[j] = turn if room.final[j] >= 0.0 else -turn
        if turn != 0.0:
            turn_about(exact.axis[j], exact.anchor[j], room.turns[j], T)


@kernel
def last_end(exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, room: MeetingWork) -> float:
    """Return the motion after which a link is at rest."""
    end = 0.0
    for j in range(exact.joint_first[entry], fingers.joint[k] + 1):
        end = max(end, room.end[j])
    return end


@kernel
def next_change(
    exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, at: float, end: float, room: MeetingWork
) -> float:
    """Return up to where every joint that moves a link turns evenly from a place on, at most `end`."""
    for j in range(exact.joint_first[entry], fingers.joint[k] + 1):
        if at < room.end[j]:
            end = min(end, room.begin[j] if at < room.begin[j] else room.end[j])
    return end


@kernel
def speed_of(exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, at: float, room: MeetingWork) -> float:
    """Return a bound on how fast the points of a link move from a place on [m]."""
    speed = 0.0
    for j in range(exact.joint_first[entry], fingers.joint[k] + 1):
        if at < room.end[j]:
            speed += room.rate[j] * fingers.arm[k, j]
    return speed


@kernel
def put_axes(exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, room: MeetingWork) -> None:
    """Write the axes of the joints that move a link, in the palm frame, at the turns that `place_link` wrote."""
    for j in range(exact.joint_first[entry], fingers.joint[k] + 1):
        axis = (exact.axis[j, 0], exact.axis[j, 1], exact.axis[j, 2])
        if fingers.tilt[entry] > 0.0:
            for i in range(j - 1, exact.joint_first[entry] - 1, -1):
                if room.turns[i] != 0.0:
                    axis = turned_about(axis, (exact.axis[i, 0], exact.axis[i, 1], exact.axis[i, 2]), room.turns[i])
        room.axis[j, 0], room.axis[j, 1], room.axis[j, 2] = axis


@kernel
def motion_along(
    exact: ExactArrays,
    fingers: FingerLinks,
    entry: int,
    k: int,
    n: Vector,
    at: float,
    end: float,
    room: MeetingWork,
) -> tuple[float, float, float]:
    """Return bounds on what the points of a link do along a unit vector between two places of the motion.

    A joint moves nothing along its axis. Its axis turns with the joints before it, by no more than they do.

    Args:
        at: where `put_axes` put the axes.

    Returns:
        how far they get, how fast they are, and how their speed changes while joints turn evenly [m].
    """
    first, count = exact.joint_first[entry], exact.joint_first[entry + 1] - exact.joint_first[entry]
    way, speed, bend, swing, lead = 0.0, 0.0, 0.0, 0.0, 0.0
    most = SPREAD * count * fingers.tilt[entry]
    for j in range(first, fingers.joint[k] + 1):
        part = min(end, room.end[j]) - max(at, room.begin[j])
        if part <= 0.0:
            continue
        across = cross((room.axis[j, 0], room.axis[j, 1], room.axis[j, 2]), n)
        sine = min(math.sqrt(dot(across, across)) + min(most, swing), 1.0)
        rate, arm = room.rate[j], fingers.arm[k, j]
        way += rate * part * sine * arm
        speed += rate * sine * arm
        bend += rate * arm * (rate * sine + 2.0 * lead)
        lead += rate * sine
        swing += rate * part
    return way, speed, bend


@kernel
def approach_along(
    exact: ExactArrays,
    fingers: FingerLinks,
    entries: tuple[int, int],
    rows: tuple[int, int],
    n: Vector,
    at: float,
    end: float,
    room: MeetingWork,
) -> tuple[float, float, float]:
    """Return the sums of the results of `motion_along` for two links, one of either entry."""
    way, speed, bend = motion_along(exact, fingers, entries[0], rows[0], n, at, end, room)
    other, more, further = motion_along(exact, fingers, entries[1], rows[1], n, at, end, room)
    return way + other, speed + more, bend + further
