"""Close the fingers of a hand for many poses of an object in one call (METHOD.md section 4)."""

from __future__ import annotations

from .advance import make_work
from .closing import close_item
from .compiling import allocating_kernel, inner_allocating_kernel, inner_kernel
from .exact import ExactArrays
from .family_section import cut_first_families
from .handing import whole
from .layout import ChainArrays, ClosingArrays, Floats, HandArrays, Ints, ItemArrays, RoundArrays, SectionArrays, Work
from .overlap import look_for_overlaps
from .sweeping import SweepWork, make_sweep_work
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


@allocating_kernel
def close_poses(
    hand: HandArrays,
    exact: ExactArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    closed: bool,
    T_palm_object: Floats,
    link_pose: Floats,
    length: Floats,
    items: ItemArrays,
    asked: Ints,
    shared: SectionArrays,
    own: SectionArrays,
    overlaps: Ints,
    answers: ClosingArrays,
) -> None:
    """Cut the object, look for overlaps at the start, and close items once, joint after joint, for every pose.

    Args:
        hand, exact, tree, rounds, closed, items: see `close_items`. T_palm_object: where the object is, (N, 3, 4).
        link_pose, length: that of `exact` and of the chain for every pose, (N, ...), or for all of them, (1, ...).
        asked: whether an item is to be closed at a pose, (N, I); answers of others are left as they are.
        shared, own: arenas of sections. overlaps: see `look_for_overlaps`, (N, E); such entries are not closed.
        answers: see `ClosingArrays`, with the poses first; `overflow` is written for all items of a pose.
    """
    work = make_work(hand.chain.rate.shape[0], hand.outlines)
    sweep = make_sweep_work(hand.chain.rate.shape[0], exact.checked.shape[0])
    for n in range(T_palm_object.shape[0]):
        answer, T, one = answer_at(answers, n), T_palm_object[n], min(n, link_pose.shape[0] - 1)
        overflow = cut_first_families(hand, tree, rounds, T, shared, work.pose)
        if overflow > 0:
            answer.overflow[:] = overflow
            continue
        look_for_overlaps(hand, tree, rounds, closed, T, shared, overlaps[n], work)
        fingers, placed = with_lengths(hand, length[one]), with_links(exact, link_pose[one])
        close_pose(
            fingers, placed, tree, rounds, closed, T, items, asked[n], shared, own, overlaps[n], work, sweep, answer
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
    """Close the items that are asked for at one pose, (I,), and overlap nothing at the start; see `close_poses`."""
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
