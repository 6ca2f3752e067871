"""Close every item of a plan without the other fingers, and find the fingers that cannot begin (section 4)."""

from __future__ import annotations

from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_sections import cut_first_families, needs_planes
from clench.kernels.sections.section_overlap import look_for_overlaps

from .bundles import clear_answer
from .close_item import close_item
from .layout import ClosingArrays, Floats, Ints
from .solve_layout import ProblemArrays, Workspace
from .start_overlap import CROSSED, start_overlap


@kernel
def close_free(
    problem: ProblemArrays, T_palm_object: Floats, space: Workspace, answer: ClosingArrays, crossed: Ints
) -> int:
    """Close all items without the other fingers.

    Args:
        answer: written. crossed: written with an outline of each entry that overlaps at the start, or -1, (E,).

    Returns:
        the capacity of the arenas that is wanted; then nothing that is written is of use. Else 0.
    """
    hand, items, target, command = problem.hand, problem.items, problem.target, problem.command
    shared = space.arena.shared
    overflow = 0
    for entry in range(crossed.shape[0]):
        crossed[entry] = -1
    if needs_planes(items):
        overflow = cut_first_families(hand, target.tree, target.rounds, T_palm_object, shared, space.work.pose)
        if overflow > 0:
            return int(overflow)
        if command.crossing:
            look_for_overlaps(
                hand, target.tree, target.rounds, target.closed, T_palm_object, shared, crossed, space.work
            )
    for i in range(items.entry.shape[0]):
        clear_answer(answer, i)
        if crossed[items.entry[i]] < 0:
            close_item(
                hand,
                problem.exact,
                target,
                T_palm_object,
                shared,
                space.arena.own,
                items,
                i,
                command.times,
                command.together,
                space.work,
                space.sweep,
                answer,
            )
        overflow = max(overflow, answer.overflow[i])
    return int(overflow)


@kernel
def find_blocked(
    problem: ProblemArrays,
    T_palm_object: Floats,
    space: Workspace,
    answer: ClosingArrays,
    crossed: Ints,
    blocked: Ints,
) -> None:
    """Write which entries overlap the object before anything moves, see `Closed`; their items then move nothing."""
    items, command = problem.items, problem.command
    for entry in range(blocked.shape[0]):
        link = -1
        for i in range(items.entry.shape[0]):
            if items.entry[i] == entry:
                link = max(link, answer.overlap[i])
        if crossed[entry] >= 0:
            link = problem.hand.outlines.link[crossed[entry]]
        if link >= 0:
            blocked[entry] = CROSSED + link
        else:
            blocked[entry] = start_overlap(
                problem.exact.link_pose[entry],
                problem.meshes,
                command.own[entry],
                command.resting[entry],
                problem.mesh,
                T_palm_object,
                command.whole,
                space.depth,
            )
    for i in range(items.entry.shape[0]):
        if blocked[items.entry[i]]:
            # The link stays: this may run again for the same answers.
            link = answer.overlap[i]
            clear_answer(answer, i)
            answer.overlap[i] = max(link, answer.overlap[i])
