"""Fingers that move at once and hold each other where they meet, at one pose (docs/method.md sections 4 and 5)."""

from __future__ import annotations

import math

from clench.kernels.runtime.compiling import inner_allocating_kernel, inner_kernel
from clench.kernels.toi.full_width import ExactArrays
from clench.kernels.toi.toi_work import SweepWork

from .bundles import clear_answer
from .close_item import close_item
from .finger_lanes import leave_out_lanes
from .finger_motion import put_motion
from .layout import ClosingArrays, Floats, HandArrays, Ints, ItemArrays, SectionArrays, Work
from .meeting_layout import FingerLinks, Meetings, MeetingWork
from .meeting_search import FREE, MEETS, first_waiting, list_pairs, look_at
from .solve_layout import ObjectArrays

#: Returned if there is no room for all meetings.
FULL = -1


@inner_allocating_kernel
def held_items(items: ItemArrays, until: Floats) -> ItemArrays:
    """Return items whose joints are held at other places of the motion."""
    return ItemArrays(items.entry, items.low, items.high, until)


@inner_kernel
def set_off(
    exact: ExactArrays,
    fingers: FingerLinks,
    items: ItemArrays,
    chosen: Ints,
    k: int,
    since: float,
    count: int,
    room: MeetingWork,
) -> None:
    """Let the pairs of a chosen item's links go on from a place of the motion; `k` < 0: those of all items."""
    p = 0
    while p < count:
        a, b, begin = room.pair[p, 0], room.pair[p, 1], p
        while p < count and room.pair[p, 0] == a and room.pair[p, 1] == b:
            p += 1
        if k >= 0 and k != a and k != b:
            continue
        for n in range(begin, p):
            room.at[n] = since if room.pair[n, 4] != 0 else math.inf
        leave_out_lanes(exact, fingers, items.entry[chosen[a]], items.entry[chosen[b]], begin, p, room)


@inner_kernel
def leave_out_fingers(a: int, b: int, count: int, room: MeetingWork) -> None:
    """Leave out all pairs of links of two fingers."""
    for p in range(count):
        if room.pair[p, 0] == a and room.pair[p, 1] == b:
            room.pair[p, 4], room.at[p] = 0, math.inf


@inner_kernel
def hold_up_to(
    exact: ExactArrays, fingers: FingerLinks, entry: int, k: int, at: float, blocked: bool, until: Floats
) -> int:
    """Stop the joints of a finger up to a link from a place of the motion on; return the last of them, or -1 if none.

    Args:
        k: the link, of `fingers`. blocked: nothing moves. until: of the finger's item, written, (J,).
    """
    if blocked or fingers.joint[k] < 0:
        return -1
    for j in range(exact.joint_first[entry], fingers.joint[k] + 1):
        until[j] = min(until[j], at)
    return int(fingers.joint[k])


@inner_kernel
def write_meeting(
    fingers: FingerLinks, chosen: Ints, p: int, joints: tuple[int, int], room: MeetingWork, met: Meetings
) -> None:
    """Write how a pair of links meets that was looked at last."""
    pair, n = room.pair[p], met.size[0]
    number, value = met.number[n], met.value[n]
    number[0], number[1], number[2] = chosen[pair[0]], fingers.link[pair[2]], joints[0]
    number[3], number[4], number[5] = chosen[pair[1]], fingers.link[pair[3]], joints[1]
    for c in range(8):
        value[c] = room.touch[c]
    met.size[0] = n + 1


@inner_allocating_kernel
def close_at_once(
    hand: HandArrays,
    exact: ExactArrays,
    target: ObjectArrays,
    T_palm_object: Floats,
    items: ItemArrays,
    shared: SectionArrays,
    own: SectionArrays,
    fingers: FingerLinks,
    chosen: Ints,
    blocked: Ints,
    room: MeetingWork,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
    anew: Ints,
    overlapping: Ints,
    met: Meetings,
) -> int:
    """Close fingers anew that meet each other on their way, all of them moving at once.

    The joints of either finger up to the links that meet are held from there on, and the finger closes again.

    Args:
        hand, exact, T_palm_object, items, shared, own: see `close_items`; `exact` has the object. target: the object.
        fingers: their links. chosen: one item of every finger that is swept over its whole width, (K,).
        blocked: whether an entry overlaps the object before anything moves, (E,); its finger stays where it is.
        room, work, sweep: scratch space. answer: read, and written for items that close anew.
        anew: written with which items closed anew, (I,). overlapping: written with which items' fingers overlap
            another one before they move, (I,); such fingers are left alone. met: written.

    Returns:
        the capacity wanted, or 0; `FULL` where there are more meetings than there is room for.
    """
    for i in range(items.entry.shape[0]):
        anew[i], overlapping[i], room.until[i] = 0, 0, items.until[i]
    bound, count = held_items(items, room.until), list_pairs(exact, fingers, items, chosen, room)
    for k in range(chosen.shape[0]):
        entry = items.entry[chosen[k]]
        put_motion(exact, hand.chain, entry, blocked[entry] != 0, answer, chosen[k], room)
    set_off(exact, fingers, items, chosen, -1, 0.0, count, room)
    met.size[0] = 0
    while True:
        p = first_waiting(count, room)
        if p < 0:
            return 0
        a, b, at = room.pair[p, 0], room.pair[p, 1], room.at[p]
        entries = (items.entry[chosen[a]], items.entry[chosen[b]])
        told = look_at(exact, fingers, entries, p, room, sweep)
        if told == FREE:
            room.at[p] = math.inf
        elif told == MEETS and at == 0.0:
            overlapping[chosen[a]], overlapping[chosen[b]] = 1, 1
            leave_out_fingers(a, b, count, room)
        elif told == MEETS and met.size[0] == met.number.shape[0]:
            return FULL
        elif told == MEETS:
            joints = (
                hold_up_to(
                    exact, fingers, entries[0], room.pair[p, 2], at, blocked[entries[0]] != 0, room.until[chosen[a]]
                ),
                hold_up_to(
                    exact, fingers, entries[1], room.pair[p, 3], at, blocked[entries[1]] != 0, room.until[chosen[b]]
                ),
            )
            write_meeting(fingers, chosen, p, joints, room, met)
            # Two links that met rest from there on: they do not meet again.
            room.pair[p, 4], room.at[p] = 0, math.inf
            for k, joint in ((a, joints[0]), (b, joints[1])):
                if joint < 0:
                    continue
                i = chosen[k]
                clear_answer(answer, i)
                close_item(
                    hand,
                    exact,
                    target,
                    T_palm_object,
                    shared,
                    own,
                    bound,
                    i,
                    1,
                    True,
                    work,
                    sweep,
                    answer,
                )
                if answer.overflow[i] > 0:
                    return int(answer.overflow[i])
                anew[i] = 1
                put_motion(exact, hand.chain, items.entry[i], False, answer, i, room)
                set_off(exact, fingers, items, chosen, k, at, count, room)
