"""Close after joints about another axis begin to move, in their own planes (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import TOUCH_FRACTION
from clench.kernels.closing.layout import (
    HIT_FAMILY,
    HIT_GROUP,
    HIT_NX,
    HIT_NZ,
    HIT_OUTLINE,
    HIT_PLANE,
    HIT_X,
    HIT_Z,
    SUNK,
    ChainArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    ItemArrays,
    SectionArrays,
    Work,
)
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.runtime.compiling import kernel

from .advance import place_joints
from .plane_pose import back, compose_inverse, pose_family
from .plane_sections import cut_planes
from .section_overlap import outline_overlaps
from .turning import STILL


@kernel
def enter_family(
    hand: HandArrays,
    family: int,
    start: int,
    obj: ObjectArrays,
    T_palm_object: Floats,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    swept: bool,
    work: Work,
    answer: ClosingArrays,
) -> None:
    """Place a family at an item's present posture and cut the object by its planes, unless that was done before.

    On the one plane of an item a link that did not touch may overlap the object by now: joints about another axis
    turned it there, in planes of their own. Then there is no set on this plane, and nothing moves. Items that are
    `swept` over their whole width see all links.
    """
    pose_family(hand, family, family == start, answer.turn[i], work, answer.pose[i])
    if family == start or items.low[i] >= items.high[i]:
        return
    T, base = work.pose[0], hand.family_plane[start]
    compose_inverse(answer.pose[i, family], T_palm_object, T)
    low, high = hand.family_plane[family] + items.low[i], hand.family_plane[family] + items.high[i]
    wanted = cut_planes(hand, family, low, high, obj.tree, obj.rounds, T, own, base, work.pose[1])
    answer.overflow[i] = max(answer.overflow[i], wanted)
    if wanted > 0 or swept or high - low > 1:
        return
    place_joints(hand.chain, family, answer.turn[i], work.place)
    touch = TOUCH_FRACTION * hand.family_length[family]
    for o in range(hand.plane_outline[low], hand.plane_outline[low + 1]):
        if touches_still(hand, o, i, answer):
            continue
        if outline_overlaps(hand, o, low, touch, obj.tree, obj.rounds, obj.closed, T, own, low - base, work):
            answer.travel[i], answer.turn[i] = 0.0, 0.0
            answer.contacts[i], answer.overlap[i] = 0, SUNK - hand.outlines.link[o]
            return


@kernel
def is_still_there(chain: ChainArrays, hit: Ints, last: int, turns: Floats) -> bool:
    """Say whether nothing has moved a link since it touched; `last` is the last joint that can."""
    still = True
    for j in range(last + 1):
        still = still and (chain.joint_group[j] <= hit[HIT_GROUP] or turns[j] == 0.0)
    return still


@kernel
def touches_still(hand: HandArrays, o: int, i: int, answer: ClosingArrays) -> bool:
    """Say whether the link of an outline is where it touched on an earlier family's plane."""
    outlines = hand.outlines
    for n in range(answer.contacts[i]):
        hit = answer.hit[i, n]
        same = outlines.link[hit[HIT_OUTLINE]] == outlines.link[o]
        if same and is_still_there(hand.chain, hit, outlines.joint[o], answer.turn[i]):
            return True
    return False


@kernel
def joint_of(hand: HandArrays, family: int, link: int) -> int:
    """Return the last joint of a family that moves a link, or -1 where no plane of the family cuts the link."""
    for plane in range(hand.family_plane[family], hand.family_plane[family + 1]):
        for o in range(hand.plane_outline[plane], hand.plane_outline[plane + 1]):
            if hand.outlines.link[o] == link:
                return int(hand.outlines.joint[o])
    return -1


@kernel
def is_held(
    hand: HandArrays, family: int, group: int, items: ItemArrays, i: int, work: Work, answer: ClosingArrays
) -> bool:
    """Say whether a group would press a link on that touched on an earlier family's plane: then it does not move.

    The family's own plane lies elsewhere and may show the link a little off the object or inside it, where a sweep
    would begin with neither a touch nor a gap.
    """
    if items.high[i] - items.low[i] != 1:
        return False
    chain, turns = hand.chain, answer.turn[i]
    place_joints(chain, family, turns, work.place)
    for n in range(answer.contacts[i]):
        hit, point = answer.hit[i, n], answer.point[i, n]
        met = hit[HIT_FAMILY]
        last = -1 if met == family else joint_of(hand, family, hand.outlines.link[hit[HIT_OUTLINE]])
        if last < 0 or not is_still_there(chain, hit, last, turns):
            continue
        T, T_other, y = answer.pose[i, met], answer.pose[i, family], hand.plane_offset[hit[HIT_PLANE]]
        x, _, z = carried(T, T_other, point[HIT_X], y, point[HIT_Z])
        ex, _, ez = carried(T, T_other, point[HIT_X] + point[HIT_NX], y, point[HIT_Z] + point[HIT_NZ])
        slope, lever = 0.0, 0.0
        for j in range(last + 1):
            if chain.joint_group[j] == group and chain.joint_family[j] == family:
                dx, dz = x - work.place[j, 0], z - work.place[j, 1]
                slope += chain.rate[j] * (dx * (ez - z) - dz * (ex - x))
                lever += abs(chain.rate[j]) * math.hypot(dx, dz)
        if lever > 0.0 and slope <= STILL * lever:
            return True
    return False


@kernel
def carried(T: Floats, T_other: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Map a point of one family's coordinates to those of another, by their poses, (3, 4) each."""
    return back(
        T_other,
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )
