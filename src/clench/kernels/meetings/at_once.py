"""Fingers that move at once and hold each other where they meet, at one pose (docs/method.md sections 4 and 5)."""

from __future__ import annotations

import math

from clench.kernels.closing.bundles import clear_answer
from clench.kernels.closing.close_candidate import close_on_object
from clench.kernels.closing.layout import CandidateArrays, ClosingArrays, Floats, Ints
from clench.kernels.closing.solve_layout import Closed, ProblemArrays, Workspace
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays, overlap_truly
from clench.kernels.toi.toi_work import SweepWork

from .finger_lanes import leave_out_lanes
from .finger_motion import put_motion
from .meeting_layout import FingerLinks, Meetings, MeetingWork
from .meeting_search import FREE, MEETS, first_waiting, list_pairs, look_at


@kernel(allocates=True)
def held_candidates(candidates: CandidateArrays, until: Floats) -> CandidateArrays:
    """Return candidates whose joints are held at other places of the motion."""
    return CandidateArrays(candidates.finger_posture, candidates.low, candidates.high, until)


@kernel
def set_off(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    candidates: CandidateArrays,
    chosen: Ints,
    k: int,
    since: float,
    count: int,
    workspace: MeetingWork,
) -> None:
    """Let the pairs of a chosen candidate's links go on from a place of the motion; `k` < 0: of all candidates."""
    p = 0
    while p < count:
        a, b, begin = workspace.pair[p, 0], workspace.pair[p, 1], p
        while p < count and workspace.pair[p, 0] == a and workspace.pair[p, 1] == b:
            p += 1
        if k >= 0 and k != a and k != b:
            continue
        for n in range(begin, p):
            workspace.at[n] = since if workspace.pair[n, 4] != 0 else math.inf
        leave_out_lanes(
            full_width,
            fingers,
            candidates.finger_posture[chosen[a]],
            candidates.finger_posture[chosen[b]],
            begin,
            p,
            workspace,
        )


@kernel
def leave_out_fingers(a: int, b: int, count: int, workspace: MeetingWork) -> None:
    """Leave out all pairs of links of two fingers."""
    for p in range(count):
        if workspace.pair[p, 0] == a and workspace.pair[p, 1] == b:
            workspace.pair[p, 4], workspace.at[p] = 0, math.inf


@kernel
def cross_at_first(
    full_width: FullWidthArrays, fingers: FingerLinks, p: int, workspace: MeetingWork, sweep: SweepWork
) -> bool:
    """Say whether a pair of links that was looked at last overlaps before anything moves, and does not only touch."""
    links, m, r = full_width.links, fingers.link[workspace.pair[p, 2]], fingers.link[workspace.pair[p, 3]]
    return bool(overlap_truly(links, m, links, r, 0.0, False, sweep))


@kernel
def hold_up_to(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    finger_posture: int,
    k: int,
    at: float,
    blocked: bool,
    until: Floats,
) -> int:
    """Stop the joints of a finger up to a link from a place of the motion on; return the last of them, or -1 if none.

    Args:
        k: the link, of `fingers`. blocked: nothing moves. until: of the finger's candidate, written, (J,).
    """
    if blocked or fingers.joint[k] < 0:
        return -1
    for j in range(full_width.joint_first[finger_posture], fingers.joint[k] + 1):
        until[j] = min(until[j], at)
    return int(fingers.joint[k])


@kernel
def hold_where_they_meet(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    candidates: CandidateArrays,
    chosen: Ints,
    blocked: Ints,
    p: int,
    workspace: MeetingWork,
    met: Meetings,
) -> tuple[int, int]:
    """Write how a pair of links meets that was looked at last, and hold the joints of either finger up to its link.

    Returns:
        the last joint of either that is held, or -1 where none is.
    """
    pair, at, one, other = (
        workspace.pair[p],
        workspace.at[p],
        chosen[workspace.pair[p, 0]],
        chosen[workspace.pair[p, 1]],
    )
    first, second = candidates.finger_posture[one], candidates.finger_posture[other]
    held = (
        hold_up_to(full_width, fingers, first, pair[2], at, blocked[first] != 0, workspace.until[one]),
        hold_up_to(full_width, fingers, second, pair[3], at, blocked[second] != 0, workspace.until[other]),
    )
    number, value = met.number[met.size[0]], met.value[met.size[0]]
    number[0], number[1], number[2] = one, fingers.link[pair[2]], held[0]
    number[3], number[4], number[5] = other, fingers.link[pair[3]], held[1]
    for c in range(8):
        value[c] = workspace.touch[c]
    # Two links that met rest from there on: they do not meet again.
    pair[4], workspace.at[p], met.size[0] = 0, math.inf, met.size[0] + 1
    return held


@kernel(allocates=True)
def close_at_once(
    problem: ProblemArrays,
    full_width: FullWidthArrays,
    T_palm_object: Floats,
    space: Workspace,
    chosen: Ints,
    final: ClosingArrays,
    found: Closed,
    n: int,
) -> int:
    """Close fingers anew that meet each other on their way, all of them moving at once.

    The joints of either finger up to the links that meet are held from there on, and the finger closes again.

    Args:
        full_width: of the picked candidates, with the object. space: which has these candidates.
        chosen: one candidate of every finger that is swept over its full width, (K,).
        final: answers of the picked candidates: read, and written for those that close anew.
        found: `anew`, `overlapping` and `met` are written at pose `n`. A finger that is blocked stays where it is;
            fingers that overlap another one before they move are left alone.

    Returns:
        the capacity wanted, or 0.
    """
    chain, fingers, candidates, workspace = problem.hand.chain, problem.fingers, space.picked, space.meeting
    blocked, anew, overlapping = found.blocked[n], found.anew[n], found.overlapping[n]
    met = Meetings(found.met.size[n], found.met.number[n], found.met.value[n])
    for i in range(candidates.finger_posture.shape[0]):
        anew[i], overlapping[i], workspace.until[i] = 0, 0, candidates.until[i]
    count = list_pairs(full_width, fingers, candidates, chosen, workspace)
    for k in range(chosen.shape[0]):
        finger_posture = candidates.finger_posture[chosen[k]]
        put_motion(full_width, chain, finger_posture, blocked[finger_posture] != 0, final, chosen[k], workspace)
    set_off(full_width, fingers, candidates, chosen, -1, 0.0, count, workspace)
    bound, met.size[0] = held_candidates(candidates, workspace.until), 0
    while True:
        p = first_waiting(count, workspace)
        if p < 0:
            return 0
        a, b, at = workspace.pair[p, 0], workspace.pair[p, 1], workspace.at[p]
        told = look_at(
            full_width,
            fingers,
            (candidates.finger_posture[chosen[a]], candidates.finger_posture[chosen[b]]),
            p,
            workspace,
            space.sweep,
        )
        if told == FREE:
            workspace.at[p] = math.inf
        elif told == MEETS and at == 0.0 and cross_at_first(full_width, fingers, p, workspace, space.sweep):
            overlapping[chosen[a]], overlapping[chosen[b]] = 1, 1
            leave_out_fingers(a, b, count, workspace)
        elif told == MEETS:
            held = hold_where_they_meet(full_width, fingers, candidates, chosen, blocked, p, workspace, met)
            for which in range(2):
                if held[which] < 0:
                    continue
                k, i = workspace.pair[p, which], chosen[workspace.pair[p, which]]
                clear_answer(final, i)
                first = problem.hand.first_dof[bound.finger_posture[i]]
                close_on_object(problem, full_width, bound, T_palm_object, space, final, i, first, 1, True)
                if final.overflow[i] > 0:
                    return int(final.overflow[i])
                anew[i] = 1
                put_motion(full_width, chain, candidates.finger_posture[i], False, final, i, workspace)
                set_off(full_width, fingers, candidates, chosen, k, at, count, workspace)
