"""The one entry of every solve: close, choose, finish, at many poses of the object (docs/method.md sections 4-6)."""

from __future__ import annotations

import numpy as np

from clench.kernels.geometry.link_meshes import make_depth_work
from clench.kernels.meetings.meeting_layout import make_meeting_work
from clench.kernels.runtime.by_reference import by_value
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.advance import make_work
from clench.kernels.toi.toi_work import make_sweep_work

from .bundles import answer_at
from .choosing import choose_sets
from .close_with_others import close_with_others
from .contact_reading import PALM_CONTACT_FLOATS, PALM_CONTACT_INTEGERS, PalmContactArrays
from .free_closing import close_free, find_blocked
from .layout import CONTACT_FLOATS, CONTACT_INTEGERS, CandidateArrays, ClosingArrays, Floats
from .picking import pick_candidates
from .solve_layout import BLOCK, CHOOSE, CLOSE, FINISH, Arena, Closed, ProblemArrays, Solved, Workspace
from .verdict import judge_pose


@entry_kernel(allocates=True)
def solve_poses(
    problem: ProblemArrays, T_palm_objects: Floats, arena: Arena, found: Closed, solved: Solved, stages: int
) -> None:
    """Run stages of a solve for the poses that are not solved yet.

    `CLOSE` closes every candidate without the other fingers. `BLOCK` finds the fingers that cannot begin. `CHOOSE`
    chooses a candidate for every finger. `FINISH` closes the chosen candidates with the other fingers in their way, and
    judges them. A caller that closes or chooses in another way leaves out `CLOSE` or `CHOOSE` and writes the arrays
    itself.

    Args:
        problem: hand, object and command. T_palm_objects: where the object is, (N, 3, 4). arena: scratch space.
        found, solved: written. stages: which ones, as a sum.
    """
    run_stages(problem, T_palm_objects, make_workspace(problem, arena, found, solved), found, solved, stages)


@kernel(allocates=True)
def run_stages(
    problem: ProblemArrays, T_palm_objects: Floats, space: Workspace, found: Closed, solved: Solved, stages: int
) -> None:
    """Run stages of a solve. It points to its scratch space, which compiles faster than handing over the values."""
    for n in range(T_palm_objects.shape[0]):
        if found.overflow[n] == 0:
            continue
        T, free, overflow = T_palm_objects[n], answer_at(found.free, n), 0
        if stages & CLOSE:
            overflow = close_free(problem, T, space, free, found.crossed[n])
        if stages & BLOCK and overflow == 0:
            find_blocked(problem, T, space, free, found.crossed[n], found.blocked[n])
        if stages & CHOOSE and overflow == 0:
            choose_sets(problem, T, free, space, solved.chosen[n])
        if stages & FINISH and overflow == 0:
            final = answer_at(found.final, n)
            pick_candidates(problem, free, solved.chosen[n], space, final)
            overflow = close_with_others(problem, T, space, final, found, n, stages & CLOSE == 0)
            if overflow == 0:
                judge_pose(problem, T, space, final, found, solved, n)
        found.overflow[n] = overflow


@kernel(allocates=True)
def make_workspace(problem: ProblemArrays, arena: Arena, found: Closed, solved: Solved) -> Workspace:
    """Allocate the scratch space of a solve."""
    hand, command, frames = problem.hand, problem.command, problem.frames
    joints, links = hand.chain.rate.shape[0], problem.across.shape[0]
    finger_postures, fingers, candidates = (
        frames.posture.shape[0],
        command.thumb.shape[0],
        problem.candidates.finger_posture.shape[0],
    )
    contacts = solved.number.shape[2]
    numbers = np.empty((max(candidates, fingers), contacts, PALM_CONTACT_INTEGERS), dtype=np.int64)
    one = np.empty(fingers, dtype=np.int64)
    return Workspace(
        by_value(arena),
        make_work(joints, hand.outlines),
        make_sweep_work(joints, links),
        make_depth_work(),
        make_answer(fingers, hand.chain.dof_length.shape[0], joints, contacts, hand.axis_group_pose.shape[0]),
        CandidateArrays(one, one.copy(), one.copy(), np.empty((fingers, joints))),
        one.copy(),
        np.empty((finger_postures, links, 3, 4)),
        np.zeros(hand.chain.dof_length.shape[0]),
        command.start.copy(),
        command.start.copy(),
        np.empty((links + 2, 3, 4)),
        PalmContactArrays(numbers, np.empty((max(candidates, fingers), contacts, PALM_CONTACT_FLOATS))),
        one.copy(),
        make_meeting_work(problem.fingers, fingers, joints),
    )


@kernel(allocates=True)
def make_answer(candidates: int, dofs: int, joints: int, contacts: int, axis_groups: int) -> ClosingArrays:
    """Allocate the answers of some candidates."""
    counts = np.zeros(candidates, dtype=np.int64)
    return ClosingArrays(
        np.zeros((candidates, dofs)),
        np.zeros((candidates, joints)),
        counts,
        np.zeros((candidates, contacts, CONTACT_INTEGERS), dtype=np.int64),
        np.zeros((candidates, contacts, CONTACT_FLOATS)),
        np.zeros((candidates, axis_groups, 3, 4)),
        counts.copy(),
        counts.copy(),
        counts.copy(),
    )
