"""Take the chosen candidate of every finger, and pose the hand as these candidates say."""

from __future__ import annotations

from clench.kernels.geometry.link_frames import put_closed
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose

from .layout import ClosingArrays, Floats, Ints
from .solve_layout import CommandArrays, ProblemArrays, Workspace


@kernel
def pick_candidates(
    problem: ProblemArrays, free: ClosingArrays, chosen: Ints, space: Workspace, final: ClosingArrays
) -> None:
    """Copy the chosen candidates to `space.picked`, and their answers to `final`."""
    candidates, picked = problem.candidates, space.picked
    for f in range(chosen.shape[0]):
        i = chosen[f]
        picked.finger_posture[f], picked.low[f], picked.high[f] = (
            candidates.finger_posture[i],
            candidates.low[i],
            candidates.high[i],
        )
        space.swept[f] = problem.full_width.requested[i]
        copy_row(candidates.until[i], picked.until[f])
        copy_answer(free, i, final, f)


@kernel
def copy_answer(given: ClosingArrays, i: int, out: ClosingArrays, f: int) -> None:
    """Copy the answer of one candidate."""
    copy_row(given.travel[i], out.travel[f])
    copy_row(given.turn[i], out.turn[f])
    for n in range(given.contacts[i]):
        for k in range(given.contact.shape[2]):
            out.contact[f, n, k] = given.contact[i, n, k]
        copy_row(given.point[i, n], out.point[f, n])
    for k in range(given.pose.shape[1]):
        copy_pose(given.pose[i, k], out.pose[f, k])
    out.contacts[f], out.overflow[f] = given.contacts[i], given.overflow[i]
    out.overlap[f], out.skipped[f] = given.overlap[i], given.skipped[i]


@kernel
def copy_row(given: Floats, out: Floats) -> None:
    """Copy numbers, (K,)."""
    for k in range(given.shape[0]):
        out[k] = given[k]


@kernel
def put_candidate_angles(problem: ProblemArrays, finger_posture: int, travel: Floats, turn: Floats, q: Floats) -> None:
    """Write all joints' angles when a finger posture has closed; see `FingerPlan.angles` and `FingerPlan.turned`."""
    hand = problem.hand
    first, last = hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]
    put_closed(problem.frames, hand.chain, finger_posture, first, last, travel, turn, q)


@kernel
def take_joints(command: CommandArrays, finger_posture: int, angles: Floats, q: Floats) -> None:
    """Copy the angles of a finger's own joints into the posture of the hand."""
    for k in range(command.joints.shape[1]):
        if command.joints[finger_posture, k] >= 0:
            q[command.joints[finger_posture, k]] = angles[command.joints[finger_posture, k]]
