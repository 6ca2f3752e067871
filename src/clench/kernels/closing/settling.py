"""The contacts of a finger at its final posture: where later motions left them (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import PASSED_GAP, TOUCH_FRACTION
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_contact import settle_contact
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.sections.turning import STILL
from clench.kernels.toi.full_width import FullWidthArrays, describe_pair, keep_pair, place_axes, pose_movers
from clench.kernels.toi.toi_work import SweepWork, body_gap, elements_of, put_core

from .layout import (
    CONTACT_AXIS_GROUP,
    CONTACT_DOF,
    CONTACT_GAP,
    CONTACT_JOINT,
    CONTACT_MET,
    CONTACT_MET_SOURCE,
    CONTACT_OUTLINE,
    CONTACT_PLANE,
    CONTACT_WHICH,
    ChainArrays,
    Floats,
    Ints,
)
from .solve_layout import Closing


@kernel
def settle(closing: Closing, i: int) -> None:
    """Evaluate a candidate's contacts again at its final posture."""
    hand, full_width, candidates, answer = closing.hand, closing.full_width, closing.candidates, closing.answer
    T_palm_object, work, sweep = closing.T_palm_object, closing.work, closing.sweep
    finger_posture, turns = candidates.finger_posture[i], answer.turn[i]
    if full_width.requested[i]:
        pose_movers(full_width, hand.chain, finger_posture, turns, sweep.poses)
    start = hand.first_axis_group[finger_posture]
    touch = TOUCH_FRACTION * hand.axis_group_length[start]
    for n in range(answer.contacts[i]):
        contact, point = answer.contact[i, n], answer.point[i, n]
        if contact[CONTACT_PLANE] < 0:
            settle_pair(full_width, hand.chain, finger_posture, turns, T_palm_object, contact, point, touch, sweep)
            continue
        settle_contact(hand, start, closing.shared, closing.own, turns, contact, point, work)


@kernel
def closest_pair(
    full_width: FullWidthArrays, T_palm_object: Floats, m: int, met: int, bound: float, sweep: SweepWork
) -> float:
    """Find the closest elements of a link and of the body that it met, at `sweep.poses`; return their gap."""
    on_object = met == full_width.checked.shape[0]
    copy_pose(sweep.poses[m], sweep.moving)
    copy_pose(T_palm_object if on_object else sweep.poses[met], sweep.resting)
    resting, r = (full_width.object, 0) if on_object else (full_width.links, met)
    return body_gap(full_width.links, m, resting, r, -1, bound, 1.0, sweep)


@kernel
def closest_element(full_width: FullWidthArrays, T_palm_object: Floats, m: int, k: int, sweep: SweepWork) -> int:
    """Return the element of a link at `sweep.poses` that is closest to an element of the object."""
    links, target = full_width.links, full_width.object
    put_core(target, k, T_palm_object, sweep.fixed)
    closest, least = -1, math.inf
    begin, end = elements_of(links, m)
    for i in range(begin, end):
        put_core(links, i, sweep.poses[m], sweep.core)
        gap = separation(sweep.core, links.corners[i], sweep.fixed, target.corners[k])[0] - links.radius[i]
        if gap < least:
            closest, least = i, gap
    return closest


@kernel
def settle_pair(
    full_width: FullWidthArrays,
    chain: ChainArrays,
    finger_posture: int,
    turns: Floats,
    T_palm_object: Floats,
    contact: Ints,
    point: Floats,
    touch: float,
    sweep: SweepWork,
) -> None:
    """Evaluate a full-width contact again with the links at `sweep.poses`; it may have rolled on to other elements.

    Where the link only touches something else by now, which does not hold what was stopped, the contact is left behind.
    """
    m, met = contact[CONTACT_OUTLINE], contact[CONTACT_WHICH]
    i, k = contact[CONTACT_MET], contact[CONTACT_MET_SOURCE]
    sweep.winner[0], sweep.winner[1], sweep.winner[2] = i, k, m
    describe_pair(
        full_width, T_palm_object, met, contact[CONTACT_DOF], contact[CONTACT_AXIS_GROUP], sweep, contact, point
    )
    if abs(point[CONTACT_GAP]) <= touch:
        return
    closest_pair(full_width, T_palm_object, m, met, math.inf, sweep)
    keep_pair(sweep)
    describe_pair(
        full_width, T_palm_object, met, contact[CONTACT_DOF], contact[CONTACT_AXIS_GROUP], sweep, contact, point
    )
    if met == full_width.checked.shape[0] and point[CONTACT_GAP] <= PASSED_GAP:
        at, normal = (point[0], point[1], point[2]), (point[3], point[4], point[5])
        if not holds_exactly(full_width, chain, finger_posture, turns, contact, at, normal, sweep):
            sweep.winner[0], sweep.winner[1] = closest_element(full_width, T_palm_object, m, k, sweep), k
            describe_pair(
                full_width, T_palm_object, met, contact[CONTACT_DOF], contact[CONTACT_AXIS_GROUP], sweep, contact, point
            )


@kernel
def holds_exactly(
    full_width: FullWidthArrays,
    chain: ChainArrays,
    finger_posture: int,
    turns: Floats,
    contact: Ints,
    at: Vector,
    normal: Vector,
    sweep: SweepWork,
) -> bool:
    """Say what `holds` does of a point and a normal in the palm frame; the joints may be of several axis groups."""
    place_axes(full_width, finger_posture, turns, sweep)
    slope, lever = 0.0, 0.0
    for j in range(full_width.joint_first[finger_posture], contact[CONTACT_JOINT] + 1):
        if chain.joint_dof[j] == contact[CONTACT_DOF]:
            axis = (sweep.axis[j, 0], sweep.axis[j, 1], sweep.axis[j, 2])
            arm = (at[0] - sweep.anchor[j, 0], at[1] - sweep.anchor[j, 1], at[2] - sweep.anchor[j, 2])
            speed = cross(axis, arm)
            slope += chain.rate[j] * dot(speed, normal)
            lever += abs(chain.rate[j]) * math.sqrt(dot(speed, speed))
    return slope <= STILL * lever
