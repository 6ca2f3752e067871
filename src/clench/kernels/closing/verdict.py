"""Judge a closed hand: contacts, status and certificate (docs/method.md section 5)."""

from __future__ import annotations

from clench.core.tolerances import ALLOWED_PENETRATION
from clench.kernels.geometry.link_frames import put_links, tie
from clench.kernels.geometry.link_meshes import find_contained
from clench.kernels.meetings.meeting_layout import Meetings
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import link_overlap

from .bundles import among
from .choosing import holds, read_candidate
from .contact_reading import (
    PALM_CONTACT_FLOATS,
    PALM_CONTACT_INTEGERS,
    PALM_CONTACT_LINK,
    PALM_CONTACT_NORMAL,
    PalmContactArrays,
)
from .layout import SUNK, ClosingArrays, Floats, Ints
from .picking import put_candidate_angles, take_joints
from .solve_layout import Closed, ProblemArrays, Solved, Workspace
from .start_overlap import any_deep

#: Codes of a finger, as `FingerStatus` lists them, and of a solve, as `SolutionStatus` does.
TOUCH, LIMIT, BLOCKED, NO_MOTION, MISSED = 0, 1, 2, 3, 4
GRASP, PARTIAL, NO_CONTACT, ALL_BLOCKED = 0, 1, 2, 3
#: Normals of thumb and finger whose cosine is above this do not oppose each other [-].
OPPOSED = -1e-9


@kernel(allocates=True)
def judge_pose(
    problem: ProblemArrays,
    T_palm_object: Floats,
    space: Workspace,
    final: ClosingArrays,
    found: Closed,
    solved: Solved,
    n: int,
) -> None:
    """Read the contacts of the picked candidates, and write posture, statuses and certificate of pose `n`.

    Args:
        final: answers of the picked candidates. found: how the fingers closed. solved: written.
    """
    command, fingers, blocked = problem.command, final.contacts.shape[0], found.blocked[n]
    write_fingers(problem, T_palm_object, space, final, found, solved, n)
    touching, stuck, apart = 0, 0, True
    for f in range(fingers):
        touching += 1 if solved.fingers[n, f] == TOUCH else 0
        stuck += 1 if blocked[space.picked.finger_posture[f]] else 0
        apart = apart and found.overlapping[n, f] == 0
    free = not any_deep(problem, command.fixed, command.start_pose, T_palm_object, space)
    certified = free and stuck == 0 and apart and found.nested[n] == 0
    certified = certified and is_certified(problem, T_palm_object, space, final, solved.angles[n])
    solved.certified[n] = 1 if certified else 0
    if not free or stuck == fingers + command.idle:
        solved.status[n] = ALL_BLOCKED
    elif touching == 0:
        solved.status[n] = NO_CONTACT
    elif touching == fingers + command.idle or opposed(command.thumb, final, space.palm_contacts):
        solved.status[n] = GRASP
    else:
        solved.status[n] = PARTIAL


@kernel
def write_fingers(
    problem: ProblemArrays,
    T_palm_object: Floats,
    space: Workspace,
    final: ClosingArrays,
    found: Closed,
    solved: Solved,
    n: int,
) -> None:
    """Write status, contacts and angles of every finger, and the posture of the hand."""
    angles, palm_contacts = solved.angles[n], space.palm_contacts
    for j in range(angles.shape[0]):
        angles[j] = problem.command.start[j]
    for f in range(final.contacts.shape[0]):
        finger_posture, contacts = space.picked.finger_posture[f], final.contacts[f]
        links = read_candidate(problem, space.picked, T_palm_object, final, f, palm_contacts)
        stuck = found.blocked[n, finger_posture] != 0 or final.overlap[f] <= SUNK
        first = palm_contacts.number[f, 0, PALM_CONTACT_LINK] if contacts > 0 else held_link(found.met, n, f)
        solved.fingers[n, f] = finger_status(problem, finger_posture, stuck, links, first)
        solved.contacts[n, f] = contacts
        for m in range(contacts):
            for k in range(PALM_CONTACT_INTEGERS):
                solved.number[n, f, m, k] = palm_contacts.number[f, m, k]
            for k in range(PALM_CONTACT_FLOATS):
                solved.value[n, f, m, k] = palm_contacts.value[f, m, k]
        put_candidate_angles(problem, finger_posture, final.travel[f], final.turn[f], space.angles)
        take_joints(problem.command, finger_posture, space.angles, angles)
    tie(problem.frames, angles)


@kernel
def held_link(met: Meetings, n: int, f: int) -> int:
    """Return the link of a finger that another finger holds first, or -1."""
    for k in range(met.size[n, 0]):
        for at in range(0, 6, 3):
            if met.number[n, k, at] == f and met.number[n, k, at + 2] >= 0:
                return int(met.number[n, k, at + 1])
    return -1


@kernel
def finger_status(problem: ProblemArrays, finger_posture: int, stuck: bool, links: int, first: int) -> int:
    """Return how a finger ended; see `FingerStatus`.

    Args:
        stuck: it cannot begin. links: how many hold the object. first: link that touches first, or -1.
    """
    hand, tip = problem.hand, problem.command.tip[problem.command.finger[finger_posture]]
    if stuck:
        return BLOCKED
    if tip >= 0 and first >= 0 and first != tip:
        return MISSED
    if links > 0:
        return TOUCH
    for g in range(hand.first_dof[finger_posture], hand.first_dof[finger_posture + 1]):
        if hand.chain.dof_length[g] > 0.0:
            return LIMIT
    return NO_MOTION


@kernel
def opposed(thumb: Ints, final: ClosingArrays, palm_contacts: PalmContactArrays) -> bool:
    """Say whether contacts of a thumb and of a finger oppose each other."""
    for a in range(thumb.shape[0]):
        for b in range(thumb.shape[0]):
            if thumb[a] != 0 and thumb[b] == 0:
                for n in range(final.contacts[a]):
                    for m in range(final.contacts[b]):
                        if contacts_oppose(palm_contacts, a, n, b, m):
                            return True
    return False


@kernel
def contacts_oppose(palm_contacts: PalmContactArrays, a: int, n: int, b: int, m: int) -> bool:
    """Say whether two touches hold the object from opposite sides."""
    if not (holds(palm_contacts, a, n) and holds(palm_contacts, b, m)):
        return False
    cosine = 0.0
    for k in range(PALM_CONTACT_NORMAL, PALM_CONTACT_NORMAL + 3):
        cosine += palm_contacts.value[a, n, k] * palm_contacts.value[b, m, k]
    return bool(cosine < OPPOSED)


@kernel(allocates=True)
def is_certified(
    problem: ProblemArrays, T_palm_object: Floats, space: Workspace, final: ClosingArrays, angles: Floats
) -> bool:
    """Say whether picked candidates from a free start keep the promise of `clench.solver.certificate`."""
    command, frames, poses = problem.command, problem.frames, space.placed[0]
    for f in range(final.contacts.shape[0]):
        if not space.swept[f] or final.skipped[f]:
            return False
    start_pose = command.start_pose
    if command.several:
        put_opened(problem, space)
        put_links(frames, space.q, space.poses, poses)
        start_pose = poses
    if find_contained(problem.meshes, command.fingers, start_pose, problem.mesh, T_palm_object) >= 0:
        return False
    put_links(frames, angles, space.poses, poses)
    everything = among(problem.full_width, space.swept, problem.target.bodies, space.placed, problem.across)
    return bool(link_overlap(everything, poses, T_palm_object, ALLOWED_PENETRATION, space.sweep)[0] < 0)


@kernel
def put_opened(problem: ProblemArrays, space: Workspace) -> None:
    """Write the posture from which the picked candidates close to `space.q`."""
    command, q = problem.command, space.q
    for j in range(q.shape[0]):
        q[j] = command.start[j]
    for f in range(space.picked.finger_posture.shape[0]):
        finger_posture = space.picked.finger_posture[f]
        take_joints(command, finger_posture, problem.frames.posture[finger_posture], q)
