"""The exact width: moving links against object and resting links, stage by stage (METHOD.md section 5)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clench.base.tolerances import SWEEP_FRACTION

from .advance import fill_chain, place_joints
from .bodies import BodyArrays, pack_bodies
from .body_sweep import sweep_body
from .boxes import boxes_meet
from .closest import AT_CORNER, separation
from .compiling import allocating_kernel, inner_kernel
from .family_pose import compose_inverse, copy_pose
from .layout import (
    HIT_FAMILY,
    HIT_FEATURE,
    HIT_GAP,
    HIT_GROUP,
    HIT_KIND,
    HIT_OUTLINE,
    HIT_PLANE,
    HIT_SOURCE,
    HIT_WHICH,
    KIND_SIDE,
    KIND_TIP,
    KIND_VERTEX,
    ChainArrays,
    Floats,
    Ints,
    Work,
)
from .sweeping import SweepWork, bodies_overlap, make_sweep_work, put_core, put_point


class ExactArrays(NamedTuple):
    """Hold what the exact sweeps read; L links of the hand, M moving links of all entries, J joints.

    Args:
        joint_first: first joint of each entry, (E + 1,).
        wanted: whether each item sweeps exactly, (I,).
        links: one body per link of the hand, in link frames. object: one body, in the object's frame.
        mover_first: first moving link of each entry, (E + 1,). mover_link: index in the hand, (M,).
        mover_joint: last joint that moves it, (M,). mover_pose: `T_palm_link` at the open posture, (M, 3, 4).
        axis, anchor: of every joint in the palm frame at the open posture [m], (J, 3) each; a positive turn is
            right-handed about the axis.
        link_pose: `T_palm_link` of every link at each entry's open posture, (E, L, 3, 4).
        checked: whether a moving link (row) must not overlap a resting one, (L, L).
    """

    joint_first: Ints
    wanted: Ints
    links: BodyArrays
    object: BodyArrays
    mover_first: Ints
    mover_link: Ints
    mover_joint: Ints
    mover_pose: Floats
    axis: Floats
    anchor: Floats
    link_pose: Floats
    checked: Ints


def planes_only(items: int, entries: int) -> ExactArrays:
    """Return what closes so many items of so many entries on their planes alone."""
    nothing = pack_bodies([])
    return ExactArrays(
        joint_first=np.zeros(entries + 1, np.int64),
        wanted=np.zeros(items, np.int64),
        links=nothing,
        object=nothing,
        mover_first=np.zeros(entries + 1, np.int64),
        mover_link=np.zeros(0, np.int64),
        mover_joint=np.zeros(0, np.int64),
        mover_pose=np.zeros((0, 3, 4)),
        axis=np.zeros((0, 3)),
        anchor=np.zeros((0, 3)),
        link_pose=np.zeros((entries, 0, 3, 4)),
        checked=np.zeros((0, 0), np.int64),
    )


@inner_kernel
def turn_about(axis: Floats, anchor: Floats, turn: float, T: Floats) -> None:
    """Turn a pose about an axis, in place."""
    x, y, z = axis[0], axis[1], axis[2]
    s, v = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2
    for k in range(4):
        px, py, pz = T[0, k], T[1, k], T[2, k]
        if k == 3:
            px, py, pz = px - anchor[0], py - anchor[1], pz - anchor[2]
        cx, cy, cz = y * pz - z * py, z * px - x * pz, x * py - y * px
        T[0, k] += s * cx + v * (y * cz - z * cy)
        T[1, k] += s * cy + v * (z * cx - x * cz)
        T[2, k] += s * cz + v * (x * cy - y * cx)


@inner_kernel
def pose_movers(exact: ExactArrays, chain: ChainArrays, entry: int, turns: Floats, poses: Floats) -> None:
    """Write `T_palm_link` of an entry's moving links at the present turns to `poses`, (L, 3, 4)."""
    for n in range(exact.mover_first[entry], exact.mover_first[entry + 1]):
        T = poses[exact.mover_link[n]]
        copy_pose(exact.mover_pose[n], T)
        for j in range(exact.mover_joint[n], exact.joint_first[entry] - 1, -1):
            if turns[j] != 0.0:
                turn_about(exact.axis[j], exact.anchor[j], turns[j], T)


@inner_kernel
def sweep_link(
    links: BodyArrays,
    m: int,
    resting: BodyArrays,
    r: int,
    first: int,
    joint: int,
    rates: Floats,
    touch: float,
    best: float,
    work: Work,
    sweep: SweepWork,
) -> float:
    """Return the first contact of one moving link with one resting body before `best`; see `sweep_body`.

    Args:
        first, joint: first active joint, and the last one that moves the link. work: has the joints placed.
        sweep: `start` has `T_family_link`, `resting` the resting body's pose relative to the first active pivot.
    """
    count, last, rate, speed = fill_chain(joint, first, rates, work.place, work)
    copy_pose(sweep.start, sweep.moving)
    sweep.moving[0, 3] -= work.place[last, 0]
    sweep.moving[2, 3] -= work.place[last, 1]
    put_point(sweep.moving, links.node[links.root[m]], sweep.core[0])
    reach = math.hypot(sweep.core[0, 0], sweep.core[0, 2]) + links.node[links.root[m], 3]
    return sweep_body(links, m, resting, r, count, speed + abs(rate) * reach, touch, best, sweep)


@inner_kernel
def place_resting(T_palm_family: Floats, T_palm_body: Floats, x: float, z: float, out: Floats) -> None:
    """Write a resting body's pose relative to a pivot of the family."""
    compose_inverse(T_palm_family, T_palm_body, out)
    out[0, 3] -= x
    out[2, 3] -= z


@inner_kernel
def lanes_apart(box: Floats, T: Floats, other: Floats, T_other: Floats) -> bool:
    """Say whether two boxes lie apart along the axis that the joints of a family turn about: then nothing meets."""
    away, reach = T[1, 3] - T_other[1, 3], 0.0
    for k in range(3):
        away += T[1, k] * box[k] - T_other[1, k] * other[k]
        reach += abs(T[1, k]) * box[3 + k] + abs(T_other[1, k]) * other[3 + k]
    return bool(abs(away) > reach)


@inner_kernel
def sweep_links(
    exact: ExactArrays,
    entry: int,
    m: int,
    first: int,
    joint: int,
    T_palm_family: Floats,
    rates: Floats,
    touch: float,
    best: float,
    work: Work,
    sweep: SweepWork,
) -> tuple[float, int]:
    """Return the first contact of a moving link with other links of the hand before `best`, and that link or -1.

    Args:
        m: the moving link. first, joint: first active joint, and the last one that moves it. `work` has the joints
            placed; the rest as in `sweep_stage`.
    """
    met = -1
    for r in range(exact.checked.shape[0]):
        if exact.checked[m, r] == 0 or exact.links.root[r] < 0:
            continue
        # Seen from a link that moves as well, only the joints after its own turn.
        after = first_after(exact, entry, r, first, joint, rates)
        if after > joint:
            continue
        x, z = work.place[after, 0], work.place[after, 1]
        place_resting(T_palm_family, sweep.poses[r], x, z, sweep.resting)
        if lanes_apart(exact.links.box[m], sweep.start, exact.links.box[r], sweep.resting):
            continue
        found = sweep_link(exact.links, m, exact.links, r, after, joint, rates, touch, best, work, sweep)
        if found < 0.0:
            sweep.skipped[0] += 1
        elif found < best:
            best, met = found, r
            keep_pair(sweep)
    return best, met


@inner_kernel
def sweep_stage(
    exact: ExactArrays,
    chain: ChainArrays,
    entry: int,
    family: int,
    T_palm_family: Floats,
    T_palm_object: Floats,
    length: float,
    turns: Floats,
    rates: Floats,
    best: float,
    work: Work,
    sweep: SweepWork,
) -> tuple[float, int]:
    """Return how far a path segment goes before a moving link meets anything it must not overlap, at most `best`.

    Args:
        exact, chain: the hand. entry: of the item. family: of the active joints. T_palm_family: (3, 4).
        T_palm_object: (3, 4). length: of the finger [m]. turns: of every joint [rad], (J,). rates: (J,).

    Returns:
        the travel; what is met: -1 nothing, L the object, else a link of the hand. `sweep.winner` and `sweep.poses`,
        which has every link where it is at the start of the segment, describe it. A link that overlaps the object
        already gives `OVERLAP`; links that overlap each other already are left alone, and counted.
    """
    first = 0
    while first < rates.shape[0] and rates[first] == 0.0:
        first += 1
    if first == rates.shape[0]:
        return best, -1
    touch = SWEEP_FRACTION * length
    met, links = -1, exact.checked.shape[0]
    place_joints(chain, family, turns, work.place)
    px, pz = work.place[first, 0], work.place[first, 1]
    pose_movers(exact, chain, entry, turns, sweep.poses)
    for n in range(exact.mover_first[entry], exact.mover_first[entry + 1]):
        m, joint = exact.mover_link[n], exact.mover_joint[n]
        if joint < first or exact.links.root[m] < 0:
            continue
        compose_inverse(T_palm_family, sweep.poses[m], sweep.start)
        place_resting(T_palm_family, T_palm_object, px, pz, sweep.resting)
        found = sweep_link(
            exact.links,
            m,
            exact.object,
            0,
            first,
            joint,
            rates,
            touch,
            best,
            work,
            sweep,
        )
        if found < best:
            best, met = found, links
            keep_pair(sweep)
            if best < 0.0:
                return best, met
        best, other = sweep_links(exact, entry, m, first, joint, T_palm_family, rates, touch, best, work, sweep)
        if other >= 0:
            met = other
    return best, met


@inner_kernel
def keep_pair(sweep: SweepWork) -> None:
    """Keep the pair that was found last as the winner of the stage."""
    for k in range(4):
        sweep.winner[k] = sweep.pair[k]


@inner_kernel
def last_mover(exact: ExactArrays, entry: int, link: int, last: int) -> int:
    """Return the last joint of an entry that moves a link; `last` where that is later, or none does."""
    for n in range(exact.mover_first[entry], exact.mover_first[entry + 1]):
        if exact.mover_link[n] == link:
            last = max(last, exact.mover_joint[n])
    return int(last)


@inner_kernel
def first_after(exact: ExactArrays, entry: int, link: int, first: int, joint: int, rates: Floats) -> int:
    """Return the first active joint, up to `joint`, that does not move a link, or one more than `joint`."""
    j = last_mover(exact, entry, link, first - 1) + 1
    while j <= joint and rates[j] == 0.0:
        j += 1
    return j


@allocating_kernel
def find_link_overlap(exact: ExactArrays, poses: Floats, T_palm_object: Floats, allowed: float) -> tuple[int, int]:
    """Return a link that overlaps the object (whose number is that of all links) or another link, or -1 and -1.

    Args:
        exact: the hand and the object. poses: `T_palm_link` of every link, (L, 3, 4). T_palm_object: (3, 4).
        allowed: how far round bodies may overlap [m].
    """
    links = exact.checked.shape[0]
    sweep = make_sweep_work(np.empty((1, 3)), links)
    for m in range(links):
        copy_pose(poses[m], sweep.moving)
        copy_pose(T_palm_object, sweep.resting)
        if bodies_overlap(exact.links, m, exact.object, 0, allowed, True, sweep):
            return m, links
        for r in range(m):
            if exact.checked[m, r] != 0 and boxes_meet(exact.links.box, poses, m, r):
                copy_pose(poses[r], sweep.resting)
                if bodies_overlap(exact.links, m, exact.links, r, allowed, False, sweep):
                    return m, r
    return -1, -1


@inner_kernel
def describe_pair(
    exact: ExactArrays,
    T_palm_object: Floats,
    met: int,
    group: int,
    family: int,
    sweep: SweepWork,
    hit: Ints,
    point: Floats,
) -> None:
    """Write how the winning pair touches with the links at `sweep.poses`; the point is in the palm frame."""
    i, k, m = sweep.winner[0], sweep.winner[1], sweep.winner[2]
    resting = exact.object if met == exact.checked.shape[0] else exact.links
    T = T_palm_object if met == exact.checked.shape[0] else sweep.poses[met]
    put_core(exact.links, i, sweep.poses[m], sweep.core)
    put_core(resting, k, T, sweep.fixed)
    d, nx, ny, nz, feature, _, x, y, z = separation(sweep.core, exact.links.corners[i], sweep.fixed, resting.corners[k])
    w = resting.radius[k]
    hit[HIT_PLANE], hit[HIT_OUTLINE], hit[HIT_SOURCE], hit[HIT_GROUP], hit[HIT_FAMILY] = -1, m, k, group, family
    hit[HIT_FEATURE], hit[HIT_WHICH] = i, met
    if exact.links.radius[i] > 0.0:
        hit[HIT_KIND] = KIND_TIP if feature == AT_CORNER else KIND_SIDE
    else:
        hit[HIT_KIND] = KIND_VERTEX + feature
    point[0], point[1], point[2] = x + w * nx, y + w * ny, z + w * nz
    point[3], point[4], point[5] = nx, ny, nz
    point[HIT_GAP] = d - w - exact.links.radius[i]
