"""What fingers meet of the hand itself as they begin to close: the same wherever the object is (section 5)."""

from __future__ import annotations

import math

from clench.core.tolerances import SWEEP_FRACTION
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.advance import make_work
from clench.kernels.sections.plane_pose import pose_axis_group
from clench.kernels.toi.toi_links import Stage, put_first_meeting
from clench.kernels.toi.toi_work import SweepWork, make_sweep_work

from .close_candidate import beyond, dof_axis_group, finger_posture_joints, put_resting
from .layout import ClosingArrays, Work
from .segments import ALL, next_segment
from .solve_layout import ProblemArrays
from .solve_poses import make_answer


@entry_kernel(allocates=True)
def find_first_meetings(problem: ProblemArrays) -> None:
    """Write `FirstMeetings` of every finger posture of a problem that has a candidate over the full width."""
    hand, candidates, links = problem.hand, problem.candidates, problem.across.shape[0]
    joints, dofs = hand.chain.rate.shape[0], hand.chain.dof_length.shape[0]
    work, sweep = make_work(joints, hand.outlines), make_sweep_work(joints, links)
    spare = make_answer(1, dofs, joints, 1, hand.axis_group_pose.shape[0])
    for i in range(candidates.finger_posture.shape[0]):
        if problem.full_width.requested[i]:
            find_first_meeting(problem, candidates.finger_posture[i], spare, work, sweep)


@kernel
def find_first_meeting(
    problem: ProblemArrays, finger_posture: int, spare: ClosingArrays, work: Work, sweep: SweepWork
) -> None:
    """Write `FirstMeetings` of one finger posture, unless none of its joints moves on the first path segment."""
    hand, full_width, turns, axis_groups = problem.hand, problem.full_width, spare.turn[0], spare.pose[0]
    joints, moves, end, dof = finger_posture_joints(hand, finger_posture), False, 0.0, hand.first_dof[finger_posture]
    for j in range(work.rates.shape[0]):
        work.rates[j], work.locked[j], work.before[j] = 0.0, 0, math.inf
    while dof < hand.first_dof[finger_posture + 1]:
        moving = ALL if problem.command.together else dof
        end = next_segment(hand.chain, joints, moving, spare.travel[0], work.locked, work.before, 0.0, work.rates)
        if end > 0.0:
            break
        dof += 1
    for j in range(joints[0], joints[1]):
        moves = moves or work.rates[j] != 0.0
    if not moves:
        return
    start, axis_group = hand.first_axis_group[finger_posture], dof_axis_group(hand, dof)
    for k in range(start, hand.first_axis_group[finger_posture + 1]):
        pose_axis_group(hand, k, k == start, turns, work, axis_groups)
    put_resting(full_width, finger_posture, sweep)
    touch, T = SWEEP_FRACTION * hand.axis_group_length[axis_group], full_width.link_pose[finger_posture, 0]
    stage = Stage(full_width, hand.chain, finger_posture, axis_groups, T, turns, work.rates, touch)
    put_first_meeting(stage, beyond(end, joints, work.rates), work, sweep)
