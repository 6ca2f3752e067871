"""Closing a finger, one degree of freedom after another (METHOD.md section 4), for every candidate at once."""

from __future__ import annotations

import numpy as np

from clench.base.tolerances import TOUCH_FRACTION

from .advance import advance, make_work
from .compiling import inner_kernel, kernel
from .exact import ExactArrays, describe_pair, pose_movers, settle_pair, sweep_stage
from .family_pose import compose_inverse, pose_family
from .family_section import cut_planes
from .layout import (
    HIT_GAP,
    HIT_GROUP,
    HIT_PLANE,
    ClosingArrays,
    Floats,
    HandArrays,
    ItemArrays,
    RoundArrays,
    SectionArrays,
    Work,
)
from .sweeping import SweepWork, make_sweep_work
from .touching import describe_hit, settle_hit
from .tree import MeshTree

#: What `close_group` meets when a link overlaps the object already.
OVERLAPS = -2


@inner_kernel
def close_group(
    hand: HandArrays,
    exact: ExactArrays,
    entry: int,
    group: int,
    family: int,
    T_palm_family: Floats,
    T_palm_object: Floats,
    sections: SectionArrays,
    base: int,
    low: int,
    high: int,
    closed: bool,
    wanted: bool,
    travel: float,
    turns: Floats,
    rates: Floats,
    work: Work,
    sweep: SweepWork,
) -> tuple[float, int, int]:
    """Move one degree of freedom on to its first contact or limit.

    The travel at which a follower starts or stops moving (its own limit) splits the motion into path segments. On each
    of them the planes give a first bound, and the exact sweep, where wanted, what comes before it.

    Args:
        low, high: the range of planes in use, counted from the family's first.

    Returns:
        its travel; the plane of the contact, or -1; what the exact sweep met before that, or -1, as `sweep_stage` says;
        `OVERLAPS` instead where a link overlaps the object already.
    """
    chain = hand.chain
    length = chain.group_length[group]
    joints = rates.shape[0]
    low, high = hand.family_plane[family] + low, hand.family_plane[family] + high
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
        met = -1
        if wanted:
            size = hand.family_length[family]
            moved, met = sweep_stage(
                exact, chain, entry, family, T_palm_family, T_palm_object, size, turns, rates, moved, work, sweep
            )
            if moved < 0.0:
                return travel, -1, OVERLAPS
        for j in range(joints):
            turns[j] += rates[j] * moved
        if plane >= 0 or met >= 0:
            return travel + moved, plane, met
        travel = end
    return travel, -1, -1


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
def settle(
    hand: HandArrays,
    exact: ExactArrays,
    T_palm_object: Floats,
    start: int,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Evaluate an item's contacts again at its final posture."""
    if exact.wanted[i]:
        pose_movers(exact, hand.chain, items.entry[i], answer.turn[i], sweep.poses)
    touch = TOUCH_FRACTION * hand.family_length[start]
    for n in range(answer.contacts[i]):
        hit, point = answer.hit[i, n], answer.point[i, n]
        if hit[HIT_PLANE] < 0:
            settle_pair(exact, T_palm_object, hit, point, touch, sweep)
        else:
            settle_hit(hand, start, shared, own, answer.turn[i], hit, point, work)


@inner_kernel
def write_contact(
    hand: HandArrays,
    exact: ExactArrays,
    T_palm_object: Floats,
    sections: SectionArrays,
    base: int,
    family: int,
    group: int,
    plane: int,
    met: int,
    start: int,
    i: int,
    work: Work,
    sweep: SweepWork,
    items: ItemArrays,
    answer: ClosingArrays,
) -> None:
    """Write a group's contact; in a further round it takes the place of the group's earlier one.

    Where a plane's contact and an exact one are the same touch, the plane describes it: it says more.
    """
    n = 0
    while n < answer.contacts[i] and answer.hit[i, n, HIT_GROUP] != group:
        n += 1
    if n == answer.hit.shape[1]:
        return
    hit, point = answer.hit[i, n], answer.point[i, n]
    answer.contacts[i] = max(answer.contacts[i], n + 1)
    if plane >= 0:
        describe_hit(hand, sections, base, family, plane, group, answer.turn[i], work, hit, point)
        if met < 0:
            return
        settle_hit(hand, start, sections, sections, answer.turn[i], hit, point, work)
        if abs(point[HIT_GAP]) <= 2.0 * TOUCH_FRACTION * hand.family_length[family]:
            return
    pose_movers(exact, hand.chain, items.entry[i], answer.turn[i], sweep.poses)
    describe_pair(exact, T_palm_object, met, group, family, sweep, hit, point)


@inner_kernel
def close_item(
    hand: HandArrays,
    exact: ExactArrays,
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
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Close one item: its groups from the palm outwards, `times` over."""
    entry = items.entry[i]
    start = hand.entry_family[entry]
    rates = np.zeros(hand.chain.rate.shape[0])
    if exact.wanted[i]:
        sweep.poses[:] = exact.link_pose[entry]
    sweep.skipped[0] = 0
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
            travel, plane, met = close_group(
                hand,
                exact,
                entry,
                group,
                family,
                answer.pose[i, family],
                T_palm_object,
                sections,
                base,
                items.low[i],
                items.high[i],
                closed,
                exact.wanted[i] != 0,
                answer.travel[i, group],
                answer.turn[i],
                rates,
                work,
                sweep,
            )
            if met == OVERLAPS:
                answer.overlap[i] = sweep.winner[2]
                return
            answer.travel[i, group] = travel
            if plane >= 0 or met >= 0:
                write_contact(
                    hand,
                    exact,
                    T_palm_object,
                    sections,
                    base,
                    family,
                    group,
                    plane,
                    met,
                    start,
                    i,
                    work,
                    sweep,
                    items,
                    answer,
                )
    answer.skipped[i] = sweep.skipped[0]
    settle(hand, exact, T_palm_object, start, shared, own, items, i, work, sweep, answer)


@kernel
def close_items(
    hand: HandArrays,
    exact: ExactArrays,
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
        hand: the fingers. exact: what the exact sweeps need.
        tree, rounds, closed: the object in its own frame; `closed` when its winding is known.
        T_palm_object: where it is, shape (3, 4).
        shared: sections with every entry's first family, by global plane. own: arena for later families, with a row for
            every plane of the largest entry.
        items: what to close. times: how often all groups are gone through.
        answer: written; `travel`, `turn`, `contacts` and `overflow` must be zero.
    """
    work = make_work(hand.chain.rate.shape[0], hand.outlines)
    sweep = make_sweep_work(work.chain, exact.checked.shape[0])
    for i in range(items.entry.shape[0]):
        close_item(hand, exact, tree, rounds, closed, T_palm_object, shared, own, items, i, times, work, sweep, answer)
