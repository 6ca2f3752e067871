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
    HIT_CURVE_X,
    HIT_CURVE_Z,
    HIT_FAMILY,
    HIT_GAP,
    HIT_GROUP,
    HIT_JOINT,
    HIT_KIND,
    HIT_NX,
    HIT_NZ,
    HIT_OUTLINE,
    HIT_PLANE,
    HIT_SOURCE,
    HIT_WHICH,
    HIT_X,
    HIT_Z,
    KIND_SIDE,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    ItemArrays,
    RoundArrays,
)

#: Columns of `TouchArrays.number`: link and the stopped joint (in the hand), body or -1 - link of the hand, kind, plane
#: in its family or -1, whether the touched body is graspable.
TOUCH_LINK, TOUCH_JOINT, TOUCH_BODY, TOUCH_KIND, TOUCH_PLANE, TOUCH_GRASPABLE = 0, 1, 2, 3, 4, 5
TOUCH_INTEGERS = 6
#: Columns of `TouchArrays.value`: position, normal out of the object, gap, angle of the object's curve, angle of the
#: touching side (NaN where none is), and the place along the family's y axis.
TOUCH_POSITION, TOUCH_NORMAL, TOUCH_GAP, TOUCH_CURVE, TOUCH_SIDE, TOUCH_OFFSET = 0, 3, 6, 7, 8, 9
TOUCH_FLOATS = 10


class TouchArrays(NamedTuple):
    """The contacts; I items, S contacts at most: `number` (I, S, 6), `value` (I, S, 10), see the columns above."""

    number: Ints
    value: Floats


class SurfaceArrays(NamedTuple):
    """The object's data for contact reading.

    Args:
        normals: of the tree's triangles, (T, 3). body: of each, (T,). rounds: its round shapes. round_body: of each.
        element_body: body of each element of `ExactArrays.object`. graspable: whether a body is to be grasped, (B,).
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
def is_carried(hand: HandArrays, entry: int, family: int, travel: Floats) -> bool:
    """Say whether joints of families after a touch's own have moved."""
    for j in range(hand.chain.joint_family.shape[0]):
        later = family < hand.chain.joint_family[j] < hand.entry_family[entry + 1]
        if later and travel[hand.chain.joint_group[j]] > 0.0:
            return True
    return False


@kernel(allocates=True)
def carried(
    hand: HandArrays, frames: FrameArrays, entry: int, link: int, family: int, travel: Floats, position: Floats
) -> float:
    """Return how far the joints of later families carried the point of a link that touched [m].

    Their planes are not those of the touch, so its outline does not tell; the distance is an upper bound of the gap.
    """
    before = travel.copy()
    for j in range(hand.chain.joint_family.shape[0]):
        if family < hand.chain.joint_family[j] < hand.entry_family[entry + 1]:
            before[hand.chain.joint_group[j]] = 0.0
    first, last = hand.entry_group[entry], hand.entry_group[entry + 1]
    q = np.empty(frames.posture.shape[1])
    then, now = np.empty((frames.parent.shape[0], 3, 4)), np.empty((frames.parent.shape[0], 3, 4))
    put_angles(frames, entry, first, last, before, q)
    place_links(frames, q, then)
    put_angles(frames, entry, first, last, travel, q)
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
def read_plane_touch(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    entry: int,
    hit: Ints,
    point: Floats,
    pose: Floats,
    travel: Floats,
    T_palm_object: Floats,
    number: Ints,
    value: Floats,
) -> None:
    """Read a touch on a plane."""
    plane, family, source, kind = hit[HIT_PLANE], hit[HIT_FAMILY], hit[HIT_SOURCE], hit[HIT_KIND]
    offset = hand.plane_offset[plane]
    position = value[TOUCH_POSITION : TOUCH_POSITION + 3]
    for r in range(3):
        position[r] = pose[r, 0] * point[HIT_X] + pose[r, 1] * offset + pose[r, 2] * point[HIT_Z] + pose[r, 3]
    normal = value[TOUCH_NORMAL : TOUCH_NORMAL + 3]
    if source < 0:
        put_round_normal(surface.rounds, -1 - source, T_palm_object, position, normal)
    else:
        facet = surface.normals[source]
        for r in range(3):
            normal[r] = T_palm_object[r, 0] * facet[0] + T_palm_object[r, 1] * facet[1] + T_palm_object[r, 2] * facet[2]
    link = hand.outlines.link[hit[HIT_OUTLINE]]
    number[TOUCH_LINK], number[TOUCH_KIND] = link, kind
    number[TOUCH_BODY] = surface.body[source] if source >= 0 else surface.round_body[-1 - source]
    number[TOUCH_PLANE] = plane - hand.family_plane[family]
    value[TOUCH_GAP] = point[HIT_GAP]
    if is_carried(hand, entry, family, travel):
        value[TOUCH_GAP] = max(point[HIT_GAP], carried(hand, frames, entry, link, family, travel, position))
    value[TOUCH_CURVE] = math.atan2(point[HIT_CURVE_X], -point[HIT_CURVE_Z])
    value[TOUCH_SIDE] = math.atan2(point[HIT_NX], -point[HIT_NZ]) if kind == KIND_SIDE else math.nan
    value[TOUCH_OFFSET] = offset


@kernel
def read_exact_touch(
    surface: SurfaceArrays, links: int, hit: Ints, point: Floats, pose: Floats, number: Ints, value: Floats
) -> None:
    """Read a touch that an exact sweep found, anywhere over the width; see the columns of `ClosingArrays.hit`."""
    met = hit[HIT_WHICH]
    for k in range(6):
        value[TOUCH_POSITION + k] = point[k]
    number[TOUCH_LINK], number[TOUCH_KIND], number[TOUCH_PLANE] = hit[HIT_OUTLINE], hit[HIT_KIND], -1
    number[TOUCH_BODY] = surface.element_body[hit[HIT_SOURCE]] if met == links else -1 - met
    x, z, offset = 0.0, 0.0, 0.0
    for r in range(3):
        x += pose[r, 0] * point[3 + r]
        z += pose[r, 2] * point[3 + r]
        offset += pose[r, 1] * (point[r] - pose[r, 3])
    value[TOUCH_GAP], value[TOUCH_CURVE], value[TOUCH_OFFSET] = point[HIT_GAP], math.atan2(x, -z), offset
    # At a contact with the side of a round link, the two surfaces have one tangent.
    value[TOUCH_SIDE] = value[TOUCH_CURVE] if hit[HIT_KIND] == KIND_SIDE else math.nan


@kernel
def read_touch(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    entry: int,
    answer: ClosingArrays,
    i: int,
    n: int,
    T_palm_object: Floats,
    number: Ints,
    value: Floats,
) -> None:
    """Read contact `n` of item `i`."""
    hit, point = answer.hit[i, n], answer.point[i, n]
    pose = answer.pose[i, hit[HIT_FAMILY]]
    if hit[HIT_PLANE] < 0:
        read_exact_touch(surface, frames.parent.shape[0], hit, point, pose, number, value)
    else:
        read_plane_touch(hand, frames, surface, entry, hit, point, pose, answer.travel[i], T_palm_object, number, value)
    # The stopped joint is the leader of a group, or the last joint before those that break away.
    group, body = hit[HIT_GROUP], number[TOUCH_BODY]
    breaks = hand.chain.breaks[group] != 0
    number[TOUCH_JOINT] = frames.chain_joint[hit[HIT_JOINT]] if breaks else frames.group_leader[group]
    number[TOUCH_GRASPABLE] = surface.graspable[body] if body >= 0 else 0


@entry_kernel
def read_touches(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    items: ItemArrays,
    answer: ClosingArrays,
    T_palm_object: Floats,
    touches: TouchArrays,
    postures: Floats,
) -> None:
    """Read the contacts of every item, and the angles of all joints, (I, J).

    Rows beyond `ClosingArrays.contacts` are left as they are.
    """
    for i in range(items.entry.shape[0]):
        entry = items.entry[i]
        for n in range(answer.contacts[i]):
            number, value = touches.number[i, n], touches.value[i, n]
            read_touch(hand, frames, surface, entry, answer, i, n, T_palm_object, number, value)
        first, last = hand.entry_group[entry], hand.entry_group[entry + 1]
        put_closed(frames, hand.chain, entry, first, last, answer.travel[i], answer.turn[i], postures[i])
