"""Close a finger, one degree of freedom after another, or all at once (docs/method.md section 4).

The groups of a finger are gone through up to `times` over, fewer where nothing moves any more. If joints of several
families move simultaneously, or in several rounds, an item has no planes: the planes of later families are cut with the
earlier joints at rest.
"""

from __future__ import annotations

from clench.core.tolerances import TOUCH_FRACTION
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.advance import advance
from clench.kernels.sections.later_planes import enter_family, is_held
from clench.kernels.sections.plane_contact import describe_hit, settle_hit
from clench.kernels.sections.plane_pose import copy_pose, pose_families
from clench.kernels.toi.full_width import ExactArrays, describe_pair, last_mover, pose_movers
from clench.kernels.toi.toi_links import sweep_stage
from clench.kernels.toi.toi_work import SweepWork

from .layout import (
    HIT_GAP,
    HIT_GROUP,
    HIT_JOINT,
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
from .segments import ALL, lock_held, lock_joints, move_groups, next_segment
from .settling import settle
from .solve_layout import ObjectArrays


@kernel
def close_group(
    hand: HandArrays,
    exact: ExactArrays,
    T_palm_object: Floats,
    sections: SectionArrays,
    base: int,
    family: int,
    group: int,
    closed: bool,
    start: int,
    items: ItemArrays,
    i: int,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> bool:
    """Move one degree of freedom, or all at once, until a contact or a limit holds every joint.

    The travel at which a follower starts or stops moving (its own limit) splits the motion into path segments. On each
    of them the planes of the item, if it has any, give a first bound, and the exact sweep, where wanted, what comes
    before it.

    Args:
        sections, base: whose row `plane - base` belongs to `plane`. family: of the planes. group: or `ALL`.
        start: the entry's first family. work: whose `locked` says which joints stand still; written.

    Returns:
        False where a link overlaps the object already.
    """
    chain, entry, turns, rates, locked = hand.chain, items.entry[i], answer.turn[i], work.rates, work.locked
    joints = entry_joints(hand, entry)
    low, high = hand.family_plane[family] + items.low[i], hand.family_plane[family] + items.high[i]
    along = 0.0
    while True:
        lock_held(chain, joints, items.until[i], along, locked)
        end = next_segment(chain, joints, group, answer.travel[i], locked, items.until[i], along, rates)
        if end <= 0.0:
            return True
        # A little further, so that a touch just at the end is one; no point moves by more than the touch tolerance.
        fastest = 0.0
        for j in range(joints[0], joints[1]):
            fastest += abs(rates[j])
        reach = end + TOUCH_FRACTION / max(fastest, 1.0)
        moved, plane = advance(hand, family, sections, base, low, high, closed, turns, rates, reach, work)
        met = -1
        if exact.wanted[i]:
            families, size = answer.pose[i], hand.family_length[family]
            pose_families(hand, entry, turns, work, families)
            moved, met = sweep_stage(
                exact, chain, entry, families, T_palm_object, size, turns, rates, moved, work, sweep
            )
            if moved < 0.0:
                answer.overlap[i] = sweep.winner[2]
                return False
        moved = min(moved, end)
        for j in range(joints[0], joints[1]):
            turns[j] += rates[j] * moved
        move_groups(chain, joints, group, answer.travel[i], locked, moved)
        along += moved
        if plane >= 0 or met >= 0:
            last = moving_joint(hand, exact, entry, met, work, sweep)
            lock_joints(chain, joints, last, locked)
            while last > joints[0] and rates[last] == 0.0:
                last -= 1
            write_contact(
                hand,
                exact,
                T_palm_object,
                sections,
                base,
                last,
                plane,
                met,
                start,
                i,
                work,
                sweep,
                items,
                answer,
            )


@kernel
def entry_joints(hand: HandArrays, entry: int) -> tuple[int, int]:
    """Return the range of an entry's joints."""
    first, groups = 0, hand.chain.joint_group
    while first < groups.shape[0] and groups[first] < hand.entry_group[entry]:
        first += 1
    last = first
    while last < groups.shape[0] and groups[last] < hand.entry_group[entry + 1]:
        last += 1
    return first, last


@kernel
def moving_joint(hand: HandArrays, exact: ExactArrays, entry: int, met: int, work: Work, sweep: SweepWork) -> int:
    """Return the last joint that moves the link which touches: by the exact sweep where `met` says so, else a plane."""
    if met < 0:
        return int(hand.outlines.joint[work.best[1]])
    return last_mover(exact, entry, sweep.winner[2], exact.joint_first[entry])


@kernel
def group_family(hand: HandArrays, group: int) -> int:
    """Return the family of a group's joints."""
    for j in range(hand.chain.joint_group.shape[0]):
        if hand.chain.joint_group[j] == group:
            return int(hand.chain.joint_family[j])
    return -1


@kernel
def stops_same(chain: ChainArrays, hit: Ints, group: int, joint: int) -> bool:
    """Say whether two contacts stop the same joints: a group, or its joints up to the ones that break away."""
    return hit[HIT_GROUP] == group and (not chain.breaks[group] or hit[HIT_JOINT] == joint)


@kernel
def write_contact(
    hand: HandArrays,
    exact: ExactArrays,
    T_palm_object: Floats,
    sections: SectionArrays,
    base: int,
    joint: int,
    plane: int,
    met: int,
    start: int,
    i: int,
    work: Work,
    sweep: SweepWork,
    items: ItemArrays,
    answer: ClosingArrays,
) -> None:
    """Write a contact that stops the group of `joint`, up to it; in a further round it takes the earlier one's place.

    If a plane's contact and an exact one are the same touch, the plane describes it, because it has more data.
    """
    family, group = hand.chain.joint_family[joint], hand.chain.joint_group[joint]
    n = 0
    while n < answer.contacts[i] and not stops_same(hand.chain, answer.hit[i, n], group, joint):
        n += 1
    if n == answer.hit.shape[1]:
        return
    hit, point = answer.hit[i, n], answer.point[i, n]
    hit[HIT_JOINT] = joint
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


@entry_kernel
def close_item(
    hand: HandArrays,
    exact: ExactArrays,
    obj: ObjectArrays,
    T_palm_object: Floats,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    times: int,
    together: bool,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Close one item: its groups from the palm outwards, up to `times` over, or all at once; see the module.

    Args:
        hand: the fingers. exact: for exact sweeps. obj: the object in its own frame, at `T_palm_object` (3, 4).
        shared, own: sections with every entry's first family, by global plane; arena for an entry's later families.
        items, i: the item. times, together: as above. work, sweep: scratch space. answer: written, cleared at row `i`.
    """
    entry = items.entry[i]
    if exact.wanted[i]:
        for link in range(sweep.poses.shape[0]):
            copy_pose(exact.link_pose[entry, link], sweep.poses[link])
    sweep.skipped[0] = 0
    # Travels of other entries' joints are never written: they would continue with the values of the item before.
    for j in range(work.rates.shape[0]):
        work.rates[j] = 0.0
    for _ in range(times):
        for j in range(work.before.shape[0]):
            work.before[j] = answer.turn[i, j]
        if not close_groups(hand, exact, obj, T_palm_object, shared, own, items, i, together, work, sweep, answer):
            return
        moved = False
        for j in range(work.before.shape[0]):
            moved = moved or answer.turn[i, j] != work.before[j]
        if not moved:
            break
    answer.skipped[i] = sweep.skipped[0]
    pose_families(hand, entry, answer.turn[i], work, answer.pose[i])
    settle(hand, exact, T_palm_object, hand.entry_family[entry], shared, own, items, i, work, sweep, answer)


@kernel
def close_groups(
    hand: HandArrays,
    exact: ExactArrays,
    obj: ObjectArrays,
    T_palm_object: Floats,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    together: bool,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> bool:
    """Close the groups of an item once, from the palm outwards, or all at once; return False where it cannot begin."""
    entry, swept = items.entry[i], exact.wanted[i] != 0
    start = hand.entry_family[entry]
    family = start - 1
    for group in range(hand.entry_group[entry], hand.entry_group[entry + 1]):
        wanted = group_family(hand, group)
        while family < wanted and answer.overlap[i] > SUNK:
            family += 1
            enter_family(hand, family, start, obj, T_palm_object, own, items, i, swept, work, answer)
        if answer.overlap[i] <= SUNK:
            break
        if family > start and not swept and is_held(hand, family, group, items, i, work, answer):
            continue
        sections, base = shared, 0
        if family > start:
            sections, base = own, hand.family_plane[start]
        for j in range(work.locked.shape[0]):
            work.locked[j] = 0
        moving = ALL if together else group
        if not close_group(
            hand,
            exact,
            T_palm_object,
            sections,
            base,
            family,
            moving,
            obj.closed,
            start,
            items,
            i,
            work,
            sweep,
            answer,
        ):
            return False
        if together:
            break
    return True
