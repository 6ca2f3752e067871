"""Closing a finger, one degree of freedom after another (METHOD.md section 4), for every candidate at once."""

from __future__ import annotations

import math

import numpy as np

from clench.base.tolerances import PASSED_GAP, TOUCH_FRACTION

from .advance import advance, make_work, place_joints, put_outline
from .compiling import inner_kernel, kernel
from .conics import region_gap, support
from .family_pose import compose_inverse, pose_family
from .family_section import cut_planes
from .layout import (
    HIT_CURVE_X,
    HIT_CURVE_Z,
    HIT_FAMILY,
    HIT_FEATURE,
    HIT_GAP,
    HIT_GROUP,
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
    OutlineArrays,
    RoundArrays,
    SectionArrays,
    Work,
)
from .outline_gap import core_distance, outline_distance, point_segment
from .tree import MeshTree


@inner_kernel
def outline_point(outlines: OutlineArrays, work: Work, o: int, v: int) -> tuple[float, float]:
    """Return where a vertex of an outline is at the placed joints."""
    j = outlines.joint[o]
    x, z = outlines.vertex[v, 0], outlines.vertex[v, 1]
    c, s = math.cos(work.place[j, 2]), math.sin(work.place[j, 2])
    return c * x - s * z + work.place[j, 0], s * x + c * z + work.place[j, 1]


@inner_kernel
def side_normal(outlines: OutlineArrays, work: Work, o: int, side: int, which: int) -> tuple[float, float]:
    """Return the outward normal of a touching link side at the placed joints; `which` >= 2 is its other face."""
    angle = work.place[outlines.joint[o], 2]
    c, s = math.cos(angle), math.sin(angle)
    if which >= 2:
        c, s = -c, -s
    return c * outlines.side[side, 0] - s * outlines.side[side, 1], s * outlines.side[side, 0] + c * outlines.side[
        side, 1
    ]


@inner_kernel
def touch_segment(
    outlines: OutlineArrays, segment: Floats, work: Work
) -> tuple[float, float, float, float, float, float]:
    """Return point, object normal and curve normal of a touch on a segment or its ends."""
    kind, o, feature, which = work.best[0], work.best[1], work.best[2], work.best[4]
    cx, cz = segment[4], segment[5]
    end = which & 1
    ox, oz = segment[2 * end], segment[2 * end + 1]
    if kind == KIND_SIDE:
        nx, nz = side_normal(outlines, work, o, feature, which)
        nx, nz = -nx, -nz
    else:
        vx, vz = outline_point(outlines, work, o, feature)
        if which >= 2:
            size = math.hypot(vx - ox, vz - oz)
            nx, nz = (vx - ox) / size, (vz - oz) / size
        else:
            nx, nz = (-cx, -cz) if which == 1 else (cx, cz)
            w = outlines.radius[o]
            # At a grazing touch the foot is known to the root of the tolerance only: keep the point on the segment.
            _, ox, oz = point_segment(vx - w * nx, vz - w * nz, segment[0], segment[1], segment[2], segment[3])
    if cx * nx + cz * nz < 0.0:
        cx, cz = -cx, -cz
    return ox, oz, nx, nz, cx, cz


@inner_kernel
def touch_round(
    outlines: OutlineArrays, sections: SectionArrays, row: int, work: Work
) -> tuple[float, float, float, float]:
    """Return point and normal of a touch on a disk or an ellipse of the object."""
    kind, o, feature = work.best[0], work.best[1], work.best[2]
    source, which, shape = work.best[3], work.best[4], work.best[5]
    nx, nz = 0.0, 0.0
    vx, vz = 0.0, 0.0
    if kind == KIND_SIDE:
        nx, nz = side_normal(outlines, work, o, feature, which)
        nx, nz = -nx, -nz
    else:
        vx, vz = outline_point(outlines, work, o, feature)
    if shape == 1:
        x, z, radius = sections.disks[row, source]
        if kind != KIND_SIDE:
            size = math.hypot(vx - x, vz - z)
            nx, nz = (vx - x) / size, (vz - z) / size
        return x + radius * nx, z + radius * nz, nx, nz
    e = sections.ellipses[row, source]
    if kind == KIND_SIDE:
        size, _, t = support(e, nx, nz)
        y = e[5] * e[5] * (-nx * e[3] + nz * e[2]) / size
        return e[0] + t * e[2] - y * e[3], e[1] + t * e[3] + y * e[2], nx, nz
    _, nx, nz, x, z = region_gap(e, vx, vz)
    return x, z, nx, nz


@inner_kernel
def describe_hit(
    hand: HandArrays,
    sections: SectionArrays,
    base: int,
    family: int,
    plane: int,
    group: int,
    turns: Floats,
    work: Work,
    hit: Ints,
    point: Floats,
) -> None:
    """Write where and how the winner of `advance` touches, at the posture it was stopped in."""
    place_joints(hand.chain, family, turns, work.place)
    row = plane - base
    source, shape = work.best[3], work.best[5]
    hit[HIT_PLANE], hit[HIT_OUTLINE], hit[HIT_KIND] = plane, work.best[1], work.best[0]
    hit[HIT_GROUP], hit[HIT_FAMILY] = group, family
    hit[HIT_FEATURE], hit[HIT_WHICH] = work.best[2], work.best[4]
    if shape == 0:
        hit[HIT_SOURCE] = sections.sources[row, source]
        x, z, nx, nz, cx, cz = touch_segment(hand.outlines, sections.segments[row, source], work)
    else:
        hit[HIT_SOURCE] = sections.disk_sources[row, source] if shape == 1 else sections.ellipse_sources[row, source]
        x, z, nx, nz = touch_round(hand.outlines, sections, row, work)
        cx, cz = nx, nz
    point[HIT_X], point[HIT_Z], point[HIT_NX], point[HIT_NZ] = x, z, nx, nz
    point[HIT_CURVE_X], point[HIT_CURVE_Z] = cx, cz


@inner_kernel
def close_group(
    hand: HandArrays,
    group: int,
    family: int,
    sections: SectionArrays,
    base: int,
    low: int,
    high: int,
    closed: bool,
    travel: float,
    turns: Floats,
    rates: Floats,
    work: Work,
) -> tuple[float, int]:
    """Move one degree of freedom on to its first contact or limit; return its travel and the contact's plane.

    The travel at which a follower starts or stops moving (its own limit) splits the motion into path segments.
    """
    chain = hand.chain
    length = chain.group_length[group]
    joints = rates.shape[0]
    while travel < length:
        end = length
        for j in range(joints):
            rates[j] = 0.0
            if chain.joint_group[j] == group:
                if chain.start[j] <= travel < chain.stop[j]:
                    rates[j] = chain.rate[j]
                    end = min(end, chain.stop[j])
                elif travel < chain.start[j]:
                    end = min(end, chain.start[j])
        # A little further, so that a touch just at the end is one; no point moves by more than the touch tolerance.
        reach = end - travel + TOUCH_FRACTION
        moved, plane = advance(hand, family, sections, base, low, high, closed, turns, rates, reach, work)
        moved = min(moved, end - travel)
        for j in range(joints):
            turns[j] += rates[j] * moved
        if plane >= 0:
            return travel + moved, plane
        travel = end
    return travel, -1


@inner_kernel
def group_family(hand: HandArrays, group: int) -> int:
    """Return the family of a group's joints."""
    for j in range(hand.chain.joint_group.shape[0]):
        if hand.chain.joint_group[j] == group:
            return int(hand.chain.joint_family[j])
    return -1


@inner_kernel
def enter_family(
    hand: HandArrays,
    family: int,
    start: int,
    tree: MeshTree,
    rounds: RoundArrays,
    T_palm_object: Floats,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    work: Work,
    answer: ClosingArrays,
) -> None:
    """Place a family at an item's present posture and, unless it is the entry's first, cut the object by its planes."""
    pose_family(hand, family, family == start, answer.turn[i], work.place, answer.pose[i])
    if family > start:
        T = np.empty((3, 4))
        compose_inverse(answer.pose[i, family], T_palm_object, T)
        low, high = hand.family_plane[family] + items.low[i], hand.family_plane[family] + items.high[i]
        wanted = cut_planes(hand, family, low, high, tree, rounds, T, own, hand.family_plane[start])
        answer.overflow[i] = max(answer.overflow[i], wanted)


@inner_kernel
def settle_hits(
    hand: HandArrays, start: int, shared: SectionArrays, own: SectionArrays, i: int, work: Work, answer: ClosingArrays
) -> None:
    """Evaluate an item's contacts again at its final posture; what later motions carried along gets its new place."""
    for n in range(answer.contacts[i]):
        family, plane, o = answer.hit[i, n, HIT_FAMILY], answer.hit[i, n, HIT_PLANE], answer.hit[i, n, HIT_OUTLINE]
        sections, row = shared, plane
        if family > start:
            sections, row = own, plane - hand.family_plane[start]
        place_joints(hand.chain, family, answer.turn[i], work.place)
        outline = put_outline(hand.outlines, o, hand.outlines.joint[o], work.place, 0.0, 0.0, 1.0, work)
        point = answer.point[i, n]
        if answer.hit[i, n, HIT_KIND] == KIND_SIDE:
            feature, which = answer.hit[i, n, HIT_FEATURE], answer.hit[i, n, HIT_WHICH]
            nx, nz = side_normal(hand.outlines, work, o, feature, which)
            point[HIT_NX], point[HIT_NZ] = -nx, -nz
        gap, _, _ = core_distance(outline, point[HIT_X], point[HIT_Z], work)
        point[HIT_GAP] = gap - outline.radius
        if abs(point[HIT_GAP]) > TOUCH_FRACTION * hand.family_length[family]:
            gap, x, z = outline_distance(outline, sections, row, work)
            point[HIT_GAP] = gap
            if gap <= PASSED_GAP:
                point[HIT_X], point[HIT_Z] = x, z


@inner_kernel
def close_item(
    hand: HandArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    closed: bool,
    T_palm_object: Floats,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    times: int,
    work: Work,
    answer: ClosingArrays,
) -> None:
    """Close one item: its groups from the palm outwards, `times` over."""
    entry = items.entry[i]
    start = hand.entry_family[entry]
    rates = np.zeros(hand.chain.rate.shape[0])
    for _ in range(times):
        family = start - 1
        for group in range(hand.entry_group[entry], hand.entry_group[entry + 1]):
            wanted = group_family(hand, group)
            while family < wanted:
                family += 1
                enter_family(hand, family, start, tree, rounds, T_palm_object, own, items, i, work, answer)
            sections, base = shared, 0
            if family > start:
                sections, base = own, hand.family_plane[start]
            low, high = hand.family_plane[family] + items.low[i], hand.family_plane[family] + items.high[i]
            travel, plane = close_group(
                hand,
                group,
                family,
                sections,
                base,
                low,
                high,
                closed,
                answer.travel[i, group],
                answer.turn[i],
                rates,
                work,
            )
            answer.travel[i, group] = travel
            # In a further round a group's contact takes the place of its earlier one.
            n = 0
            while n < answer.contacts[i] and answer.hit[i, n, HIT_GROUP] != group:
                n += 1
            if plane >= 0 and n < answer.hit.shape[1]:
                describe_hit(
                    hand,
                    sections,
                    base,
                    family,
                    plane,
                    group,
                    answer.turn[i],
                    work,
                    answer.hit[i, n],
                    answer.point[i, n],
                )
                answer.contacts[i] = max(answer.contacts[i], n + 1)
    settle_hits(hand, start, shared, own, i, work, answer)


@kernel
def close_items(
    hand: HandArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    closed: bool,
    T_palm_object: Floats,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    times: int,
    answer: ClosingArrays,
) -> None:
    """Close every item of work (METHOD.md section 4, *proximal first*).

    Args:
        hand: the fingers. tree, rounds, closed: the object in its own frame; `closed` when its winding is known.
        T_palm_object: where it is, shape (3, 4).
        shared: sections with every entry's first family, by global plane. own: arena for later families, with a row for
            every plane of the largest entry.
        items: what to close. times: how often all groups are gone through.
        answer: written; `travel`, `turn`, `contacts` and `overflow` must be zero.
    """
    work = make_work(hand.chain.rate.shape[0], hand.outlines)
    for i in range(items.entry.shape[0]):
        close_item(hand, tree, rounds, closed, T_palm_object, shared, own, items, i, times, work, answer)
