"""Choose among the sets of every finger and judge the answer, for many poses (docs/method.md sections 5, 6)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clench.base.tolerances import ALLOWED_PENETRATION, PASSED_GAP

from .batch_closing import answer_at
from .batch_layout import Solved, Wanted
from .batch_sequence import take_joints
from .compiling import allocating_kernel, inner_allocating_kernel, inner_kernel
from .exact import ExactArrays, find_link_overlap
from .frames import FrameArrays, couple, place_links, put_angles
from .layout import SUNK, ClosingArrays, Floats, HandArrays, Ints, ItemArrays
from .link_meshes import DepthWork, LinkMeshArrays, ObjectMesh, find_contained, make_depth_work
from .start_overlap import any_deep
from .touches import (
    TOUCH_FLOATS,
    TOUCH_GAP,
    TOUCH_GRASPABLE,
    TOUCH_INTEGERS,
    TOUCH_LINK,
    TOUCH_NORMAL,
    SurfaceArrays,
    TouchArrays,
    read_touch,
)

#: Codes of a finger, as `FingerStatus` lists them, and of a solve, as `SolutionStatus` does.
TOUCH, LIMIT, BLOCKED, NO_MOTION = 0, 1, 2, 3
GRASP, PARTIAL, NO_CONTACT, ALL_BLOCKED = 0, 1, 2, 3
#: Normals of thumb and finger whose cosine is above this do not oppose each other [-].
OPPOSED = -1e-9
#: Sums of criteria are compared in steps of this [-].
SAME_TOTAL = 1e-9


class Scratch(NamedTuple):
    """Hold what is written over and over: the chosen item per entry, postures, poses of the links, touches, depths."""

    chosen: Ints
    angles: Floats
    poses: Floats
    touches: TouchArrays
    depth: DepthWork


@inner_allocating_kernel
def make_scratch(entries: int, joints: int, links: int, items: int, contacts: int) -> Scratch:
    """Allocate what judging writes over."""
    numbers = np.empty((items, contacts, TOUCH_INTEGERS), dtype=np.int64)
    return Scratch(
        np.empty(entries, dtype=np.int64),
        np.empty(joints),
        np.empty((links, 3, 4)),
        TouchArrays(numbers, np.empty((items, contacts, TOUCH_FLOATS))),
        make_depth_work(),
    )


@inner_kernel
def holds(touches: TouchArrays, i: int, n: int) -> bool:
    """Say whether a touch is one with what is to be grasped, and still there."""
    return bool(touches.number[i, n, TOUCH_GRASPABLE] != 0 and not touches.value[i, n, TOUCH_GAP] > PASSED_GAP)


@inner_kernel
def holding_links(touches: TouchArrays, i: int, contacts: int) -> int:
    """Return how many links touch what is to be grasped."""
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


@inner_kernel
def set_total(hand: HandArrays, frames: FrameArrays, wanted: Wanted, entry: int, links: int, q: Floats) -> float:
    """Return the weighted sum of a set's criteria, in steps; see `clench.grasp.finger_criteria`."""
    motion = 0.0
    for k in range(wanted.joints.shape[1]):
        j = wanted.joints[entry, k]
        if j >= 0:
            motion += abs(q[j] - wanted.start[j])
    least = 1.0
    for k in range(hand.chain.joint_group.shape[0]):
        if hand.entry_group[entry] <= hand.chain.joint_group[k] < hand.entry_group[entry + 1]:
            j = frames.chain_joint[k]
            span = frames.upper[j] - frames.lower[j]
            if span > 0.0:
                limit = frames.upper[j] if frames.direction[j] > 0.0 else frames.lower[j]
                least = min(least, abs(limit - q[j]) / span)
    total = 0.0
    for k in range(wanted.term.shape[0]):
        value = least
        if wanted.term[k] == 0:
            value = motion
        elif wanted.term[k] == 1:
            value = float(links)
        total += wanted.worth[k] * value
    return math.floor(total / SAME_TOTAL + 0.5)


@inner_kernel
def read_item(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    entry: int,
    answer: ClosingArrays,
    i: int,
    T_palm_object: Floats,
    touches: TouchArrays,
) -> int:
    """Read the contacts of an item; return how many links hold the object."""
    for n in range(answer.contacts[i]):
        number, value = touches.number[i, n], touches.value[i, n]
        read_touch(hand, frames, surface, entry, answer, i, n, T_palm_object, number, value)
    return int(holding_links(touches, i, answer.contacts[i]))


@inner_kernel
def choose_sets(
    hand: HandArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    T_palm_object: Floats,
    items: ItemArrays,
    wanted: Wanted,
    answer: ClosingArrays,
    scratch: Scratch,
) -> None:
    """Choose an item of every entry: the full width, else the plane that `clench.grasp.choice` takes; read touches."""
    for entry in range(scratch.chosen.shape[0]):
        scratch.chosen[entry] = -1
    rank, best = 0, 0.0
    for i in range(items.entry.shape[0]):
        entry = items.entry[i]
        links = read_item(hand, frames, surface, entry, answer, i, T_palm_object, scratch.touches)
        first, last = hand.entry_group[entry], hand.entry_group[entry + 1]
        put_angles(frames, entry, first, last, answer.travel[i], scratch.angles)
        total = 0.0 if wanted.whole else set_total(hand, frames, wanted, entry, links, scratch.angles)
        total += wanted.margin if i == wanted.present[entry] else 0.0
        above = (2 if answer.overlap[i] > SUNK else 0) + (1 if links > 0 else 0)
        if scratch.chosen[entry] < 0 or above > rank or (above == rank and total > best):
            scratch.chosen[entry], rank, best = i, above, total


@inner_kernel
def opposed(answer: ClosingArrays, wanted: Wanted, scratch: Scratch) -> bool:
    """Say whether contacts of a thumb and of a finger oppose each other."""
    for thumb in range(wanted.thumb.shape[0]):
        for finger in range(wanted.thumb.shape[0]):
            if wanted.thumb[thumb] != 0 and wanted.thumb[finger] == 0:
                a, b = scratch.chosen[thumb], scratch.chosen[finger]
                for n in range(answer.contacts[a]):
                    for m in range(answer.contacts[b]):
                        if touches_oppose(scratch.touches, a, n, b, m):
                            return True
    return False


@inner_kernel
def touches_oppose(touches: TouchArrays, a: int, n: int, b: int, m: int) -> bool:
    """Say whether two touches hold the object from opposite sides."""
    if not (holds(touches, a, n) and holds(touches, b, m)):
        return False
    cosine = 0.0
    for k in range(TOUCH_NORMAL, TOUCH_NORMAL + 3):
        cosine += touches.value[a, n, k] * touches.value[b, m, k]
    return bool(cosine < OPPOSED)


@inner_kernel
def finger_status(hand: HandArrays, entry: int, blocked: bool, links: int) -> int:
    """Return how a finger ended; see `FingerStatus`."""
    if blocked:
        return BLOCKED
    if links > 0:
        return TOUCH
    for g in range(hand.entry_group[entry], hand.entry_group[entry + 1]):
        if hand.chain.group_length[g] > 0.0:
            return LIMIT
    return NO_MOTION


@inner_allocating_kernel
def is_certified(
    exact: ExactArrays,
    frames: FrameArrays,
    mesh: ObjectMesh,
    meshes: LinkMeshArrays,
    T_palm_object: Floats,
    wanted: Wanted,
    answer: ClosingArrays,
    angles: Floats,
    scratch: Scratch,
) -> bool:
    """Say whether chosen sets from a free start keep the promise of `clench.solver.certificate`."""
    if wanted.nested:
        return False
    for entry in range(scratch.chosen.shape[0]):
        if answer.skipped[scratch.chosen[entry]]:
            return False
    if find_contained(meshes, wanted.fingers, wanted.start_pose, mesh, T_palm_object) >= 0:
        return False
    place_links(frames, angles, scratch.poses)
    return bool(find_link_overlap(exact, scratch.poses, T_palm_object, ALLOWED_PENETRATION)[0] < 0)


@inner_kernel
def write_fingers(
    hand: HandArrays,
    frames: FrameArrays,
    wanted: Wanted,
    answer: ClosingArrays,
    blocked: Ints,
    scratch: Scratch,
    solved: Solved,
    n: int,
) -> None:
    """Write status, contacts and angles of every finger, and the posture of the hand."""
    angles = solved.angles[n]
    for j in range(angles.shape[0]):
        angles[j] = wanted.start[j]
    for entry in range(scratch.chosen.shape[0]):
        i, first, last = scratch.chosen[entry], hand.entry_group[entry], hand.entry_group[entry + 1]
        contacts = answer.contacts[i]
        links = holding_links(scratch.touches, i, contacts)
        stuck = blocked[entry] != 0 or answer.overlap[i] <= SUNK
        solved.fingers[n, entry] = finger_status(hand, entry, stuck, links)
        solved.chosen[n, entry], solved.contacts[n, entry] = i, contacts
        for m in range(contacts):
            for k in range(TOUCH_INTEGERS):
                solved.number[n, entry, m, k] = scratch.touches.number[i, m, k]
            for k in range(TOUCH_FLOATS):
                solved.value[n, entry, m, k] = scratch.touches.value[i, m, k]
        put_angles(frames, entry, first, last, answer.travel[i], scratch.angles)
        take_joints(wanted, entry, scratch.angles, angles)
    couple(frames, angles)


@allocating_kernel
def judge_poses(
    hand: HandArrays,
    exact: ExactArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    mesh: ObjectMesh,
    meshes: LinkMeshArrays,
    items: ItemArrays,
    wanted: Wanted,
    T_palm_object: Floats,
    answers: ClosingArrays,
    blocked: Ints,
    solved: Solved,
) -> None:
    """Choose, read and judge the answers for every pose of the object, (N, 3, 4); `solved` is written.

    Args:
        hand, items: the fingers; one item per entry over the full width, or one per entry and plane.
        exact: links and object, and which links may not overlap. frames: kinematics of the hand.
        surface, mesh: the object. meshes: of the links. wanted: what is asked for. answers, blocked: of the fingers.
    """
    joints, links, count = frames.lower.shape[0], frames.parent.shape[0], items.entry.shape[0]
    scratch = make_scratch(blocked.shape[1], joints, links, count, solved.number.shape[2])
    for n in range(T_palm_object.shape[0]):
        T, answer = T_palm_object[n], answer_at(answers, n)
        judge_pose(hand, exact, frames, surface, mesh, meshes, items, wanted, T, answer, blocked[n], scratch, solved, n)


@inner_allocating_kernel
def judge_pose(
    hand: HandArrays,
    exact: ExactArrays,
    frames: FrameArrays,
    surface: SurfaceArrays,
    mesh: ObjectMesh,
    meshes: LinkMeshArrays,
    items: ItemArrays,
    wanted: Wanted,
    T_palm_object: Floats,
    answer: ClosingArrays,
    blocked: Ints,
    scratch: Scratch,
    solved: Solved,
    n: int,
) -> None:
    """Choose, read and judge the answer for one pose, the one with number `n`; see `judge_poses`."""
    choose_sets(hand, frames, surface, T_palm_object, items, wanted, answer, scratch)
    write_fingers(hand, frames, wanted, answer, blocked, scratch, solved, n)
    entries, touching, stuck = blocked.shape[0], 0, 0
    for entry in range(entries):
        touching += 1 if solved.fingers[n, entry] == TOUCH else 0
        stuck += 1 if blocked[entry] else 0
    solved.certified[n] = 0
    free = not any_deep(meshes, wanted.fixed, wanted.start_pose, mesh, T_palm_object, scratch.depth)
    if wanted.whole and free and stuck == 0:
        angles = solved.angles[n]
        certified = is_certified(exact, frames, mesh, meshes, T_palm_object, wanted, answer, angles, scratch)
        solved.certified[n] = 1 if certified else 0
    if not free or stuck == entries + wanted.idle:
        solved.status[n] = ALL_BLOCKED
    elif touching == 0:
        solved.status[n] = NO_CONTACT
    elif touching == entries + wanted.idle or opposed(answer, wanted, scratch):
        solved.status[n] = GRASP
    else:
        solved.status[n] = PARTIAL
