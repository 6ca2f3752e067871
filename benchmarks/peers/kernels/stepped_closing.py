"""Closing a hand in small steps, with a collision query after each: the baselines of `clench bench peers`.

Nothing else uses them. They follow the rules of GraspIt!'s autoGrasp, of Simox's closeActors and of OpenRAVE's grasper,
on the same solids as the sweeps, so that a difference comes from the method alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.link_frames import FrameArrays, couple, put_link
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose_inverse

from .box_query import BoxTrees, Query, make_query, within

#: States of a degree of freedom.
MOVING, AT_LIMIT, AT_CONTACT = 0, 1, 2
#: Rules of stepping.
ALL_AT_ONCE, ROUND_ROBIN, ONE_BY_ONE = 0, 1, 2
#: Columns of the tally: collision queries, distance queries, postures looked at.
COLLISIONS, DISTANCES, POSTURES = 0, 1, 2
#: Halvings of a step that ends in collision.
HALVINGS = 60
#: Two contacts are found at once when the farther one is within this many tolerances.
ALSO_CONTACT = 2.0


class SteppedHand(NamedTuple):
    """The data of a hand for stepping; L links, D free degrees of freedom.

    Args:
        frames: its kinematics.
        free: joint of each degree of freedom, palm side first, finger after finger, (D,). finger: its own, (D,).
        rate: +1 or -1, so that it closes, (D,). end: its limit in that direction [rad], (D,).
        owner: the finger of each link, -1 where nothing closes it, (L,).
        moves: whether a degree of freedom moves a link that can touch, (D, L).
        links: every link in its own frame.
    """

    frames: FrameArrays
    free: Ints
    finger: Ints
    rate: Floats
    end: Floats
    owner: Ints
    moves: Ints
    links: BoxTrees


class StepLog(NamedTuple):
    """Keep the first N queries: posture, (N, J); link, whether for a distance, and whether it hit, (N, 3)."""

    postures: Floats
    queries: Ints


class _State(NamedTuple):
    """State of one closing: postures now and tried, (J,); states, (D,); poses of links; counts; log; scratch space."""

    q: Floats
    trial: Floats
    stops: Ints
    poses: Floats
    turn: Floats
    local: Floats
    tally: Ints
    log: StepLog
    query: Query
    target_pose: Floats


@entry_kernel(allocates=True)
def close_in_steps(
    rule: int,
    hand: SteppedHand,
    target: BoxTrees,
    T_root_target: Floats,
    q: Floats,
    step: float,
    fine: float,
    most: int,
    stops: Ints,
    tally: Ints,
    log: StepLog,
) -> None:
    """Close a hand around a body by a rule of stepping.

    Args:
        rule: `ALL_AT_ONCE`: a step that collides is halved until the gap is below `fine` [m]; a link within twice that
            stops the joints before it. `ROUND_ROBIN`: what collides goes back one step; once all stand, one more round.
            `ONE_BY_ONE`: steps until a hit, one back, then steps of `fine` [rad] until a hit, where it stays.
        target: one solid. T_root_target: its pose, (3, 4).
        q: the posture [rad], (J,), read and written. step: [rad]. most: rounds at most.
        stops, tally: the state of each degree of freedom, (D,); the numbers of queries by kind, (3,). log: see there.
    """
    joints, links = q.shape[0], hand.frames.parent.shape[0]
    poses, turn, local = np.empty((links, 3, 4)), np.empty((3, 4)), np.empty((3, 4))
    state = _State(q, np.empty(joints), stops, poses, turn, local, tally, log, make_query(), T_root_target)
    stops[:], tally[:] = MOVING, 0
    for i in range(links):
        put_link(hand.frames, i, q, state.turn, state.local, state.poses)
    if rule == ALL_AT_ONCE:
        step_all(hand, target, state, step, fine, most)
    elif rule == ROUND_ROBIN:
        for _ in range(most):
            if not step_each(hand, target, state, step):
                break
        step_once_more(hand, target, state, step)
    else:
        for d in range(hand.free.shape[0]):
            step_one(hand, target, state, d, step, fine)


@kernel
def step_all(hand: SteppedHand, target: BoxTrees, state: _State, step: float, tolerance: float, most: int) -> None:
    """Move everything at once; halve a step that collides until the gap is small, and stop what touches."""
    for _ in range(most):
        moving = False
        for d in range(hand.free.shape[0]):
            moving = moving or state.stops[d] == MOVING
        if not moving:
            return
        move_all(hand, state, step)
        if any_hit(hand, target, state):
            low, high = 0.0, 1.0
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                move_all(hand, state, middle * step)
                if any_hit(hand, target, state):
                    high = middle
                    continue
                low = middle
                if any_near(hand, target, state, tolerance):
                    break
            move_all(hand, state, low * step)
            put_links(hand, state.trial, state, -1)
            if not stop_near(hand, target, state, ALSO_CONTACT * tolerance):
                stop_hit(hand, target, state, high * step)
                move_all(hand, state, 0.0)
        accept(hand, state)


@kernel
def step_each(hand: SteppedHand, target: BoxTrees, state: _State, step: float) -> bool:
    """Move every degree of freedom that still moves by one step; say whether any does."""
    moved = False
    for d in range(hand.free.shape[0]):
        if state.stops[d] != MOVING:
            continue
        move_one(hand, state, d, step)
        if hits(hand, target, state, d):
            state.stops[d] = AT_CONTACT
        else:
            accept(hand, state)
            moved = True
    return moved


@kernel
def step_once_more(hand: SteppedHand, target: BoxTrees, state: _State, step: float) -> None:
    """Try one more step with everything that stands at a contact."""
    for d in range(hand.free.shape[0]):
        if state.stops[d] == AT_CONTACT:
            move_one(hand, state, d, step)
            if not hits(hand, target, state, d):
                accept(hand, state)


@kernel
def step_one(hand: SteppedHand, target: BoxTrees, state: _State, d: int, step: float, fine: float) -> None:
    """Move one degree of freedom in steps until it hits, then from the step before in fine ones."""
    while state.stops[d] == MOVING:
        move_one(hand, state, d, step)
        if hits(hand, target, state, d):
            break
        accept(hand, state)
    while state.stops[d] == MOVING:
        move_one(hand, state, d, fine)
        hit = hits(hand, target, state, d)
        accept(hand, state)
        if hit:
            state.stops[d] = AT_CONTACT


@kernel
def move_all(hand: SteppedHand, state: _State, step: float) -> None:
    """Write the posture one step on of everything that moves to `trial`."""
    copy_posture(state.q, state.trial)
    for d in range(hand.free.shape[0]):
        if state.stops[d] == MOVING:
            state.trial[hand.free[d]] = stepped(hand, state.q, d, step)
    couple(hand.frames, state.trial)


@kernel
def move_one(hand: SteppedHand, state: _State, d: int, step: float) -> None:
    """Write the posture one step of one degree of freedom on to `trial`."""
    copy_posture(state.q, state.trial)
    state.trial[hand.free[d]] = stepped(hand, state.q, d, step)
    couple(hand.frames, state.trial)


@kernel
def stepped(hand: SteppedHand, q: Floats, d: int, step: float) -> float:
    """Return an angle one step on, at most at its limit."""
    left = (hand.end[d] - q[hand.free[d]]) * hand.rate[d]
    if step >= left:
        return float(hand.end[d])
    return float(q[hand.free[d]] + hand.rate[d] * step)


@kernel
def copy_posture(q: Floats, out: Floats) -> None:
    """Write a posture elsewhere."""
    for j in range(q.shape[0]):
        out[j] = q[j]


@kernel
def accept(hand: SteppedHand, state: _State) -> None:
    """Go to the tried posture, and note the joints at their limits."""
    copy_posture(state.trial, state.q)
    for d in range(hand.free.shape[0]):
        if state.stops[d] == MOVING and state.q[hand.free[d]] == hand.end[d]:
            state.stops[d] = AT_LIMIT


@kernel
def is_moving(hand: SteppedHand, state: _State, m: int) -> bool:
    """Say whether a link is moved by anything that moves."""
    found = False
    for d in range(hand.free.shape[0]):
        if state.stops[d] == MOVING and hand.moves[d, m]:
            found = True
            break
    return found


@kernel
def any_hit(hand: SteppedHand, target: BoxTrees, state: _State) -> bool:
    """Say whether any moving link collides at the posture that is tried."""
    put_links(hand, state.trial, state, -1)
    found = False
    for m in range(hand.frames.parent.shape[0]):
        if is_moving(hand, state, m) and hit_of(hand, target, state, m):
            found = True
            break
    return found


@kernel
def any_near(hand: SteppedHand, target: BoxTrees, state: _State, bound: float) -> bool:
    """Say whether any moving link is nearer than a bound at the posture that is tried."""
    found = False
    for m in range(hand.frames.parent.shape[0]):
        if is_moving(hand, state, m) and near_of(hand, target, state, m, bound):
            found = True
            break
    return found


@kernel
def hits(hand: SteppedHand, target: BoxTrees, state: _State, d: int) -> bool:
    """Say whether a link that a degree of freedom moves collides at the posture that is tried."""
    put_links(hand, state.trial, state, hand.finger[d])
    found = False
    for m in range(hand.frames.parent.shape[0]):
        if hand.moves[d, m] and hit_of(hand, target, state, m):
            found = True
            break
    return found


@kernel
def stop_near(hand: SteppedHand, target: BoxTrees, state: _State, bound: float) -> bool:
    """Stop the joints of links that are nearer than a bound; say whether there is such a link."""
    found = False
    for m in range(hand.frames.parent.shape[0]):
        if is_moving(hand, state, m) and near_of(hand, target, state, m, bound):
            stop_link(hand, state, m)
            found = True
    return found


@kernel
def stop_hit(hand: SteppedHand, target: BoxTrees, state: _State, step: float) -> None:
    """Stop the joints of links that collide one step on, if no gap can be found before it."""
    move_all(hand, state, step)
    put_links(hand, state.trial, state, -1)
    for m in range(hand.frames.parent.shape[0]):
        if is_moving(hand, state, m) and hit_of(hand, target, state, m):
            stop_link(hand, state, m)


@kernel
def stop_link(hand: SteppedHand, state: _State, m: int) -> None:
    """Stop the joints of a link."""
    for d in range(hand.free.shape[0]):
        if hand.moves[d, m] and state.stops[d] == MOVING:
            state.stops[d] = AT_CONTACT


@kernel
def hit_of(hand: SteppedHand, target: BoxTrees, state: _State, m: int) -> bool:
    """Say whether one link collides: one query."""
    hit = meets(hand, target, state, m, 0.0)
    note(state, m, COLLISIONS, hit)
    return hit


@kernel
def near_of(hand: SteppedHand, target: BoxTrees, state: _State, m: int, bound: float) -> bool:
    """Say whether one link that does not collide is nearer than a bound: one query."""
    near = meets(hand, target, state, m, bound)
    note(state, m, DISTANCES, near)
    return near


@kernel
def meets(hand: SteppedHand, target: BoxTrees, state: _State, m: int, bound: float) -> bool:
    """Say whether a link crosses the target or is nearer than a bound."""
    compose_inverse(state.target_pose, state.poses[m], state.query.pose)
    return bool(within(hand.links, m, target, 0, bound, state.query))


@kernel
def note(state: _State, m: int, kind: int, answer: bool) -> None:
    """Count a query, and keep it while there is room."""
    row = state.tally[COLLISIONS] + state.tally[DISTANCES]
    state.tally[kind] += 1
    if row < state.log.queries.shape[0]:
        copy_posture(state.trial, state.log.postures[row])
        state.log.queries[row, 0], state.log.queries[row, 1] = m, kind
        state.log.queries[row, 2] = 1 if answer else 0


@kernel
def put_links(hand: SteppedHand, q: Floats, state: _State, finger: int) -> None:
    """Write the poses of the links of a finger in the frame of the root; of all fingers for -1."""
    state.tally[POSTURES] += 1
    for i in range(hand.frames.parent.shape[0]):
        if hand.owner[i] >= 0 and (finger < 0 or hand.owner[i] == finger):
            put_link(hand.frames, i, q, state.turn, state.local, state.poses)
