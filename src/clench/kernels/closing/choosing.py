"""Choose an item for every finger where sums of criteria decide, or nothing is to choose (docs/method.md section 6)."""

from __future__ import annotations

import math

from clench.core.tolerances import PASSED_GAP
from clench.kernels.runtime.compiling import kernel

from .contact_reading import TOUCH_GAP, TOUCH_GRASPABLE, TOUCH_LINK, TouchArrays, read_touch
from .layout import SUNK, ClosingArrays, Floats, Ints, ItemArrays
from .picking import put_item_angles
from .solve_layout import ProblemArrays, Workspace

#: Sums of criteria are compared in steps of this [-].
SAME_TOTAL = 1e-9


@kernel
def choose_sets(
    problem: ProblemArrays, T_palm_object: Floats, free: ClosingArrays, space: Workspace, chosen: Ints
) -> None:
    """Choose the only item of every finger, else the plane that `clench.scoring.choice` takes; `chosen` is written."""
    command, items = problem.command, problem.items
    for f in range(chosen.shape[0]):
        chosen[f] = -1
    rank, best = 0, 0.0
    for i in range(items.entry.shape[0]):
        f = command.finger[items.entry[i]]
        if command.chosen:
            chosen[f] = i
            continue
        links = read_item(problem, items, T_palm_object, free, i, space.touches)
        total = set_total(problem, items.entry[i], links, free, i, space.angles)
        total += command.margin if i == command.present[f] else 0.0
        above = (2 if free.overlap[i] > SUNK else 0) + (1 if links > 0 else 0)
        if chosen[f] < 0 or above > rank or (above == rank and total > best):
            chosen[f], rank, best = i, above, total


@kernel
def read_item(
    problem: ProblemArrays,
    items: ItemArrays,
    T_palm_object: Floats,
    answer: ClosingArrays,
    i: int,
    touches: TouchArrays,
) -> int:
    """Read the contacts of an item; return how many links hold the object."""
    for n in range(answer.contacts[i]):
        read_touch(
            problem.hand,
            problem.frames,
            problem.surface,
            items.entry[i],
            answer,
            i,
            n,
            T_palm_object,
            touches.number[i, n],
            touches.value[i, n],
        )
    return int(holding_links(touches, i, answer.contacts[i]))


@kernel
def holds(touches: TouchArrays, i: int, n: int) -> bool:
    """Say whether a contact is with a graspable body and still exists."""
    return bool(touches.number[i, n, TOUCH_GRASPABLE] != 0 and not touches.value[i, n, TOUCH_GAP] > PASSED_GAP)


@kernel
def holding_links(touches: TouchArrays, i: int, contacts: int) -> int:
    """Return how many links touch a graspable body."""
    count = 0
    for n in range(contacts):
        if holds(touches, i, n):
            new = True
            for m in range(n):
                new = new and not (
                    holds(touches, i, m) and touches.number[i, m, TOUCH_LINK] == touches.number[i, n, TOUCH_LINK]
                )
            count += 1 if new else 0
    return count


@kernel
def set_total(problem: ProblemArrays, entry: int, links: int, answer: ClosingArrays, i: int, q: Floats) -> float:
    """Return the weighted sum of a set's criteria, in steps; see `clench.scoring.finger_criteria`. Overwrite `q`."""
    hand, frames, command = problem.hand, problem.frames, problem.command
    put_item_angles(problem, entry, answer.travel[i], answer.turn[i], q)
    motion = 0.0
    for k in range(command.joints.shape[1]):
        j = command.joints[entry, k]
        if j >= 0:
            motion += abs(q[j] - command.start[j])
    least = 1.0
    for k in range(hand.chain.joint_group.shape[0]):
        if hand.entry_group[entry] <= hand.chain.joint_group[k] < hand.entry_group[entry + 1]:
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
