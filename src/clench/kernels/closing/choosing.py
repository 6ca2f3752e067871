"""Choose a candidate for every finger, by sums of criteria or where there is only one (docs/method.md section 6)."""

from __future__ import annotations

import math

from clench.core.tolerances import PASSED_GAP
from clench.kernels.runtime.compiling import kernel

from .contact_reading import (
    PALM_CONTACT_GAP,
    PALM_CONTACT_GRASPABLE,
    PALM_CONTACT_LINK,
    PalmContactArrays,
    read_contact,
)
from .layout import SUNK, CandidateArrays, ClosingArrays, Floats, Ints
from .picking import put_candidate_angles
from .solve_layout import ProblemArrays, Workspace

#: Sums of criteria are compared in steps of this [-].
SAME_TOTAL = 1e-9


@kernel
def choose_sets(
    problem: ProblemArrays, T_palm_object: Floats, free: ClosingArrays, space: Workspace, chosen: Ints
) -> None:
    """Choose the only candidate of every finger, else the plane that `clench.scoring.choice` takes; write `chosen`."""
    command, candidates = problem.command, problem.candidates
    for f in range(chosen.shape[0]):
        chosen[f] = -1
    rank, best = 0, 0.0
    for i in range(candidates.finger_posture.shape[0]):
        f = command.finger[candidates.finger_posture[i]]
        if command.chosen:
            chosen[f] = i
            continue
        links = read_candidate(problem, candidates, T_palm_object, free, i, space.palm_contacts)
        total = set_total(problem, candidates.finger_posture[i], links, free, i, space.angles)
        total += command.margin if i == command.present[f] else 0.0
        above = (2 if free.overlap[i] > SUNK else 0) + (1 if links > 0 else 0)
        if chosen[f] < 0 or above > rank or (above == rank and total > best):
            chosen[f], rank, best = i, above, total


@kernel
def read_candidate(
    problem: ProblemArrays,
    candidates: CandidateArrays,
    T_palm_object: Floats,
    answer: ClosingArrays,
    i: int,
    palm_contacts: PalmContactArrays,
) -> int:
    """Read the contacts of a candidate; return how many links hold the object."""
    for n in range(answer.contacts[i]):
        read_contact(
            problem.hand,
            problem.frames,
            problem.surface,
            candidates.finger_posture[i],
            answer,
            i,
            n,
            T_palm_object,
            palm_contacts.number[i, n],
            palm_contacts.value[i, n],
        )
    return int(holding_links(palm_contacts, i, answer.contacts[i]))


@kernel
def holds(palm_contacts: PalmContactArrays, i: int, n: int) -> bool:
    """Say whether a contact is with a graspable body and still exists."""
    return bool(
        palm_contacts.number[i, n, PALM_CONTACT_GRASPABLE] != 0
        and not palm_contacts.value[i, n, PALM_CONTACT_GAP] > PASSED_GAP
    )


@kernel
def holding_links(palm_contacts: PalmContactArrays, i: int, contacts: int) -> int:
    """Return how many links touch a graspable body."""
    count = 0
    for n in range(contacts):
        if holds(palm_contacts, i, n):
            new = True
            for m in range(n):
                new = new and not (
                    holds(palm_contacts, i, m)
                    and palm_contacts.number[i, m, PALM_CONTACT_LINK] == palm_contacts.number[i, n, PALM_CONTACT_LINK]
                )
            count += 1 if new else 0
    return count


@kernel
def set_total(
    problem: ProblemArrays, finger_posture: int, links: int, answer: ClosingArrays, i: int, q: Floats
) -> float:
    """Return the weighted sum of a set's criteria, in steps; see `clench.scoring.finger_criteria`. Overwrite `q`."""
    hand, frames, command = problem.hand, problem.frames, problem.command
    put_candidate_angles(problem, finger_posture, answer.travel[i], answer.turn[i], q)
    motion = 0.0
    for k in range(command.joints.shape[1]):
        j = command.joints[finger_posture, k]
        if j >= 0:
            motion += abs(q[j] - command.start[j])
    least = 1.0
    for k in range(hand.chain.joint_dof.shape[0]):
        if hand.first_dof[finger_posture] <= hand.chain.joint_dof[k] < hand.first_dof[finger_posture + 1]:
            j = frames.chain_joint[k]
            span = frames.upper[j] - frames.lower[j]
            if span > 0.0:
                limit = frames.upper[j] if frames.direction[j] > 0.0 else frames.lower[j]
                least = min(least, abs(limit - q[j]) / span)
    total = 0.0
    for k in range(command.term.shape[0]):
        value = least
        if command.term[k] == 0:
            value = motion
        elif command.term[k] == 1:
            value = float(links)
        total += command.worth[k] * value
    return math.floor(total / SAME_TOTAL + 0.5)
