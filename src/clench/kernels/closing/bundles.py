"""Bundles with a few other arrays: of one of many poses, with other links in the way, or with other limits."""

from __future__ import annotations

from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.runtime.by_reference import whole
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import ExactArrays

from .layout import ChainArrays, ClosingArrays, Floats, HandArrays, Ints


@kernel(allocates=True)
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


@kernel
def clear_answer(answer: ClosingArrays, i: int) -> None:
    """Make an item's answer what the closing starts from."""
    answer.travel[i] = 0.0
    answer.turn[i] = 0.0
    answer.contacts[i], answer.overflow[i], answer.skipped[i] = 0, 0, 0
    answer.overlap[i] = -1


@kernel(allocates=True)
def among(exact: ExactArrays, wanted: Ints, obj: BodyArrays, link_pose: Floats, checked: Ints) -> ExactArrays:
    """Return what sweeps read, for other items and another object, with links elsewhere and others to be checked."""
    return ExactArrays(
        exact.joint_first,
        wanted,
        whole(exact.links),
        whole(obj),
        exact.mover_first,
        exact.mover_link,
        exact.mover_joint,
        exact.mover_pose,
        exact.axis,
        exact.anchor,
        link_pose,
        checked,
    )


@kernel(allocates=True)
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
