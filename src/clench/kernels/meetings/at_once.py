"""Fingers that move at once and hold each other where they meet, at one pose (docs/method.md sections 4 and 5)."""

from __future__ import annotations

import math

from clench.kernels.closing.bundles import clear_answer
from clench.kernels.closing.close_item import close_item
from clench.kernels.closing.layout import ClosingArrays, Floats, HandArrays, Ints, ItemArrays, SectionArrays, Work
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import ExactArrays
from clench.kernels.toi.toi_work import SweepWork

from .finger_lanes import leave_out_lanes
from .finger_motion import put_motion
from .meeting_layout import FingerLinks, Meetings, MeetingWork
from .meeting_search import FREE, MEETS, first_waiting, list_pairs, look_at


@kernel(allocates=True)
def held_items(items: ItemArrays, until: Floats) -> ItemArrays:
    """Return items whose joints are held at other places of the motion."""
    return ItemArrays(items.entry, items.low, items.high, until)


@kernel
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


@kernel
def leave_out_fingers(a: int, b: int, count: int, room: MeetingWork) -> None:
    """Leave out all pairs of links of two fingers."""
    for p in range(count):
        if room.pair[p, 0] == a and room.pair[p, 1] == b:
            room.pair[p, 4], room.at[p] = 0, math.inf


@kernel
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


@kernel
def hold_where_they_meet(
    exact: ExactArrays,
    fingers: FingerLinks,
    items: ItemArrays,
    chosen: Ints,
    blocked: Ints,
    p: int,
    room: MeetingWork,
    met: Meetings,
) -> tuple[int, int]:
    """Write how a pair of links meets that was looked at last, and hold the joints of either finger up to its link.

    Returns:
        the last joint of either that is held, or -1 where none is.
    """
    pair, at, one, other = room.pair[p], room.at[p], chosen[room.pair[p, 0]], chosen[room.pair[p, 1]]
    first, second = items.entry[one], items.entry[other]
    held = (
        hold_up_to(exact, fingers, first, pair[2], at, blocked[first] != 0, room.until[one]),
        hold_up_to(exact, fingers, second, pair[3], at, blocked[second] != 0, room.until[other]),
    )
    number, value = met.number[met.size[0]], met.value[met.size[0]]
    number[0], number[1], number[2] = one, fingers.link[pair[2]], held[0]
    number[3], number[4], number[5] = other, fingers.link[pair[3]], held[1]
    for c in range(8):
        value[c] = room.touch[c]
    # Two links that met rest from there on: they do not meet again.
    pair[4], room.at[p], met.size[0] = 0, math.inf, met.size[0] + 1
    return held


@kernel(allocates=True)
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
        the capacity wanted, or 0.
    """
    for i in range(items.entry.shape[0]):
        anew[i], overlapping[i], room.until[i] = 0, 0, items.until[i]
    count = list_pairs(exact, fingers, items, chosen, room)
    for k in range(chosen.shape[0]):
        entry = items.entry[chosen[k]]
        put_motion(exact, hand.chain, entry, blocked[entry] != 0, answer, chosen[k], room)
    set_off(exact, fingers, items, chosen, -1, 0.0, count, room)
    bound, met.size[0] = held_items(items, room.until), 0
    while True:
        p = first_waiting(count, room)
        if p < 0:
            return 0
        a, b, at = room.pair[p, 0], room.pair[p, 1], room.at[p]
        told = look_at(exact, fingers, (items.entry[chosen[a]], items.entry[chosen[b]]), p, room, sweep)
        if told == FREE:
            room.at[p] = math.inf
        elif told == MEETS and at == 0.0:
            overlapping[chosen[a]], overlapping[chosen[b]] = 1, 1
            leave_out_fingers(a, b, count, room)
        elif told == MEETS:
            held = hold_where_they_meet(exact, fingers, items, chosen, blocked, p, room, met)
            for which in range(2):
                if held[which] < 0:
                    continue
                k, i = room.pair[p, which], chosen[room.pair[p, which]]
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
