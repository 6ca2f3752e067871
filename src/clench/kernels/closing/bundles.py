"""Bundles with a few other arrays: of one of many poses, with other links in the way, or with other limits."""

from __future__ import annotations

from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.runtime.by_reference import by_value
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays

from .layout import ChainArrays, ClosingArrays, Floats, HandArrays, Ints


@kernel(allocates=True)
def answer_at(answers: ClosingArrays, n: int) -> ClosingArrays:
    """Return the answers of all candidates at one pose."""
    return ClosingArrays(
        answers.travel[n],
        answers.turn[n],
        answers.contacts[n],
        answers.contact[n],
        answers.point[n],
        answers.pose[n],
        answers.overflow[n],
        answers.overlap[n],
        answers.skipped[n],
    )


@kernel
def clear_answer(answer: ClosingArrays, i: int) -> None:
    """Make a candidate's answer what the closing starts from."""
    answer.travel[i] = 0.0
    answer.turn[i] = 0.0
    answer.contacts[i], answer.overflow[i], answer.skipped[i] = 0, 0, 0
    answer.overlap[i] = -1


@kernel(allocates=True)
def among(
    full_width: FullWidthArrays, requested: Ints, obj: BodyArrays, link_pose: Floats, checked: Ints
) -> FullWidthArrays:
    """Return what sweeps read, for other candidates, another object, links elsewhere and other links to be checked."""
    return FullWidthArrays(
        full_width.joint_first,
        requested,
        by_value(full_width.links),
        by_value(obj),
        full_width.mover_first,
        full_width.mover_link,
        full_width.mover_joint,
        full_width.mover_pose,
        full_width.axis,
        full_width.anchor,
        link_pose,
        checked,
        by_value(full_width.first),
        False,
    )


@kernel(allocates=True)
def with_lengths(hand: HandArrays, length: Floats) -> HandArrays:
    """Return fingers whose degrees of freedom have other limits."""
    c = hand.chain
    return HandArrays(
        hand.first_dof,
        hand.first_axis_group,
        ChainArrays(c.joint_axis_group, c.joint_dof, c.pivot, c.rate, c.start, c.stop, length, c.speed, c.breaks),
        by_value(hand.outlines),
        hand.axis_group_pose,
        hand.axis_group_plane,
        hand.plane_offset,
        hand.axis_group_reach,
        hand.axis_group_length,
        hand.plane_outline,
    )
