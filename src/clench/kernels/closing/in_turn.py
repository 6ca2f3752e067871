"""Close the chosen candidates again, one finger after another, each with the others in its way (section 5)."""

from __future__ import annotations

from clench.kernels.geometry.link_frames import put_links
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays

from .bundles import among, clear_answer, with_lengths
from .close_candidate import begin_candidate, close_dofs, close_on_object
from .layout import CONTACT_DOF, SUNK, ClosingArrays, Floats, HandArrays, Ints
from .picking import put_candidate_angles, take_joints
from .solve_layout import Closing, ProblemArrays, Workspace


@kernel(allocates=True)
def close_in_turn(
    problem: ProblemArrays,
    T_palm_object: Floats,
    space: Workspace,
    final: ClosingArrays,
    blocked: Ints,
    anew: Ints,
) -> int:
    """Close fingers anew that meet another one, each with the earlier ones where they are by then.

    A finger's set stands once the sets before it do. A finger that meets another one stops there, and closes anew from
    the next joint on: the joints before end where they did. Sets of a single plane, and those of fingers that overlap
    the object before they move, stay as they are.

    Args:
        final: answers of the picked candidates, which are overwritten. blocked: see `Closed`. anew: written where a
            finger closes anew, (F,).

    Returns:
        the capacity of the arenas that is wanted, or 0.
    """
    hand, target, nothing = problem.hand, problem.target, problem.nothing
    first = 0
    while True:
        place_fingers(problem, space, final)
        others = among(problem.full_width, space.swept, nothing.bodies, space.placed, problem.apart)
        f, dof, stops = first_meeting(
            problem, with_lengths(hand, space.length), others, T_palm_object, space, final, blocked, first
        )
        if f < 0:
            return 0
        everything = among(problem.full_width, space.swept, target.bodies, space.placed, problem.across)
        dof = undo_from(hand, space.picked.finger_posture[f], dof, final, f)
        if stops:
            # No link was left alone, so `undo_from` has not gone back further.
            stop_there(hand, dof, space.spare, final, f)
            dof += 1
        times = problem.command.times
        close_on_object(problem, everything, space.picked, T_palm_object, space, final, f, dof, times, False)
        if final.overflow[f] > 0:
            return int(final.overflow[f])
        anew[f], first = 1, f + 1


@kernel
def place_fingers(problem: ProblemArrays, space: Workspace, final: ClosingArrays) -> None:
    """Write where all links are when a finger begins to close, those before it closed already, and how far all go."""
    command, frames, q, angles = problem.command, problem.frames, space.q, space.angles
    for j in range(q.shape[0]):
        q[j] = command.start[j]
    for f in range(final.contacts.shape[0]):
        finger_posture = space.picked.finger_posture[f]
        for j in range(q.shape[0]):
            angles[j] = q[j]
        for k in range(command.joints.shape[1]):
            if command.joints[finger_posture, k] >= 0:
                angles[command.joints[finger_posture, k]] = frames.posture[
                    finger_posture, command.joints[finger_posture, k]
                ]
        put_links(frames, angles, space.poses, space.placed[finger_posture])
        for g in range(problem.hand.first_dof[finger_posture], problem.hand.first_dof[finger_posture + 1]):
            space.length[g] = final.travel[f, g]
        put_candidate_angles(problem, finger_posture, final.travel[f], final.turn[f], angles)
        take_joints(command, finger_posture, angles, q)


@kernel
def first_meeting(
    problem: ProblemArrays,
    hand: HandArrays,
    full_width: FullWidthArrays,
    T_palm_object: Floats,
    space: Workspace,
    final: ClosingArrays,
    blocked: Ints,
    first: int,
) -> tuple[int, int, bool]:
    """Return the first finger from `first` on that meets another finger's links on the path to its set, or -1.

    The second result is the degree of freedom on whose motion it does. The third one says that this degree of freedom
    ends at the meeting, which `space.spare` holds. If it is False, the whole motion has to be closed again. Fingers
    that close in several rounds, or whose joints break away, do not follow one path: they always close again.
    """
    nothing, spare, picked = problem.nothing, space.spare, space.picked
    for f in range(first, picked.finger_posture.shape[0]):
        finger_posture = picked.finger_posture[f]
        if blocked[finger_posture] or not space.swept[f] or final.overlap[f] <= SUNK:
            continue
        begin, end = hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]
        if problem.command.times > 1 or breaks_away(hand, finger_posture):
            return f, begin, False
        clear_answer(spare, f)
        closing = Closing(
            hand,
            full_width,
            nothing,
            T_palm_object,
            space.arena.no_shared,
            space.arena.no_own,
            picked,
            space.work,
            space.sweep,
            spare,
        )
        begin_candidate(closing, f)
        for dof in range(begin, end):
            close_dofs(closing, f, False, (dof, dof + 1))
            # Links that overlap at the start are left alone, and counted, wherever the finger begins anew.
            if space.sweep.skipped[0] > 0:
                return f, begin, False
            if spare.contacts[f] > 0:
                return f, dof, final.skipped[f] == 0 and spare.travel[f, dof] < hand.chain.dof_length[dof]
    return -1, -1, False


@kernel
def undo_from(hand: HandArrays, finger_posture: int, dof: int, answer: ClosingArrays, i: int) -> int:
    """Take back what a candidate's degrees of freedom did, from one on; return the first one that has to close again.

    That is an earlier one if links were left alone: their count is that of the whole closing.
    """
    if answer.skipped[i] > 0 or dof == hand.first_dof[finger_posture]:
        clear_answer(answer, i)
        return int(hand.first_dof[finger_posture])
    n = 0
    while n < answer.contacts[i] and answer.contact[i, n, CONTACT_DOF] < dof:
        n += 1
    answer.contacts[i] = n
    for g in range(dof, hand.first_dof[finger_posture + 1]):
        answer.travel[i, g] = 0.0
        for j in range(hand.chain.joint_dof.shape[0]):
            if hand.chain.joint_dof[j] == g:
                answer.turn[i, j] = 0.0
    return dof


@kernel
def stop_there(hand: HandArrays, dof: int, met: ClosingArrays, answer: ClosingArrays, i: int) -> None:
    """Let a degree of freedom of a candidate, and it alone, end where it meets another finger.

    Args:
        met: has how it ends, and the one contact. answer: of the candidate, in which it has not moved; written.
    """
    n = answer.contacts[i]
    answer.travel[i, dof] = met.travel[i, dof]
    for j in range(hand.chain.joint_dof.shape[0]):
        if hand.chain.joint_dof[j] == dof:
            answer.turn[i, j] = met.turn[i, j]
    if n < answer.contact.shape[1]:
        for k in range(answer.contact.shape[2]):
            answer.contact[i, n, k] = met.contact[i, 0, k]
        for k in range(answer.point.shape[2]):
            answer.point[i, n, k] = met.point[i, 0, k]
        answer.contacts[i] = n + 1


@kernel
def breaks_away(hand: HandArrays, finger_posture: int) -> bool:
    """Say whether joints of a finger go on when those before them are blocked."""
    breaks = False
    for g in range(hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]):
        breaks = breaks or hand.chain.breaks[g] != 0
    return breaks
