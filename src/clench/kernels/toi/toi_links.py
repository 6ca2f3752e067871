"""The full width of one path segment: moving links against object and resting links (docs/method.md section 5).

A link that joints of one axis group move turns about parallel axes, in the axis group's frame. One that joints of
several axis groups move at once is seen in the palm frame, with a chain that has an axis per joint.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import ChainArrays, Floats, Work
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.grid.grid_travel import clear_by_grid
from clench.kernels.hulls.body_sweep import sweep_body, sweep_from
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.advance import fill_chain, place_joints
from clench.kernels.sections.plane_pose import compose_inverse, copy_pose

from .full_width import FullWidthArrays, keep_pair, last_mover, place_axes, pose_movers
from .separating_planes import lanes_apart
from .toi_work import BodyPair, SweepWork


class Stage(NamedTuple):
    """A path segment along which joints of a finger posture move, and what its links may meet.

    Args:
        full_width, chain: the hand; kernels hold both by pointers. finger_posture: of the candidate.
        axis_groups: `T_palm_axis_group` of those with active joints, (F, 3, 4). T_palm_object: (3, 4).
        turns: of every joint where the segment begins [rad], (J,). rates: of every joint, (J,).
        touch: gaps up to this touch [m].
    """

    full_width: FullWidthArrays
    chain: ChainArrays
    finger_posture: int
    axis_groups: Floats
    T_palm_object: Floats
    turns: Floats
    rates: Floats
    touch: float


@kernel
def place_turning(
    stage: Stage,
    m: int,
    resting: BodyArrays,
    r: int,
    T_palm_resting: Floats,
    joints: tuple[int, int],
    work: Work,
    sweep: SweepWork,
) -> BodyPair:
    """Return what `place_pair` does where the active joints are of one axis group."""
    first, joint = joints
    links, rates, T_palm_axis_group = (
        stage.full_width.links,
        stage.rates,
        stage.axis_groups[stage.chain.joint_axis_group[first]],
    )
    place, moving, other = work.place, sweep.moving, sweep.resting
    count, last, _, _ = fill_chain(joint, first, rates, place, work)
    compose_inverse(T_palm_axis_group, sweep.poses[m], moving)
    compose_inverse(T_palm_axis_group, T_palm_resting, other)
    # Told before from what `put_lanes` wrote, but for segments in which other axis groups move as well.
    if lanes_apart(lane_of(links.box[m], moving, 0.0, 1.0, 0.0), lane_of(resting.box[r], other, 0.0, 1.0, 0.0)):
        count = 0
    moving[0, 3], moving[2, 3] = moving[0, 3] - place[last, 0], moving[2, 3] - place[last, 1]
    other[0, 3], other[2, 3] = other[0, 3] - place[first, 0], other[2, 3] - place[first, 1]
    return BodyPair(links, m, resting, r, work.chain, count, stage.touch)


@kernel
def fill_spatial(first: int, joint: int, rates: Floats, sweep: SweepWork) -> tuple[int, int]:
    """Write the chain of active joints up to `joint`; return its length and its last joint."""
    count, last = 0, first
    for j in range(first, joint + 1):
        if rates[j] != 0.0:
            row = sweep.spatial[count]
            row[0] = rates[j]
            for k in range(3):
                row[1 + k] = sweep.axis[j, k]
                if count > 0:
                    sweep.spatial[count - 1, 4 + k] = sweep.anchor[j, k] - sweep.anchor[last, k]
            count, last = count + 1, j
    return count, last


@kernel
def place_spatially(
    stage: Stage,
    m: int,
    resting: BodyArrays,
    r: int,
    T_palm_resting: Floats,
    joints: tuple[int, int],
    sweep: SweepWork,
) -> BodyPair:
    """Return what `place_pair` does where the active joints are of several axis groups."""
    links, first = stage.full_width.links, joints[0]
    count, last = fill_spatial(first, joints[1], stage.rates, sweep)
    copy_pose(sweep.poses[m], sweep.moving)
    copy_pose(T_palm_resting, sweep.resting)
    for k in range(3):
        sweep.moving[k, 3] -= sweep.anchor[last, k]
        sweep.resting[k, 3] -= sweep.anchor[first, k]
    return BodyPair(links, m, resting, r, sweep.spatial, count, stage.touch)


@kernel
def lane_of(box: Floats, T: Floats, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the extent of a body's box along an axis; NaN, which parts nothing, where there is no box."""
    middle, half = x * T[0, 3] + y * T[1, 3] + z * T[2, 3], 0.0
    for k in range(3):
        along = x * T[0, k] + y * T[1, k] + z * T[2, k]
        middle += along * box[k]
        half += abs(along) * box[3 + k]
    return middle - half, middle + half


@kernel
def place_pair(
    stage: Stage,
    m: int,
    resting: BodyArrays,
    r: int,
    T_palm_resting: Floats,
    joints: tuple[int, int],
    work: Work,
    sweep: SweepWork,
) -> BodyPair:
    """Return a moving link and a resting body as `sweep_body` takes them; their poses are written to `sweep`.

    A pair whose chain has no rows never meets.

    Args:
        stage: the segment, for which `sweep_stage` has placed joints, axes and links.
        T_palm_resting: where the body is. joints: first active joint, and the last joint that moves the link.
    """
    first, last = joints
    while stage.rates[last] == 0.0:
        last -= 1
    if stage.chain.joint_axis_group[last] == stage.chain.joint_axis_group[first]:
        return place_turning(stage, m, resting, r, T_palm_resting, joints, work, sweep)
    return place_spatially(stage, m, resting, r, T_palm_resting, joints, sweep)


@kernel
def first_after(full_width: FullWidthArrays, finger_posture: int, link: int, first: int, rates: Floats) -> int:
    """Return the first active joint that does not move a link, or how many joints there are."""
    j = last_mover(full_width, finger_posture, link, first - 1) + 1
    while j < rates.shape[0] and rates[j] == 0.0:
        j += 1
    return j


@kernel
def put_lanes(stage: Stage, several: bool, first: int, sweep: SweepWork) -> None:
    """Write `lane` and `after` of every link at `sweep.poses`; where `several` axis groups move there are no lanes."""
    full_width, lane = stage.full_width, sweep.lane
    T_palm_axis_group = stage.axis_groups[stage.chain.joint_axis_group[first]]
    links = full_width.checked.shape[0]
    x, y, z = T_palm_axis_group[0, 1], T_palm_axis_group[1, 1], T_palm_axis_group[2, 1]
    for r in range(links):
        sweep.after[r] = first_after(full_width, stage.finger_posture, r, first, stage.rates)
    for r in range(links + 1):
        if several:
            lane[r, 0], lane[r, 1] = -math.inf, math.inf
        elif r < links:
            lane[r, 0], lane[r, 1] = lane_of(full_width.links.box[r], sweep.poses[r], x, y, z)
        else:
            lane[r, 0], lane[r, 1] = lane_of(full_width.object.box[0], stage.T_palm_object, x, y, z)


@kernel
def sweep_links(
    stage: Stage, m: int, first: int, joint: int, best: float, work: Work, sweep: SweepWork
) -> tuple[float, int]:
    """Return the first contact of a moving link with other links of the hand before `best`, and that link or -1.

    Args:
        m: the moving link. first, joint: first active joint, and the last joint that moves it; see `place_pair`.
    """
    full_width, met, lane = stage.full_width, -1, sweep.lane
    for r in range(full_width.checked.shape[0]):
        if full_width.checked[m, r] == 0:
            continue
        # Seen from a link that moves as well, only the joints after its own turn.
        after = sweep.after[r]
        if after > joint or lanes_apart((lane[m, 0], lane[m, 1]), (lane[r, 0], lane[r, 1])):
            continue
        if full_width.links.root[r] < 0:
            continue
        pair = place_pair(stage, m, full_width.links, r, sweep.poses[r], (after, joint), work, sweep)
        found = sweep_body(pair, best, sweep) if pair.rows > 0 else best
        if found < 0.0:
            sweep.skipped[0] += 1
        elif found < best:
            best, met = found, r
            keep_pair(sweep)
    return best, met


@kernel
def sweep_stage(stage: Stage, best: float, work: Work, sweep: SweepWork) -> tuple[float, int]:
    """Return how far a path segment goes before a moving link meets anything it must not overlap, at most `best`.

    Args:
        stage: the segment. work, sweep: scratch space.

    Returns:
        the travel; the met body: -1 nothing, L the object, else a link of the hand. `sweep.winner` and `sweep.poses`,
        which has every link where it is at the start of the segment, describe it. A link that overlaps the object
        already gives `OVERLAP`; links that overlap each other already are left alone, and counted.
    """
    first = place_stage(stage, work, sweep)
    if first == stage.rates.shape[0]:
        return best, -1
    best, met = sweep_towards_object(stage, first, best, work, sweep)
    if best < 0.0:
        return best, met
    if is_known(stage, best):
        return take_first_meeting(stage, best, met, sweep)
    return sweep_hand(stage, first, best, met, work, sweep)


@kernel
def place_stage(stage: Stage, work: Work, sweep: SweepWork) -> int:
    """Place joints, axes and links where a segment begins, and return the first active joint.

    Without one the result is how many joints there are, and nothing is placed.
    """
    first, rates = 0, stage.rates
    while first < rates.shape[0] and rates[first] == 0.0:
        first += 1
    if first < rates.shape[0]:
        several = place_active(stage, first, work, sweep)
        pose_movers(stage.full_width, stage.chain, stage.finger_posture, stage.turns, sweep.poses)
        put_lanes(stage, several, first, sweep)
    return first


@kernel
def sweep_hand(stage: Stage, first: int, best: float, met: int, work: Work, sweep: SweepWork) -> tuple[float, int]:
    """Return what `sweep_stage` does for links of the hand alone, which rest or move.

    Args:
        first: the first active joint. best, met: the first contact so far, and what is met there.
    """
    full_width, finger_posture = stage.full_width, stage.finger_posture
    for n in range(full_width.mover_first[finger_posture], full_width.mover_first[finger_posture + 1]):
        m, joint = full_width.mover_link[n], full_width.mover_joint[n]
        if joint >= first and full_width.links.root[m] >= 0:
            best, other = sweep_links(stage, m, first, joint, best, work, sweep)
            if other >= 0:
                met = other
    return best, met


@kernel
def is_known(stage: Stage, best: float) -> bool:
    """Say whether `FirstMeetings` has what the segment's links meet of the hand before `best`."""
    full_width, finger_posture = stage.full_width, stage.finger_posture
    known, rates = full_width.first.known[finger_posture], full_width.first.rates[finger_posture]
    if not full_width.alone or known[0] != stage.touch or best > known[1]:
        return False
    for j in range(full_width.joint_first[finger_posture], full_width.joint_first[finger_posture + 1]):
        if stage.turns[j] != 0.0 or stage.rates[j] != rates[j]:
            return False
    return True


@kernel
def take_first_meeting(stage: Stage, best: float, met: int, sweep: SweepWork) -> tuple[float, int]:
    """Return what `sweep_hand` does where `is_known`."""
    first, finger_posture = stage.full_width.first, stage.finger_posture
    found = first.met[finger_posture]
    sweep.skipped[0] += found[5]
    if not first.known[finger_posture, 2] < best:
        return best, met
    for k in range(4):
        sweep.winner[k] = found[1 + k]
    return float(first.known[finger_posture, 2]), int(found[0])


@kernel
def put_first_meeting(stage: Stage, reach: float, work: Work, sweep: SweepWork) -> None:
    """Write what the links of a finger posture meet of the hand on their first path segment; see `FirstMeetings`.

    Args:
        stage: the segment, on which a joint moves. reach: how far it is swept, at least as far as it goes.
    """
    full_width, finger_posture, first = stage.full_width, stage.finger_posture, place_stage(stage, work, sweep)
    known, met = full_width.first.known[finger_posture], full_width.first.met[finger_posture]
    sweep.skipped[0] = 0
    known[0], known[1] = stage.touch, reach
    known[2], met[0] = sweep_hand(stage, first, reach, -1, work, sweep)
    for k in range(4):
        met[1 + k] = sweep.winner[k]
    met[5] = sweep.skipped[0]
    for j in range(stage.rates.shape[0]):
        full_width.first.rates[finger_posture, j] = stage.rates[j]


@kernel
def sweep_towards_object(stage: Stage, first: int, best: float, work: Work, sweep: SweepWork) -> tuple[float, int]:
    """Return what `sweep_stage` does for the object alone.

    Links are swept in the order in which they may touch, as the object's grid tells. What the first of them leave
    of the way, the others often pass without a closer look.
    """
    full_width, met, order, clear, lead = stage.full_width, -1, sweep.order, sweep.clear, sweep.lead
    if full_width.object.root[0] < 0:
        return best, met
    for k in range(order_movers(stage, first, best, work, sweep)):
        n = order[k]
        m, joint = full_width.mover_link[n], full_width.mover_joint[n]
        if clear[k] >= best > 0.0:
            break
        pair = place_pair(stage, m, full_width.object, 0, stage.T_palm_object, (first, joint), work, sweep)
        sweep.near[5] = lead[k]
        found = sweep_from(pair, clear[k], best, sweep)
        if found < best:
            best, met = found, full_width.checked.shape[0]
            keep_pair(sweep)
            if best < 0.0:
                break
    return best, met


@kernel
def order_movers(stage: Stage, first: int, best: float, work: Work, sweep: SweepWork) -> int:
    """Write which links may touch the object before `best`, and from when on, the earliest first; return how many."""
    full_width, lane, order, clear, lead = stage.full_width, sweep.lane, sweep.order, sweep.clear, sweep.lead
    links, count = full_width.checked.shape[0], 0
    for n in range(full_width.mover_first[stage.finger_posture], full_width.mover_first[stage.finger_posture + 1]):
        m, joint = full_width.mover_link[n], full_width.mover_joint[n]
        if joint < first or full_width.links.root[m] < 0:
            continue
        if lanes_apart((lane[m, 0], lane[m, 1]), (lane[links, 0], lane[links, 1])):
            continue
        pair = place_pair(stage, m, full_width.object, 0, stage.T_palm_object, (first, joint), work, sweep)
        if pair.rows == 0:
            continue
        begin = clear_by_grid(pair, best, sweep)
        if begin == math.inf:
            continue
        k = count
        while k > 0 and clear[k - 1] > begin:
            clear[k], order[k], lead[k] = clear[k - 1], order[k - 1], lead[k - 1]
            k -= 1
        clear[k], order[k], lead[k] = begin, n, sweep.near[5]
        count += 1
    return count


@kernel
def place_active(stage: Stage, first: int, work: Work, sweep: SweepWork) -> bool:
    """Place the joints of every axis group that has active ones in its frame, and in the palm's where they are several.

    Returns:
        whether several axis groups have active joints.
    """
    chain, rates, before, several = stage.chain, stage.rates, -1, False
    for j in range(first, rates.shape[0]):
        axis_group = chain.joint_axis_group[j]
        if rates[j] != 0.0 and axis_group != before:
            place_joints(chain, axis_group, stage.turns, work.place)
            several = before >= 0
            before = axis_group
    if several:
        place_axes(stage.full_width, stage.finger_posture, stage.turns, sweep)
    return several
