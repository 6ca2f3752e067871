"""Close a finger, one degree of freedom after another, or all at once (docs/method.md section 4).

The degrees of freedom of a finger are gone through up to `times` over, fewer where nothing moves any more. If joints of
several axis groups move simultaneously, or in several rounds, a candidate has no planes: the planes of later axis
groups are cut with the earlier joints at rest.
"""

from __future__ import annotations

from clench.core.tolerances import SWEEP_FRACTION, TOUCH_FRACTION
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.advance import advance
from clench.kernels.sections.later_planes import enter_axis_group, is_held
from clench.kernels.sections.plane_contact import describe_contact
from clench.kernels.sections.plane_pose import copy_pose, pose_axis_groups
from clench.kernels.toi.full_width import FullWidthArrays, describe_pair, last_mover, pose_movers
from clench.kernels.toi.toi_links import Stage, sweep_stage
from clench.kernels.toi.toi_work import SweepWork

from .layout import (
    CONTACT_DOF,
    CONTACT_JOINT,
    CONTACT_MET,
    CONTACT_MET_SOURCE,
    SUNK,
    CandidateArrays,
    ChainArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    SectionArrays,
    Work,
)
from .segments import ALL, lock_held, lock_joints, move_dofs, next_segment
from .settling import settle
from .solve_layout import Closing, ProblemArrays, Workspace


@kernel
def close_dof(closing: Closing, sections: SectionArrays, base: int, axis_group: int, dof: int, i: int) -> bool:
    """Move one degree of freedom, or all at once, until a contact or a limit holds every joint.

    The travel at which a follower starts or stops moving (its own limit) splits the motion into path segments. On each
    of them the full-width sweep, where requested, or else the plane of the candidate gives the first contact.

    Args:
        sections, base: whose row `plane - base` belongs to `plane`. axis_group: of the planes. dof: or `ALL`.
        closing: whose `work.locked` says which joints stand still; written. i: the candidate.

    Returns:
        False where a link overlaps the object already.
    """
    hand, full_width, candidates, answer = closing.hand, closing.full_width, closing.candidates, closing.answer
    work, sweep, T_palm_object = closing.work, closing.sweep, closing.T_palm_object
    chain, finger_posture, turns = hand.chain, candidates.finger_posture[i], answer.turn[i]
    rates, locked = work.rates, work.locked
    joints = finger_posture_joints(hand, finger_posture)
    first = hand.axis_group_plane[axis_group]
    planes, along = (first + candidates.low[i], first + candidates.high[i]), 0.0
    while True:
        lock_held(chain, joints, candidates.until[i], along, locked)
        end = next_segment(chain, joints, dof, answer.travel[i], locked, candidates.until[i], along, rates)
        if end <= 0.0:
            return True
        plane, met, reach = -1, -1, beyond(end, joints, rates)
        if full_width.requested[i]:
            axis_groups = answer.pose[i]
            pose_axis_groups(hand, finger_posture, turns, work, axis_groups)
            touch = SWEEP_FRACTION * hand.axis_group_length[axis_group]
            stage = Stage(full_width, chain, finger_posture, axis_groups, T_palm_object, turns, rates, touch)
            moved, met = sweep_stage(stage, reach, work, sweep)
            if moved < 0.0:
                answer.overlap[i] = sweep.winner[2]
                return False
        else:
            closed = closing.obj.closed
            moved, plane = advance(hand, axis_group, sections, base, planes, closed, turns, rates, reach, work)
        moved = min(moved, end)
        for j in range(joints[0], joints[1]):
            turns[j] += rates[j] * moved
        move_dofs(chain, joints, dof, answer.travel[i], locked, moved)
        along += moved
        if plane >= 0 or met >= 0:
            last = moving_joint(hand, full_width, finger_posture, met, work, sweep)
            lock_joints(chain, joints, last, locked)
            while last > joints[0] and rates[last] == 0.0:
                last -= 1
            write_contact(closing, sections, base, last, plane, met, i)


@kernel
def beyond(end: float, joints: tuple[int, int], rates: Floats) -> float:
    """Return a little more than the end of a path segment, so that a touch just there is one.

    No point moves by more than the touch tolerance.
    """
    fastest = 0.0
    for j in range(joints[0], joints[1]):
        fastest += abs(rates[j])
    return end + TOUCH_FRACTION / max(fastest, 1.0)


@kernel
def finger_posture_joints(hand: HandArrays, finger_posture: int) -> tuple[int, int]:
    """Return the range of a finger posture's joints."""
    first, dofs = 0, hand.chain.joint_dof
    while first < dofs.shape[0] and dofs[first] < hand.first_dof[finger_posture]:
        first += 1
    last = first
    while last < dofs.shape[0] and dofs[last] < hand.first_dof[finger_posture + 1]:
        last += 1
    return first, last


@kernel
def moving_joint(
    hand: HandArrays, full_width: FullWidthArrays, finger_posture: int, met: int, work: Work, sweep: SweepWork
) -> int:
    """Return the last joint that moves the touching link: by the full-width sweep where `met` says so, else a plane."""
    if met < 0:
        return int(hand.outlines.joint[work.best[1]])
    return last_mover(full_width, finger_posture, sweep.winner[2], full_width.joint_first[finger_posture])


@kernel
def dof_axis_group(hand: HandArrays, dof: int) -> int:
    """Return the axis group of the joints of a degree of freedom."""
    for j in range(hand.chain.joint_dof.shape[0]):
        if hand.chain.joint_dof[j] == dof:
            return int(hand.chain.joint_axis_group[j])
    return -1


@kernel
def stops_same(chain: ChainArrays, contact: Ints, dof: int, joint: int) -> bool:
    """Say whether two contacts stop the same joints: a degree of freedom, or its part before joints that break away."""
    return contact[CONTACT_DOF] == dof and (not chain.breaks[dof] or contact[CONTACT_JOINT] == joint)


@kernel
def write_contact(
    closing: Closing, sections: SectionArrays, base: int, joint: int, plane: int, met: int, i: int
) -> None:
    """Write a contact that stops a degree of freedom up to `joint`; in a further round it replaces the earlier one."""
    hand, answer, work, finger_posture = (
        closing.hand,
        closing.answer,
        closing.work,
        closing.candidates.finger_posture[i],
    )
    axis_group, dof = hand.chain.joint_axis_group[joint], hand.chain.joint_dof[joint]
    n = 0
    while n < answer.contacts[i] and not stops_same(hand.chain, answer.contact[i, n], dof, joint):
        n += 1
    if n == answer.contact.shape[1]:
        return
    contact, point = answer.contact[i, n], answer.point[i, n]
    contact[CONTACT_JOINT] = joint
    answer.contacts[i] = max(answer.contacts[i], n + 1)
    if plane >= 0:
        describe_contact(hand, sections, base, axis_group, plane, dof, answer.turn[i], work, contact, point)
        return
    full_width, sweep = closing.full_width, closing.sweep
    pose_movers(full_width, hand.chain, finger_posture, answer.turn[i], sweep.poses)
    contact[CONTACT_MET], contact[CONTACT_MET_SOURCE] = sweep.winner[0], sweep.winner[1]
    describe_pair(full_width, closing.T_palm_object, met, dof, axis_group, sweep, contact, point)


@entry_kernel
def close_candidate(closing: Closing, i: int, times: int, together: bool) -> None:
    """Close one candidate: its degrees of freedom from the palm outwards, up to `times` over, or all at once; see the
    module.

    Args:
        i: the candidate. times, together: as above.
    """
    close_from(closing, i, times, together, closing.hand.first_dof[closing.candidates.finger_posture[i]])


@kernel
def close_from(closing: Closing, i: int, times: int, together: bool, first: int) -> None:
    """Close one candidate from a degree of freedom on, in the first pass; those before have closed already."""
    hand, answer, work, sweep = closing.hand, closing.answer, closing.work, closing.sweep
    finger_posture = closing.candidates.finger_posture[i]
    begin, end = hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]
    begin_candidate(closing, i)
    for turn in range(times):
        for j in range(work.before.shape[0]):
            work.before[j] = answer.turn[i, j]
        if not close_dofs(closing, i, together, (first if turn == 0 else begin, end)):
            return
        moved = False
        for j in range(work.before.shape[0]):
            moved = moved or answer.turn[i, j] != work.before[j]
        if not moved:
            break
    answer.skipped[i] = sweep.skipped[0]
    pose_axis_groups(hand, finger_posture, answer.turn[i], work, answer.pose[i])
    settle(closing, i)


@kernel
def begin_candidate(closing: Closing, i: int) -> None:
    """Place the links for a candidate, before any of its joints moves."""
    full_width, work, sweep = closing.full_width, closing.work, closing.sweep
    finger_posture = closing.candidates.finger_posture[i]
    if full_width.requested[i]:
        put_resting(full_width, finger_posture, sweep)
    sweep.skipped[0] = 0
    # Travels of other finger postures' joints are never written: they would continue with the values of the candidate
    # before.
    for j in range(work.rates.shape[0]):
        work.rates[j] = 0.0


@kernel
def put_resting(full_width: FullWidthArrays, finger_posture: int, sweep: SweepWork) -> None:
    """Write where all links are before any joint of a finger posture moves."""
    for link in range(sweep.poses.shape[0]):
        copy_pose(full_width.link_pose[finger_posture, link], sweep.poses[link])


@kernel
def close_dofs(closing: Closing, i: int, together: bool, dofs: tuple[int, int]) -> bool:
    """Close degrees of freedom of a candidate once, palm side first, or all at once; False: it cannot begin.

    Args:
        dofs: the first one, and the one after the last.
    """
    hand, answer, work = closing.hand, closing.answer, closing.work
    finger_posture, swept = closing.candidates.finger_posture[i], closing.full_width.requested[i] != 0
    start = hand.first_axis_group[finger_posture]
    axis_group = start - 1
    for dof in range(dofs[0], dofs[1]):
        wanted = dof_axis_group(hand, dof)
        while axis_group < wanted and answer.overlap[i] > SUNK:
            axis_group += 1
            enter_axis_group(closing, axis_group, i)
        if answer.overlap[i] <= SUNK:
            break
        if axis_group > start and not swept and is_held(closing, axis_group, dof, i):
            continue
        sections, base = closing.shared, 0
        if axis_group > start:
            sections, base = closing.own, hand.axis_group_plane[start]
        for j in range(work.locked.shape[0]):
            work.locked[j] = 0
        moving = ALL if together else dof
        if not close_dof(closing, sections, base, axis_group, moving, i):
            return False
        if together:
            break
    return True


@kernel
def close_on_object(
    problem: ProblemArrays,
    full_width: FullWidthArrays,
    candidates: CandidateArrays,
    T_palm_object: Floats,
    space: Workspace,
    answer: ClosingArrays,
    i: int,
    first: int,
    times: int,
    together: bool,
) -> None:
    """Close one candidate on the object of a problem, with other links in the way or other candidates.

    Args:
        first: the first degree of freedom that closes. The rest as above.
    """
    closing = Closing(
        problem.hand,
        full_width,
        problem.target,
        T_palm_object,
        space.arena.shared,
        space.arena.own,
        candidates,
        space.work,
        space.sweep,
        answer,
    )
    close_from(closing, i, times, together, first)
