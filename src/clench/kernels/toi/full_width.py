"""The full width: where the links are, what overlaps, and how a pair touches (docs/method.md section 5)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import (
    CONTACT_AXIS_GROUP,
    CONTACT_DOF,
    CONTACT_FEATURE,
    CONTACT_GAP,
    CONTACT_KIND,
    CONTACT_OUTLINE,
    CONTACT_PLANE,
    CONTACT_SOURCE,
    CONTACT_WHICH,
    KIND_SIDE,
    KIND_TIP,
    KIND_VERTEX,
    ChainArrays,
    Floats,
    Ints,
)
from clench.kernels.geometry.bodies import BodyArrays, pack_bodies
from clench.kernels.geometry.core_distance import AT_CORNER, edge_count, face_normal, separation
from clench.kernels.geometry.crossing import across
from clench.kernels.geometry.link_boxes import boxes_meet
from clench.kernels.geometry.vectors import Vector, dot, plus, scaled
from clench.kernels.grid.grid_bound import is_box_off
from clench.kernels.hulls.near_elements import list_touching
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose_inverse, copy_pose

from .separating import side
from .spatial_motion import turned_about
from .toi_work import SweepWork, bodies_overlap, make_sweep_work, put_core

#: Bodies that a shift by this takes off each other do not overlap [m].
PRESSED = 1e-8


class FirstMeetings(NamedTuple):
    """What the links of each finger posture meet of the hand itself on their first path segment, whatever the object.

    Args:
        rates: of every joint there, (E, J).
        known: up to which gap links touch [m], how far the segment was swept, below 0 where it was not, and the travel
            of the meeting, (E, 3).
        met: see `sweep_stage`, then `SweepWork.winner`, and how many pairs of links were left alone, (E, 6).
    """

    rates: Floats
    known: Floats
    met: Ints


class FullWidthArrays(NamedTuple):
    """The input of the full-width sweeps; L links of the hand, M moving links of all finger postures, J joints.

    Args:
        joint_first: first joint of each finger posture, (E + 1,).
        requested: whether each candidate sweeps the full width, (I,).
        links: one body per link of the hand, in link frames. object: one body, in the object's frame.
        mover_first: first moving link of each finger posture, (E + 1,). mover_link: index in the hand, (M,).
        mover_joint: last joint that moves it, (M,). mover_pose: `T_palm_link` at the open posture, (M, 3, 4).
        axis, anchor: of every joint in the palm frame at the open posture [m], (J, 3) each; a positive turn is
            right-handed about the axis.
        link_pose: `T_palm_link` of every link at each finger posture's open posture, (E, L, 3, 4).
        checked: whether a moving link (row) must not overlap a resting one, (L, L).
        first: see `FirstMeetings`. alone: the links that rest are where `first` assumes them.
    """

    joint_first: Ints
    requested: Ints
    links: BodyArrays
    object: BodyArrays
    mover_first: Ints
    mover_link: Ints
    mover_joint: Ints
    mover_pose: Floats
    axis: Floats
    anchor: Floats
    link_pose: Floats
    checked: Ints
    first: FirstMeetings
    alone: bool


def no_first(finger_postures: int, joints: int) -> FirstMeetings:
    """Return that no meeting on a first path segment is known."""
    rates, known = np.zeros((finger_postures, joints)), np.full((finger_postures, 3), -1.0)
    return FirstMeetings(rates, known, np.zeros((finger_postures, 6), np.int64))


def planes_only(candidates: int, finger_postures: int) -> FullWidthArrays:
    """Return what closes so many candidates of so many finger postures on their planes alone."""
    nothing = pack_bodies([])
    return FullWidthArrays(
        joint_first=np.zeros(finger_postures + 1, np.int64),
        requested=np.zeros(candidates, np.int64),
        links=nothing,
        object=nothing,
        mover_first=np.zeros(finger_postures + 1, np.int64),
        mover_link=np.zeros(0, np.int64),
        mover_joint=np.zeros(0, np.int64),
        mover_pose=np.zeros((0, 3, 4)),
        axis=np.zeros((0, 3)),
        anchor=np.zeros((0, 3)),
        link_pose=np.zeros((finger_postures, 0, 3, 4)),
        checked=np.zeros((0, 0), np.int64),
        first=no_first(finger_postures, 0),
        alone=False,
    )


@kernel
def turn_about(axis: Floats, anchor: Floats, turn: float, T: Floats) -> None:
    """Turn a pose about an axis, in place."""
    x, y, z = axis[0], axis[1], axis[2]
    s, v = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2
    for k in range(4):
        px, py, pz = T[0, k], T[1, k], T[2, k]
        if k == 3:
            px, py, pz = px - anchor[0], py - anchor[1], pz - anchor[2]
        cx, cy, cz = y * pz - z * py, z * px - x * pz, x * py - y * px
        T[0, k] += s * cx + v * (y * cz - z * cy)
        T[1, k] += s * cy + v * (z * cx - x * cz)
        T[2, k] += s * cz + v * (x * cy - y * cx)


@kernel
def pose_movers(
    full_width: FullWidthArrays, chain: ChainArrays, finger_posture: int, turns: Floats, poses: Floats
) -> None:
    """Write `T_palm_link` of a finger posture's moving links at the present turns to `poses`, (L, 3, 4)."""
    for n in range(full_width.mover_first[finger_posture], full_width.mover_first[finger_posture + 1]):
        T = poses[full_width.mover_link[n]]
        copy_pose(full_width.mover_pose[n], T)
        for j in range(full_width.mover_joint[n], full_width.joint_first[finger_posture] - 1, -1):
            if turns[j] != 0.0:
                turn_about(full_width.axis[j], full_width.anchor[j], turns[j], T)


@kernel
def place_axes(full_width: FullWidthArrays, finger_posture: int, turns: Floats, sweep: SweepWork) -> None:
    """Write the axes and anchors of a finger posture's joints at the present turns to `sweep`, in the palm frame."""
    begin, end = full_width.joint_first[finger_posture], full_width.joint_first[finger_posture + 1]
    for j in range(begin, end):
        axis = (full_width.axis[j, 0], full_width.axis[j, 1], full_width.axis[j, 2])
        at = (full_width.anchor[j, 0], full_width.anchor[j, 1], full_width.anchor[j, 2])
        for k in range(j - begin):
            i = j - 1 - k
            about = (full_width.axis[i, 0], full_width.axis[i, 1], full_width.axis[i, 2])
            pivot = (full_width.anchor[i, 0], full_width.anchor[i, 1], full_width.anchor[i, 2])
            axis = turned_about(axis, about, turns[i])
            at = plus(pivot, turned_about(plus(at, scaled(pivot, -1.0)), about, turns[i]))
        sweep.axis[j, 0], sweep.axis[j, 1], sweep.axis[j, 2] = axis
        sweep.anchor[j, 0], sweep.anchor[j, 1], sweep.anchor[j, 2] = at


@kernel
def keep_pair(sweep: SweepWork) -> None:
    """Keep the pair that was found last as the winner of the stage."""
    for k in range(4):
        sweep.winner[k] = sweep.pair[k]


@kernel
def last_mover(full_width: FullWidthArrays, finger_posture: int, link: int, last: int) -> int:
    """Return the last joint of a finger posture that moves a link; `last` where that is later, or none does."""
    for n in range(full_width.mover_first[finger_posture], full_width.mover_first[finger_posture + 1]):
        if full_width.mover_link[n] == link:
            last = max(last, full_width.mover_joint[n])
    return int(last)


@kernel
def overlap_truly(
    links: BodyArrays, m: int, resting: BodyArrays, r: int, allowed: float, flush: bool, sweep: SweepWork
) -> bool:
    """Say whether a link crosses another body, and not only presses on it; see `bodies_overlap`.

    Bodies that come to a stop cross by at most the rounding and the touch tolerance: a shift by `PRESSED` separates
    them, across a face or along two edges of the elements that cross. Bodies that lie in each other still cross then.

    Args:
        sweep: has their poses.
    """
    # Planes between hulls part most bodies, even those that touch: these stop a little before.
    if list_touching(links, m, resting, r, 0.0, sweep) == 0:
        return False
    listed = list_touching(links, m, resting, r, 2.0 * PRESSED, sweep)
    if listed == 0 or not bodies_overlap(links, m, resting, r, allowed, flush, listed, sweep):
        return False
    i, k = sweep.pair[0], sweep.pair[1]
    ka, kb = links.corners[i], resting.corners[k]
    edges, others = edge_count(ka), edge_count(kb)
    for way in range(2 * (2 + edges * others + 2 * (edges + others))):
        put_core(links, i, sweep.moving, sweep.core)
        put_core(resting, k, sweep.resting, sweep.fixed)
        spans, n = pressed_along(sweep.core, ka, sweep.fixed, kb, way // 2)
        if not spans:
            continue
        step = PRESSED if way % 2 == 0 else -PRESSED
        x, y, z = sweep.moving[0, 3], sweep.moving[1, 3], sweep.moving[2, 3]
        sweep.moving[0, 3], sweep.moving[1, 3], sweep.moving[2, 3] = plus((x, y, z), scaled(n, step))
        apart = not bodies_overlap(links, m, resting, r, allowed, flush, listed, sweep)
        sweep.moving[0, 3], sweep.moving[1, 3], sweep.moving[2, 3] = x, y, z
        if apart:
            return False
    return True


@kernel
def pressed_along(a: Floats, ka: int, b: Floats, kb: int, number: int) -> tuple[bool, Vector]:
    """Return whether there is a unit direction of a number, and it: across a face of either core, or across two edges.

    Where a face meets an edge that is taken for one: across both, the other core lies beside the face.
    """
    faces, edges, others = 2, edge_count(ka), edge_count(kb)
    if number < faces:
        return face_across(a, ka, b, kb, number)
    number -= faces
    if number < edges * others:
        spans, m = across(side(a, ka, number // others), side(b, kb, number % others))
    else:
        number -= edges * others
        found, n = face_across(a, ka, b, kb, number // (edges + others))
        k = number % (edges + others)
        spans, m = across(side(a, ka, k) if k < edges else side(b, kb, k - edges), n)
        spans = spans and found
    return spans, scaled(m, 1.0 / math.sqrt(dot(m, m))) if spans else m


@kernel
def face_across(a: Floats, ka: int, b: Floats, kb: int, number: int) -> tuple[bool, Vector]:
    """Return whether the first (0) or second (1) of two cores is a face, and its unit normal."""
    if (ka if number == 0 else kb) < 3:
        return False, (0.0, 0.0, 0.0)
    nx, ny, nz, size = face_normal(a) if number == 0 else face_normal(b)
    return size > 0.0, (nx, ny, nz)


@entry_kernel(allocates=True)
def find_link_overlap(
    full_width: FullWidthArrays, poses: Floats, T_palm_object: Floats, allowed: float
) -> tuple[int, int]:
    """Return a link that overlaps the object (whose number is that of all links) or another link, or -1 and -1.

    Args:
        full_width: the hand and the object. poses: `T_palm_link` of every link, (L, 3, 4). T_palm_object: (3, 4).
        allowed: how far round bodies may overlap [m].
    """
    return link_overlap(full_width, poses, T_palm_object, allowed, make_sweep_work(0, full_width.checked.shape[0]))


@kernel
def link_overlap(
    full_width: FullWidthArrays, poses: Floats, T_palm_object: Floats, allowed: float, sweep: SweepWork
) -> tuple[int, int]:
    """Return what `find_link_overlap` does, with scratch space."""
    links = full_width.checked.shape[0]
    for m in range(links):
        copy_pose(poses[m], sweep.moving)
        copy_pose(T_palm_object, sweep.resting)
        if not is_off_object(full_width, m, sweep) and overlap_truly(
            full_width.links, m, full_width.object, 0, allowed, True, sweep
        ):
            return m, links
        for r in range(m):
            if full_width.checked[m, r] != 0 and boxes_meet(full_width.links.box, poses, m, r):
                copy_pose(poses[r], sweep.resting)
                if overlap_truly(full_width.links, m, full_width.links, r, allowed, False, sweep):
                    return m, r
    return -1, -1


@kernel
def is_off_object(full_width: FullWidthArrays, m: int, sweep: SweepWork) -> bool:
    """Say whether the object's grid tells that no surface of a link touches the object's; `sweep` has their poses."""
    box, T = full_width.links.box[m], sweep.begun
    if full_width.links.root[m] < 0:
        return True
    compose_inverse(sweep.resting, sweep.moving, T)
    middle, half = (box[0], box[1], box[2]), (box[3], box[4], box[5])
    return bool(is_box_off(full_width.object, middle, half, T, sweep.stack))


@kernel
def describe_pair(
    full_width: FullWidthArrays,
    T_palm_object: Floats,
    met: int,
    dof: int,
    axis_group: int,
    sweep: SweepWork,
    contact: Ints,
    point: Floats,
) -> None:
    """Write how the winning pair touches with the links at `sweep.poses`; the point is in the palm frame."""
    i, k, m = sweep.winner[0], sweep.winner[1], sweep.winner[2]
    resting = full_width.object if met == full_width.checked.shape[0] else full_width.links
    T = T_palm_object if met == full_width.checked.shape[0] else sweep.poses[met]
    put_core(full_width.links, i, sweep.poses[m], sweep.core)
    put_core(resting, k, T, sweep.fixed)
    d, nx, ny, nz, feature, _, x, y, z = separation(
        sweep.core, full_width.links.corners[i], sweep.fixed, resting.corners[k]
    )
    w = resting.radius[k]
    (
        contact[CONTACT_PLANE],
        contact[CONTACT_OUTLINE],
        contact[CONTACT_SOURCE],
        contact[CONTACT_DOF],
        contact[CONTACT_AXIS_GROUP],
    ) = -1, m, k, dof, axis_group
    contact[CONTACT_FEATURE], contact[CONTACT_WHICH] = i, met
    if full_width.links.radius[i] > 0.0:
        contact[CONTACT_KIND] = KIND_TIP if feature == AT_CORNER else KIND_SIDE
    else:
        contact[CONTACT_KIND] = KIND_VERTEX + feature
    point[0], point[1], point[2] = x + w * nx, y + w * ny, z + w * nz
    point[3], point[4], point[5] = nx, ny, nz
    point[CONTACT_GAP] = d - w - full_width.links.radius[i]
