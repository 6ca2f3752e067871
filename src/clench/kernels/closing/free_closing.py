"""Close every candidate of a plan without the other fingers, and find the fingers that cannot begin (section 4)."""

from __future__ import annotations

from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_sections import cut_first_axis_groups, needs_planes
from clench.kernels.sections.section_overlap import look_for_overlaps

from .bundles import clear_answer
from .close_candidate import close_on_object
from .layout import ClosingArrays, Floats, Ints
from .solve_layout import ProblemArrays, Workspace
from .start_overlap import CROSSED, start_overlap


@kernel
def close_free(
    problem: ProblemArrays, T_palm_object: Floats, space: Workspace, answer: ClosingArrays, crossed: Ints
) -> int:
    """Close all candidates without the other fingers.

    Args:
        answer: written. crossed: written with an outline of each finger posture that overlaps at the start, or -1,
            (E,).

    Returns:
        the capacity of the arenas that is wanted; then nothing that is written is of use. Else 0.
    """
    hand, candidates, target, command = problem.hand, problem.candidates, problem.target, problem.command
    shared = space.arena.shared
    overflow = 0
    for finger_posture in range(crossed.shape[0]):
        crossed[finger_posture] = -1
    if needs_planes(candidates):
        overflow = cut_first_axis_groups(hand, target.tree, target.rounds, T_palm_object, shared, space.work.pose)
        if overflow > 0:
            return int(overflow)
        if not command.full_width:
            look_for_overlaps(hand, target, T_palm_object, shared, crossed, space.work)
    for i in range(candidates.finger_posture.shape[0]):
        clear_answer(answer, i)
        if crossed[candidates.finger_posture[i]] < 0:
            full_width, first = problem.full_width, hand.first_dof[candidates.finger_posture[i]]
            times, together = command.times, command.together
            close_on_object(problem, full_width, candidates, T_palm_object, space, answer, i, first, times, together)
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
    """Write which finger postures overlap the object at first, see `Closed`; their candidates then move nothing."""
    candidates = problem.candidates
    for finger_posture in range(blocked.shape[0]):
        link = -1
        for i in range(candidates.finger_posture.shape[0]):
            if candidates.finger_posture[i] == finger_posture:
                link = max(link, answer.overlap[i])
        if crossed[finger_posture] >= 0:
            link = problem.hand.outlines.link[crossed[finger_posture]]
        if link >= 0:
            blocked[finger_posture] = CROSSED + link
        else:
            blocked[finger_posture] = start_overlap(problem, finger_posture, T_palm_object, space)
    for i in range(candidates.finger_posture.shape[0]):
        if blocked[candidates.finger_posture[i]]:
            # The link stays: this may run again for the same answers.
            link = answer.overlap[i]
            clear_answer(answer, i)
            answer.overlap[i] = max(link, answer.overlap[i])
