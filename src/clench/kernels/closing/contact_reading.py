"""Read the contacts of closed fingers: link, joint, place and normal in the palm frame (docs/method.md section 4)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.kernels.geometry.link_frames import FrameArrays, place_links, put_angles, put_closed
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import back
from clench.kernels.sections.round_section import CAPSULE, CYLINDER, ELLIPSOID

from .layout import (
    CONTACT_AXIS_GROUP,
    CONTACT_CURVE_X,
    CONTACT_CURVE_Z,
    CONTACT_DOF,
    CONTACT_GAP,
    CONTACT_JOINT,
    CONTACT_KIND,
    CONTACT_NX,
    CONTACT_NZ,
    CONTACT_OUTLINE,
    CONTACT_PLANE,
    CONTACT_SOURCE,
    CONTACT_WHICH,
    CONTACT_X,
    CONTACT_Z,
    KIND_SIDE,
    CandidateArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    RoundArrays,
)

#: Columns of `PalmContactArrays.number`: link and the stopped joint (in the hand), body or -1 - link of the hand, kind,
#: plane in its axis group or -1, whether the touched body is graspable.
(
    PALM_CONTACT_LINK,
    PALM_CONTACT_JOINT,
    PALM_CONTACT_BODY,
    PALM_CONTACT_KIND,
    PALM_CONTACT_PLANE,
    PALM_CONTACT_GRASPABLE,
) = 0, 1, 2, 3, 4, 5
PALM_CONTACT_INTEGERS = 6
#: Columns of `PalmContactArrays.value`: position, normal out of the object, gap, angle of the object's curve, angle of
#: the touching side (NaN where none is), and the place along the axis group's y axis.
(
    PALM_CONTACT_POSITION,
    PALM_CONTACT_NORMAL,
    PALM_CONTACT_GAP,
    PALM_CONTACT_CURVE,
    PALM_CONTACT_SIDE,
    PALM_CONTACT_OFFSET,
) = 0, 3, 6, 7, 8, 9
PALM_CONTACT_FLOATS = 10


class PalmContactArrays(NamedTuple):
    """The contacts; I candidates, S contacts at most: `number` (I, S, 6), `value` (I, S, 10), see the columns above."""

    number: Ints
    value: Floats


class SurfaceArrays(NamedTuple):
    """The object's data for contact reading.

    Args:
        normals: of the tree's triangles, (T, 3). body: of each, (T,). rounds: its round shapes. round_body: of each.
        element_body: body of each element of `FullWidthArrays.object`. graspable: whether a body is to be grasped,
            (B,).
    """

    normals: Floats
    body: NDArray[np.int32]
    rounds: RoundArrays
    round_body: NDArray[np.int32]
    element_body: NDArray[np.int32]
    graspable: Ints


@kernel
def put_round_normal(rounds: RoundArrays, i: int, T_palm_object: Floats, position: Floats, out: Floats) -> None:
    """Write the outward unit normal of a round shape at a point of its surface, both in the palm frame."""
    pose, size, kind = rounds.pose[i], rounds.size[i], rounds.kind[i]
    x, y, z = back(T_palm_object, position[0], position[1], position[2])
    x, y, z = back(pose, x, y, z)
    if kind == ELLIPSOID:
        x, y, z = x / size[0] ** 2, y / size[1] ** 2, z / size[2] ** 2
    elif kind == CYLINDER:
        if abs(abs(z) - size[1]) < abs(math.hypot(x, y) - size[0]):
            x, y = 0.0, 0.0
        else:
            z = 0.0
    elif kind == CAPSULE:
        z -= min(max(z, -size[1]), size[1])
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = turned(pose, x / length, y / length, z / length)
    out[0], out[1], out[2] = turned(T_palm_object, x, y, z)


@kernel
def turned(T: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Turn a direction as a pose does, (3, 4)."""
    return (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z,
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z,
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z,
    )


@kernel
def is_carried(hand: HandArrays, finger_posture: int, axis_group: int, travel: Floats) -> bool:
    """Say whether joints of axis groups after a touch's own have moved."""
    for j in range(hand.chain.joint_axis_group.shape[0]):
        later = axis_group < hand.chain.joint_axis_group[j] < hand.first_axis_group[finger_posture + 1]
        if later and travel[hand.chain.joint_dof[j]] > 0.0:
            return True
    return False


@kernel(allocates=True)
def carried(
    hand: HandArrays,
    frames: FrameArrays,
    finger_posture: int,
    link: int,
    axis_group: int,
    travel: Floats,
    position: Floats,
) -> float:
    """Return how far the joints of later axis groups carried the point of a link that touched [m].

    Their planes are not those of the touch, so its outline does not tell; the distance is an upper bound of the gap.
    """
    before = travel.copy()
    for j in range(hand.chain.joint_axis_group.shape[0]):
        if axis_group < hand.chain.joint_axis_group[j] < hand.first_axis_group[finger_posture + 1]:
            before[hand.chain.joint_dof[j]] = 0.0
    first, last = hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]
    q = np.empty(frames.posture.shape[1])
    then, now = np.empty((frames.parent.shape[0], 3, 4)), np.empty((frames.parent.shape[0], 3, 4))
    put_angles(frames, finger_posture, first, last, before, q)
    place_links(frames, q, then)
    put_angles(frames, finger_posture, first, last, travel, q)
    place_links(frames, q, now)
    a, b = then[link], now[link]
    p, away = np.zeros(3), 0.0
    for c in range(3):
        for r in range(3):
            p[c] += a[r, c] * (position[r] - a[r, 3])
    for r in range(3):
        away += (b[r, 0] * p[0] + b[r, 1] * p[1] + b[r, 2] * p[2] + b[r, 3] - position[r]) ** 2
    return math.sqrt(away)


@kernel
def read_plane_contact(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    finger_posture: int,
    answer: ClosingArrays,
    i: int,
    n: int,
    T_palm_object: Floats,
    number: Ints,
    value: Floats,
) -> None:
    """Read contact `n` of candidate `i`, a touch on a plane."""
    contact, point, travel = answer.contact[i, n], answer.point[i, n], answer.travel[i]
    pose = answer.pose[i, contact[CONTACT_AXIS_GROUP]]
    plane, axis_group, source, kind = (
        contact[CONTACT_PLANE],
        contact[CONTACT_AXIS_GROUP],
        contact[CONTACT_SOURCE],
        contact[CONTACT_KIND],
    )
    offset = hand.plane_offset[plane]
    position = value[PALM_CONTACT_POSITION : PALM_CONTACT_POSITION + 3]
    for r in range(3):
        position[r] = pose[r, 0] * point[CONTACT_X] + pose[r, 1] * offset + pose[r, 2] * point[CONTACT_Z] + pose[r, 3]
    normal = value[PALM_CONTACT_NORMAL : PALM_CONTACT_NORMAL + 3]
    if source < 0:
        put_round_normal(surface.rounds, -1 - source, T_palm_object, position, normal)
    else:
        facet = surface.normals[source]
        for r in range(3):
            normal[r] = T_palm_object[r, 0] * facet[0] + T_palm_object[r, 1] * facet[1] + T_palm_object[r, 2] * facet[2]
    link = hand.outlines.link[contact[CONTACT_OUTLINE]]
    number[PALM_CONTACT_LINK], number[PALM_CONTACT_KIND] = link, kind
    number[PALM_CONTACT_BODY] = surface.body[source] if source >= 0 else surface.round_body[-1 - source]
    number[PALM_CONTACT_PLANE] = plane - hand.axis_group_plane[axis_group]
    value[PALM_CONTACT_GAP] = point[CONTACT_GAP]
    if is_carried(hand, finger_posture, axis_group, travel):
        value[PALM_CONTACT_GAP] = max(
            point[CONTACT_GAP], carried(hand, frames, finger_posture, link, axis_group, travel, position)
        )
    value[PALM_CONTACT_CURVE] = math.atan2(point[CONTACT_CURVE_X], -point[CONTACT_CURVE_Z])
    value[PALM_CONTACT_SIDE] = math.atan2(point[CONTACT_NX], -point[CONTACT_NZ]) if kind == KIND_SIDE else math.nan
    value[PALM_CONTACT_OFFSET] = offset


@kernel
def read_full_width_contact(
    surface: SurfaceArrays, links: int, contact: Ints, point: Floats, pose: Floats, number: Ints, value: Floats
) -> None:
    """Read a contact that a full-width sweep found; see the columns of `ClosingArrays.contact`."""
    met = contact[CONTACT_WHICH]
    for k in range(6):
        value[PALM_CONTACT_POSITION + k] = point[k]
    number[PALM_CONTACT_LINK], number[PALM_CONTACT_KIND], number[PALM_CONTACT_PLANE] = (
        contact[CONTACT_OUTLINE],
        contact[CONTACT_KIND],
        -1,
    )
    number[PALM_CONTACT_BODY] = surface.element_body[contact[CONTACT_SOURCE]] if met == links else -1 - met
    x, z, offset = 0.0, 0.0, 0.0
    for r in range(3):
        x += pose[r, 0] * point[3 + r]
        z += pose[r, 2] * point[3 + r]
        offset += pose[r, 1] * (point[r] - pose[r, 3])
    value[PALM_CONTACT_GAP], value[PALM_CONTACT_CURVE], value[PALM_CONTACT_OFFSET] = (
        point[CONTACT_GAP],
        math.atan2(x, -z),
        offset,
    )
    # At a contact with the side of a round link, the two surfaces have one tangent.
    value[PALM_CONTACT_SIDE] = value[PALM_CONTACT_CURVE] if contact[CONTACT_KIND] == KIND_SIDE else math.nan


@kernel
def read_contact(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    finger_posture: int,
    answer: ClosingArrays,
    i: int,
    n: int,
    T_palm_object: Floats,
    number: Ints,
    value: Floats,
) -> None:
    """Read contact `n` of candidate `i`."""
    contact, point = answer.contact[i, n], answer.point[i, n]
    pose = answer.pose[i, contact[CONTACT_AXIS_GROUP]]
    if contact[CONTACT_PLANE] < 0:
        read_full_width_contact(surface, frames.parent.shape[0], contact, point, pose, number, value)
    else:
        read_plane_contact(hand, frames, surface, finger_posture, answer, i, n, T_palm_object, number, value)
    # The stopped joint is the leader of a degree of freedom, or the last joint before those that break away.
    dof, body = contact[CONTACT_DOF], number[PALM_CONTACT_BODY]
    breaks = hand.chain.breaks[dof] != 0
    number[PALM_CONTACT_JOINT] = frames.chain_joint[contact[CONTACT_JOINT]] if breaks else frames.dof_leader[dof]
    number[PALM_CONTACT_GRASPABLE] = surface.graspable[body] if body >= 0 else 0


@entry_kernel
def read_contacts(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    candidates: CandidateArrays,
    answer: ClosingArrays,
    T_palm_object: Floats,
    palm_contacts: PalmContactArrays,
    postures: Floats,
) -> None:
    """Read the contacts of every candidate, and the angles of all joints, (I, J).

    Rows beyond `ClosingArrays.contacts` are left as they are.
    """
    for i in range(candidates.finger_posture.shape[0]):
        finger_posture = candidates.finger_posture[i]
        for n in range(answer.contacts[i]):
            number, value = palm_contacts.number[i, n], palm_contacts.value[i, n]
            read_contact(hand, frames, surface, finger_posture, answer, i, n, T_palm_object, number, value)
        first, last = hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]
        put_closed(frames, hand.chain, finger_posture, first, last, answer.travel[i], answer.turn[i], postures[i])
