"""Close after joints about another axis begin to move, in their own planes (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import TOUCH_FRACTION
from clench.kernels.closing.layout import (
    CONTACT_AXIS_GROUP,
    CONTACT_DOF,
    CONTACT_NX,
    CONTACT_NZ,
    CONTACT_OUTLINE,
    CONTACT_PLANE,
    CONTACT_X,
    CONTACT_Z,
    SUNK,
    ChainArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
)
from clench.kernels.closing.solve_layout import Closing
from clench.kernels.runtime.compiling import kernel

from .advance import place_joints
from .plane_pose import back, compose_inverse, pose_axis_group
from .plane_sections import cut_planes
from .section_overlap import outline_overlaps
from .turning import STILL


@kernel
def enter_axis_group(closing: Closing, axis_group: int, i: int) -> None:
    """Place an axis group at a candidate's present posture and cut the object by its planes, unless that was done
    before.

    On the one plane of a candidate a link that did not touch may overlap the object by now: joints about another axis
    turned it there, in planes of their own. Then there is no set on this plane, and nothing moves. Candidates that
    are swept over their full width see all links.
    """
    hand, obj, own, candidates = closing.hand, closing.obj, closing.own, closing.candidates
    work, answer = closing.work, closing.answer
    start = hand.first_axis_group[candidates.finger_posture[i]]
    pose_axis_group(hand, axis_group, axis_group == start, answer.turn[i], work, answer.pose[i])
    if axis_group == start or candidates.low[i] >= candidates.high[i]:
        return
    T, base = work.pose[0], hand.axis_group_plane[start]
    compose_inverse(answer.pose[i, axis_group], closing.T_palm_object, T)
    low, high = (
        hand.axis_group_plane[axis_group] + candidates.low[i],
        hand.axis_group_plane[axis_group] + candidates.high[i],
    )
    wanted = cut_planes(hand, axis_group, (low, high), obj.tree, obj.rounds, T, own, base, work.pose[1])
    answer.overflow[i] = max(answer.overflow[i], wanted)
    if wanted > 0:
        return
    place_joints(hand.chain, axis_group, answer.turn[i], work.place)
    touch = TOUCH_FRACTION * hand.axis_group_length[axis_group]
    for o in range(hand.plane_outline[low], hand.plane_outline[low + 1]):
        if touches_still(hand, o, i, answer):
            continue
        if outline_overlaps(hand, o, low, touch, obj, T, own, low - base, work):
            answer.travel[i], answer.turn[i] = 0.0, 0.0
            answer.contacts[i], answer.overlap[i] = 0, SUNK - hand.outlines.link[o]
            return


@kernel
def is_still_there(chain: ChainArrays, contact: Ints, last: int, turns: Floats) -> bool:
    """Say whether nothing has moved a link since it touched; `last` is the last joint that can."""
    still = True
    for j in range(last + 1):
        still = still and (chain.joint_dof[j] <= contact[CONTACT_DOF] or turns[j] == 0.0)
    return still


@kernel
def touches_still(hand: HandArrays, o: int, i: int, answer: ClosingArrays) -> bool:
    """Say whether the link of an outline is where it touched on an earlier axis group's plane."""
    outlines = hand.outlines
    for n in range(answer.contacts[i]):
        contact = answer.contact[i, n]
        same = outlines.link[contact[CONTACT_OUTLINE]] == outlines.link[o]
        if same and is_still_there(hand.chain, contact, outlines.joint[o], answer.turn[i]):
            return True
    return False


@kernel
def joint_of(hand: HandArrays, axis_group: int, link: int) -> int:
    """Return the last joint of an axis group that moves a link, or -1 where none of its planes cuts the link."""
    for plane in range(hand.axis_group_plane[axis_group], hand.axis_group_plane[axis_group + 1]):
        for o in range(hand.plane_outline[plane], hand.plane_outline[plane + 1]):
            if hand.outlines.link[o] == link:
                return int(hand.outlines.joint[o])
    return -1


@kernel
def is_held(closing: Closing, axis_group: int, dof: int, i: int) -> bool:
    """Say whether a degree of freedom would press on a link that touched on a plane of an earlier axis group.

    The axis group's own plane lies elsewhere and may show the link a little off the object or inside it, where a sweep
    would begin with neither a touch nor a gap.
    """
    hand, work, answer = closing.hand, closing.work, closing.answer
    chain, turns = hand.chain, answer.turn[i]
    place_joints(chain, axis_group, turns, work.place)
    for n in range(answer.contacts[i]):
        contact, point = answer.contact[i, n], answer.point[i, n]
        met = contact[CONTACT_AXIS_GROUP]
        last = -1 if met == axis_group else joint_of(hand, axis_group, hand.outlines.link[contact[CONTACT_OUTLINE]])
        if last < 0 or not is_still_there(chain, contact, last, turns):
            continue
        T, T_other, y = answer.pose[i, met], answer.pose[i, axis_group], hand.plane_offset[contact[CONTACT_PLANE]]
        x, _, z = carried(T, T_other, point[CONTACT_X], y, point[CONTACT_Z])
        ex, _, ez = carried(T, T_other, point[CONTACT_X] + point[CONTACT_NX], y, point[CONTACT_Z] + point[CONTACT_NZ])
        slope, lever = 0.0, 0.0
        for j in range(last + 1):
            if chain.joint_dof[j] == dof and chain.joint_axis_group[j] == axis_group:
                dx, dz = x - work.place[j, 0], z - work.place[j, 1]
                slope += chain.rate[j] * (dx * (ez - z) - dz * (ex - x))
                lever += abs(chain.rate[j]) * math.hypot(dx, dz)
        if lever > 0.0 and slope <= STILL * lever:
            return True
    return False


@kernel
def carried(T: Floats, T_other: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Map a point of one axis group's coordinates to those of another, by their poses, (3, 4) each."""
    return back(
        T_other,
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )
