"""Which fingers are blocked, and where the others stand when a finger closes, for many poses of an object."""

from __future__ import annotations

import numpy as np

from .batch_closing import answer_at, clear_answer
from .batch_layout import Wanted
from .compiling import allocating_kernel, inner_kernel
from .frames import FrameArrays, put_angles, put_links
from .layout import ClosingArrays, Floats, HandArrays, Ints, ItemArrays
from .link_meshes import DepthWork, LinkMeshArrays, ObjectMesh, make_depth_work
from .start_overlap import FREE, start_overlap


@allocating_kernel
def find_blocked(
    link_pose: Floats,
    meshes: LinkMeshArrays,
    items: ItemArrays,
    wanted: Wanted,
    solid: ObjectMesh,
    T_palm_object: Floats,
    overlaps: Ints,
    answers: ClosingArrays,
    blocked: Ints,
) -> None:
    """Write whether an entry overlaps the object before anything moves, (N, E); its items then move nothing.

    Args:
        link_pose: see `ExactArrays`. meshes: of the links. items, wanted: what is asked for. solid: the object.
        T_palm_object: where it is, (N, 3, 4). overlaps, answers: see `close_poses_on_device`.
    """
    work = make_depth_work()
    for n in range(T_palm_object.shape[0]):
        answer, T = answer_at(answers, n), T_palm_object[n]
        block_pose(link_pose, meshes, items, wanted, solid, T, overlaps[n], work, answer, blocked[n])


@inner_kernel
def block_pose(
    link_pose: Floats,
    meshes: LinkMeshArrays,
    items: ItemArrays,
    wanted: Wanted,
    solid: ObjectMesh,
    T_palm_object: Floats,
    overlaps: Ints,
    work: DepthWork,
    answer: ClosingArrays,
    blocked: Ints,
) -> None:
    """Do as `find_blocked` at one pose; `work` is overwritten."""
    for entry in range(blocked.shape[0]):
        crossed = overlaps[entry] >= 0
        for i in range(items.entry.shape[0]):
            crossed = crossed or (items.entry[i] == entry and answer.overlap[i] >= 0)
        if not crossed:
            own, resting = wanted.own[entry], wanted.resting[entry]
            code = start_overlap(link_pose[entry], meshes, own, resting, solid, T_palm_object, wanted.whole, work)
            crossed = code != FREE
        blocked[entry] = 1 if crossed else 0
    for i in range(items.entry.shape[0]):
        if blocked[items.entry[i]]:
            clear_answer(answer, i)


@allocating_kernel
def place_fingers(
    hand: HandArrays, frames: FrameArrays, wanted: Wanted, travel: Floats, link_pose: Floats, length: Floats
) -> None:
    """Write where all links are when a finger begins to close, those before it closed already; see `close_in_sequence`.

    Args:
        hand, frames: the hand. wanted: what is asked for. travel: of every entry's groups, (N, E, G).
        link_pose: written, (N, E, L, 3, 4). length: written with the travel of each group, (N, G).
    """
    q, angles = wanted.start.copy(), wanted.start.copy()
    scratch = np.empty((frames.parent.shape[0] + 2, 3, 4))
    for n in range(travel.shape[0]):
        place_one(hand, frames, wanted, travel[n], link_pose[n], length[n], q, angles, scratch)


@inner_kernel
def place_one(
    hand: HandArrays,
    frames: FrameArrays,
    wanted: Wanted,
    travel: Floats,
    link_pose: Floats,
    length: Floats,
    q: Floats,
    angles: Floats,
    scratch: Floats,
) -> None:
    """Do as `place_fingers` for one pose of the object; `q`, `angles` and `scratch` are overwritten."""
    for j in range(q.shape[0]):
        q[j] = wanted.start[j]
    for entry in range(travel.shape[0]):
        first, last = hand.entry_group[entry], hand.entry_group[entry + 1]
        for j in range(q.shape[0]):
            angles[j] = q[j]
        for k in range(wanted.joints.shape[1]):
            if wanted.joints[entry, k] >= 0:
                angles[wanted.joints[entry, k]] = frames.posture[entry, wanted.joints[entry, k]]
        put_links(frames, angles, scratch, link_pose[entry])
        for g in range(first, last):
            length[g] = travel[entry, g]
        put_angles(frames, entry, first, last, travel[entry], angles)
        take_joints(wanted, entry, angles, q)


@inner_kernel
def take_joints(wanted: Wanted, entry: int, angles: Floats, q: Floats) -> None:
    """Copy the angles of a finger's own joints into the posture of the hand."""
    for k in range(wanted.joints.shape[1]):
        if wanted.joints[entry, k] >= 0:
            q[wanted.joints[entry, k]] = angles[wanted.joints[entry, k]]
