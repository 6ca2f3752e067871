"""Close the fingers of a hand at one of many poses of an object (METHOD.md section 4)."""

from __future__ import annotations

from .closing import close_item
from .compiling import inner_allocating_kernel, inner_kernel
from .exact import ExactArrays
from .handing import whole
from .layout import ChainArrays, ClosingArrays, Floats, HandArrays, Ints, ItemArrays, RoundArrays, SectionArrays, Work
from .sweeping import SweepWork
from .tree import MeshTree


@inner_allocating_kernel
def answer_at(answers: ClosingArrays, n: int) -> ClosingArrays:
    """Return the answers of all items at one pose."""
    return ClosingArrays(
        answers.travel[n],
        answers.turn[n],
        answers.contacts[n],
        answers.hit[n],
        answers.point[n],
        answers.pose[n],
        answers.overflow[n],
        answers.overlap[n],
        answers.skipped[n],
    )


@inner_kernel
def clear_answer(answer: ClosingArrays, i: int) -> None:
    """Make an item's answer what the closing starts from."""
    answer.travel[i] = 0.0
    answer.turn[i] = 0.0
    answer.contacts[i], answer.overflow[i], answer.skipped[i] = 0, 0, 0
    answer.overlap[i] = -1


@inner_allocating_kernel
def with_links(exact: ExactArrays, link_pose: Floats) -> ExactArrays:
    """Return what sweeps read, with the links elsewhere."""
    return ExactArrays(
        exact.joint_first,
        exact.wanted,
        whole(exact.links),
        whole(exact.object),
        exact.mover_first,
        exact.mover_link,
        exact.mover_joint,
        exact.mover_pose,
        exact.axis,
        exact.anchor,
        link_pose,
        exact.checked,
    )


@inner_allocating_kernel
def with_lengths(hand: HandArrays, length: Floats) -> HandArrays:
    """Return fingers whose groups have other limits."""
    c = hand.chain
    return HandArrays(
        hand.entry_group,
        hand.entry_family,
        ChainArrays(c.joint_family, c.joint_group, c.pivot, c.rate, c.start, c.stop, length, c.speed, c.breaks),
        whole(hand.outlines),
        hand.family_pose,
        hand.family_plane,
        hand.plane_offset,
        hand.family_reach,
        hand.family_length,
        hand.plane_outline,
    )


@inner_kernel
def close_pose(
    hand: HandArrays,
    exact: ExactArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    closed: bool,
    T_palm_object: Floats,
    items: ItemArrays,
    asked: Ints,
    shared: SectionArrays,
    own: SectionArrays,
    overlaps: Ints,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Close items once, joint after joint.

    Args:
        hand, exact, tree, rounds, closed, T_palm_object, items, shared, own: see `close_items`.
        asked: whether an item is to be closed, (I,); answers of others are left as they are.
        overlaps: see `look_for_overlaps`, (E,); such entries are not closed. answer: written.
    """
    for i in range(items.entry.shape[0]):
        if not asked[i]:
            continue
        clear_answer(answer, i)
        if overlaps[items.entry[i]] >= 0:
            continue
        close_item(
            hand,
            exact,
            tree,
            rounds,
            closed,
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
