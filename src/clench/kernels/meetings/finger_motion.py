"""Compute how links of simultaneously closing fingers move: places, speeds, bend of their paths along a direction."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import ChainArrays, ClosingArrays, Floats
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.full_width import FullWidthArrays, turn_about
from clench.kernels.toi.spatial_motion import turned_about

from .meeting_layout import FingerLinks, LinkPair, MeetingWork

#: Motions that differ by less are one [-].
ROUNDING = 1e-12
#: Axes of a finger posture whose directions differ by less keep to each other within so many times that.
SPREAD = 4.0


@kernel
def put_motion(
    full_width: FullWidthArrays,
    chain: ChainArrays,
    finger_posture: int,
    blocked: bool,
    answer: ClosingArrays,
    i: int,
    workspace: MeetingWork,
) -> None:
    """Write the part of the motion in which each joint of a candidate moves, its speed and its travel.

    Args:
        blocked: nothing moves. answer, i: how the candidate closed.
    """
    for j in range(full_width.joint_first[finger_posture], full_width.joint_first[finger_posture + 1]):
        speed = chain.speed[chain.joint_dof[j]]
        workspace.rate[j] = abs(chain.rate[j]) * speed
        workspace.final[j] = 0.0 if blocked else answer.turn[i, j]
        workspace.begin[j], workspace.end[j] = chain.start[j] / speed, 0.0
        if workspace.final[j] != 0.0:
            workspace.end[j] = workspace.begin[j] + abs(workspace.final[j]) / workspace.rate[j]


@kernel
def place_link(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    finger_posture: int,
    k: int,
    at: float,
    workspace: MeetingWork,
    T: Floats,
) -> None:
    """Write `T_palm_link` of a link at a place of the motion, and the turns of the joints that move it.

    Args:
        finger_posture, k: of `fingers`. T: written, (3, 4).
    """
    copy_pose(full_width.link_pose[finger_posture, fingers.link[k]], T)
    for j in range(fingers.joint[k], full_width.joint_first[finger_posture] - 1, -1):
        turn = min(workspace.rate[j] * max(at - workspace.begin[j], 0.0), abs(workspace.final[j]))
        workspace.turns[j] = turn if workspace.final[j] >= 0.0 else -turn
        if turn != 0.0:
            turn_about(full_width.axis[j], full_width.anchor[j], workspace.turns[j], T)


@kernel
def last_end(
    full_width: FullWidthArrays, fingers: FingerLinks, finger_posture: int, k: int, workspace: MeetingWork
) -> float:
    """Return the motion after which a link is at rest."""
    end = 0.0
    for j in range(full_width.joint_first[finger_posture], fingers.joint[k] + 1):
        end = max(end, workspace.end[j])
    return end


@kernel
def next_change(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    finger_posture: int,
    k: int,
    at: float,
    end: float,
    workspace: MeetingWork,
) -> float:
    """Return up to where every joint that moves a link turns evenly from a place on, at most `end`."""
    for j in range(full_width.joint_first[finger_posture], fingers.joint[k] + 1):
        if at < workspace.end[j]:
            end = min(end, workspace.begin[j] if at < workspace.begin[j] else workspace.end[j])
    return end


@kernel
def speed_of(
    full_width: FullWidthArrays, fingers: FingerLinks, finger_posture: int, k: int, at: float, workspace: MeetingWork
) -> float:
    """Return a bound on how fast the points of a link move from a place on [m]."""
    speed = 0.0
    for j in range(full_width.joint_first[finger_posture], fingers.joint[k] + 1):
        if at < workspace.end[j]:
            speed += workspace.rate[j] * fingers.arm[k, j]
    return speed


@kernel
def put_axes(
    full_width: FullWidthArrays, fingers: FingerLinks, finger_posture: int, k: int, workspace: MeetingWork
) -> None:
    """Write the axes of the joints that move a link, in the palm frame, at the turns that `place_link` wrote."""
    for j in range(full_width.joint_first[finger_posture], fingers.joint[k] + 1):
        axis = (full_width.axis[j, 0], full_width.axis[j, 1], full_width.axis[j, 2])
        if fingers.tilt[finger_posture] > 0.0:
            for i in range(j - 1, full_width.joint_first[finger_posture] - 1, -1):
                if workspace.turns[i] != 0.0:
                    axis = turned_about(
                        axis, (full_width.axis[i, 0], full_width.axis[i, 1], full_width.axis[i, 2]), workspace.turns[i]
                    )
        workspace.axis[j, 0], workspace.axis[j, 1], workspace.axis[j, 2] = axis


@kernel
def motion_along(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    finger_posture: int,
    k: int,
    n: Vector,
    at: float,
    end: float,
    workspace: MeetingWork,
) -> tuple[float, float, float]:
    """Return bounds on what the points of a link do along a unit vector between two places of the motion.

    A joint moves nothing along its axis. Its axis turns with the joints before it, by no more than they do.

    Args:
        at: where `put_axes` put the axes.

    Returns:
        how far they get, how fast they are, and how their speed changes while joints turn evenly [m].
    """
    first, count = (
        full_width.joint_first[finger_posture],
        full_width.joint_first[finger_posture + 1] - full_width.joint_first[finger_posture],
    )
    way, speed, bend, swing, lead = 0.0, 0.0, 0.0, 0.0, 0.0
    most = SPREAD * count * fingers.tilt[finger_posture]
    for j in range(first, fingers.joint[k] + 1):
        part = min(end, workspace.end[j]) - max(at, workspace.begin[j])
        if part <= 0.0:
            continue
        across = cross((workspace.axis[j, 0], workspace.axis[j, 1], workspace.axis[j, 2]), n)
        sine = min(math.sqrt(dot(across, across)) + min(most, swing), 1.0)
        rate, arm = workspace.rate[j], fingers.arm[k, j]
        way += rate * part * sine * arm
        speed += rate * sine * arm
        bend += rate * arm * (rate * sine + 2.0 * lead)
        lead += rate * sine
        swing += rate * part
    return way, speed, bend


@kernel
def even_until(pair: LinkPair, at: float, end: float) -> float:
    """Return up to where every joint that moves either of two links turns evenly from a place on, at most `end`."""
    full_width, fingers, workspace = pair.full_width, pair.fingers, pair.workspace
    (one, other), (m, r) = pair.finger_postures, pair.rows
    until = next_change(full_width, fingers, one, m, at, end, workspace)
    return next_change(full_width, fingers, other, r, at, until, workspace)


@kernel
def speeds_of(pair: LinkPair, at: float) -> float:
    """Return a bound on how fast two links approach each other from a place on [m]."""
    full_width, fingers, workspace = pair.full_width, pair.fingers, pair.workspace
    (one, other), (m, r) = pair.finger_postures, pair.rows
    speed = speed_of(full_width, fingers, one, m, at, workspace)
    return speed + speed_of(full_width, fingers, other, r, at, workspace)


@kernel
def links_of(pair: LinkPair) -> tuple[int, int]:
    """Return the numbers of two links in the hand."""
    link, (m, r) = pair.fingers.link, pair.rows
    return int(link[m]), int(link[r])


@kernel
def place_links_at(pair: LinkPair, at: float, first: Floats, second: Floats) -> None:
    """Write the poses of two links at a place of the motion, (3, 4) each, and their joints' turns."""
    full_width, fingers, workspace = pair.full_width, pair.fingers, pair.workspace
    (one, other), (m, r) = pair.finger_postures, pair.rows
    place_link(full_width, fingers, one, m, at, workspace, first)
    place_link(full_width, fingers, other, r, at, workspace, second)


@kernel
def approach_along(pair: LinkPair, n: Vector, at: float, end: float) -> tuple[float, float, float]:
    """Return the sums of the results of `motion_along` for two links, one of either finger posture."""
    full_width, fingers, workspace = pair.full_width, pair.fingers, pair.workspace
    (one, other), (m, r) = pair.finger_postures, pair.rows
    way, speed, bend = motion_along(full_width, fingers, one, m, n, at, end, workspace)
    longer, more, further = motion_along(full_width, fingers, other, r, n, at, end, workspace)
    return way + longer, speed + more, bend + further
