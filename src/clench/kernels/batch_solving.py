"""Solve a packed problem at many poses, one after another, in one call (docs/method.md sections 4 to 6)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .advance import make_work
from .batch_closing import among, answer_at, clear_answer, with_lengths
from .batch_judging import judge_pose, make_scratch
from .batch_layout import ObjectArrays, Solved, Wanted
from .batch_sequence import block_pose, place_one
from .closing import close_item
from .compiling import allocating_kernel, inner_allocating_kernel, inner_kernel
from .exact import ExactArrays
from .family_section import cut_first_families, needs_planes
from .frames import FrameArrays
from .layout import ClosingArrays, Floats, HandArrays, Ints, ItemArrays, SectionArrays, Work
from .link_meshes import DepthWork, LinkMeshArrays, ObjectMesh
from .overlap import look_for_overlaps
from .sweeping import SweepWork, make_sweep_work
from .touches import SurfaceArrays


class Asked(NamedTuple):
    """Hold what does not change from pose to pose.

    Args:
        hand, exact, items: see `close_items`. target: the object; nothing: none. frames: kinematics of the hand.
        surface, mesh: the object, as contacts are read and depths measured. meshes: of the links.
        across, apart: see `close_in_turn`.
    """

    hand: HandArrays
    exact: ExactArrays
    items: ItemArrays
    target: ObjectArrays
    nothing: ObjectArrays
    frames: FrameArrays
    surface: SurfaceArrays
    mesh: ObjectMesh
    meshes: LinkMeshArrays
    across: Ints
    apart: Ints


class Room(NamedTuple):
    """Hold what is written over and over.

    Args:
        shared, own: sections of all first families, and of an entry's later ones. no_shared, no_own: of no object.
        spare: answers of all items.
    """

    shared: SectionArrays
    own: SectionArrays
    no_shared: SectionArrays
    no_own: SectionArrays
    spare: ClosingArrays


class Closed(NamedTuple):
    """Hold how the fingers closed; N poses, I items, E entries.

    Args:
        answers: of all items, with the poses first.
        blocked: whether an entry overlaps the object before anything moves, (N, E).
        anew: whether an item was closed again, with other fingers in its way, (N, I).
        overflow: 0 for a pose that is solved; else the capacity wanted, or anything where it was not yet tried, (N,).
    """

    answers: ClosingArrays
    blocked: Ints
    anew: Ints
    overflow: Ints


class Turn(NamedTuple):
    """Hold what is written over and over while fingers close in turn.

    Args:
        placed: `T_palm_link` when each finger begins, (E, L, 3, 4). length: travel of all groups, (G,).
        q, angles: of all joints, (J,). poses: (L + 2, 3, 4). asked: items to close, (I,). overlaps: (E,).
    """

    placed: Floats
    length: Floats
    q: Floats
    angles: Floats
    poses: Floats
    asked: Ints
    overlaps: Ints


@allocating_kernel
def solve_poses(
    asked: Asked, wanted: Wanted, T_palm_objects: Floats, room: Room, found: Closed, solved: Solved
) -> None:
    """Close the fingers, each with the earlier ones in its way, and judge the answers, for poses that are not solved.

    Args:
        asked, wanted: what is asked. T_palm_objects: where the object is, (N, 3, 4). room: scratch space.
        found, solved: written.
    """
    hand, exact, items, frames, target = asked.hand, asked.exact, asked.items, asked.frames, asked.target
    meshes, mesh, surface = asked.meshes, asked.mesh, asked.surface
    joints, links, entries = hand.chain.rate.shape[0], exact.checked.shape[0], wanted.thumb.shape[0]
    work, sweep = make_work(joints, hand.outlines), make_sweep_work(joints, links)
    scratch = make_scratch(entries, frames.lower.shape[0], links, items.entry.shape[0], solved.number.shape[2])
    turn = Turn(
        np.empty((entries, links, 3, 4)),
        np.zeros(hand.chain.group_length.shape[0]),
        wanted.start.copy(),
        wanted.start.copy(),
        np.empty((links + 2, 3, 4)),
        np.empty(items.entry.shape[0], dtype=np.int64),
        np.empty(entries, dtype=np.int64),
    )
    judged = among(exact, target.bodies, exact.link_pose, asked.across)
    for n in range(T_palm_objects.shape[0]):
        if found.overflow[n] == 0:
            continue
        T, answer = T_palm_objects[n], answer_at(found.answers, n)
        blocked, anew = found.blocked[n], found.anew[n]
        found.overflow[n] = close_free(
            hand, exact, target, mesh, meshes, items, wanted, T, room, turn, work, sweep, scratch.depth, answer, blocked
        )
        if found.overflow[n] == 0 and wanted.whole:
            found.overflow[n] = close_in_turn(asked, wanted, T, room, turn, work, sweep, answer, blocked, anew)
        if found.overflow[n] == 0:
            judge_pose(
                hand, judged, frames, surface, mesh, meshes, items, wanted, T, answer, blocked, scratch, solved, n
            )


@inner_kernel
def close_free(
    hand: HandArrays,
    exact: ExactArrays,
    target: ObjectArrays,
    mesh: ObjectMesh,
    meshes: LinkMeshArrays,
    items: ItemArrays,
    wanted: Wanted,
    T_palm_object: Floats,
    room: Room,
    turn: Turn,
    work: Work,
    sweep: SweepWork,
    depth: DepthWork,
    answer: ClosingArrays,
    blocked: Ints,
) -> int:
    """Close all items without the other fingers, and write which entries are blocked; return the capacity wanted or 0.

    Where too much was wanted nothing else that is written is of use.
    """
    tree, rounds = target.tree, target.rounds
    overflow = 0
    for entry in range(blocked.shape[0]):
        turn.overlaps[entry] = -1
    if needs_planes(items):
        overflow = cut_first_families(hand, tree, rounds, T_palm_object, room.shared, work.pose)
        if overflow > 0:
            return int(overflow)
        look_for_overlaps(hand, tree, rounds, target.closed, T_palm_object, room.shared, turn.overlaps, work)
    for i in range(items.entry.shape[0]):
        turn.asked[i] = 1
    close_asked(hand, exact, target, T_palm_object, items, room.shared, room.own, turn, work, sweep, answer)
    for i in range(items.entry.shape[0]):
        overflow = max(overflow, answer.overflow[i])
    link_pose, overlaps = exact.link_pose, turn.overlaps
    block_pose(link_pose, meshes, items, wanted, mesh, T_palm_object, overlaps, depth, answer, blocked)
    return int(overflow)


@inner_kernel
def close_asked(
    hand: HandArrays,
    exact: ExactArrays,
    target: ObjectArrays,
    T_palm_object: Floats,
    items: ItemArrays,
    shared: SectionArrays,
    own: SectionArrays,
    turn: Turn,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Close the items that `turn` asks for once, joint after joint, but for entries that overlap at the start.

    Args:
        hand, exact, T_palm_object, items, shared, own: see `close_items`. target: the object.
        answer: written; those of items that are not asked for are left as they are.
    """
    for i in range(items.entry.shape[0]):
        if not turn.asked[i]:
            continue
        clear_answer(answer, i)
        if turn.overlaps[items.entry[i]] >= 0:
            continue
        close_item(
            hand,
            exact,
            target.tree,
            target.rounds,
            target.closed,
            T_palm_object,
            shared,
            own,
            items,
            i,
            1,
            False,
            work,
            sweep,
            answer,
        )


@inner_allocating_kernel
def close_in_turn(
    asked: Asked,
    wanted: Wanted,
    T_palm_object: Floats,
    room: Room,
    turn: Turn,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
    blocked: Ints,
    anew: Ints,
) -> int:
    """Close fingers anew that meet another one, each with the earlier ones where they are by then.

    Items are entries here: the full width of each. A finger's set stands once those before it do.

    Args:
        asked: `across` says which links may not overlap, those of different fingers among them, and `apart` says those
            alone, (L, L). answer: written. anew: written with which items were closed again, (I,).

    Returns:
        the capacity wanted, or 0.
    """
    hand, exact, items, target, nothing = asked.hand, asked.exact, asked.items, asked.target, asked.nothing
    first, count = 0, items.entry.shape[0]
    for i in range(count):
        anew[i] = 0
    while True:
        place_one(hand, asked.frames, wanted, answer.travel, turn.placed, turn.length, turn.q, turn.angles, turn.poses)
        bounded, others = with_lengths(hand, turn.length), among(exact, nothing.bodies, turn.placed, asked.apart)
        k = first_meeting(bounded, others, nothing, T_palm_object, items, room, first, work, sweep, blocked)
        if k < 0:
            return 0
        for i in range(count):
            turn.asked[i] = 1 if i == k else 0
        everything = among(exact, target.bodies, turn.placed, asked.across)
        close_asked(hand, everything, target, T_palm_object, items, room.shared, room.own, turn, work, sweep, answer)
        if answer.overflow[k] > 0:
            return int(answer.overflow[k])
        anew[k], first = 1, k + 1


@inner_kernel
def first_meeting(
    hand: HandArrays,
    exact: ExactArrays,
    nothing: ObjectArrays,
    T_palm_object: Floats,
    items: ItemArrays,
    room: Room,
    first: int,
    work: Work,
    sweep: SweepWork,
    blocked: Ints,
) -> int:
    """Return the first item from `first` on that meets another finger's links on the path to its set, or -1."""
    spare = room.spare
    for i in range(first, items.entry.shape[0]):
        if blocked[items.entry[i]]:
            continue
        clear_answer(spare, i)
        close_item(
            hand,
            exact,
            nothing.tree,
            nothing.rounds,
            nothing.closed,
            T_palm_object,
            room.no_shared,
            room.no_own,
            items,
            i,
            1,
            False,
            work,
            sweep,
            spare,
        )
        if spare.contacts[i] > 0 or spare.skipped[i] > 0:
            return i
    return -1
