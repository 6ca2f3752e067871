"""The contacts of a finger at its final posture: where later motions left them (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import PASSED_GAP, TOUCH_FRACTION
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_contact import settle_hit
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.sections.turning import STILL
from clench.kernels.toi.full_width import ExactArrays, describe_pair, keep_pair, place_axes, pose_movers
from clench.kernels.toi.toi_work import SweepWork, body_gap, elements_of, put_core

from .layout import (
    HIT_FAMILY,
    HIT_FEATURE,
    HIT_GAP,
    HIT_GROUP,
    HIT_JOINT,
    HIT_OUTLINE,
    HIT_PLANE,
    HIT_SOURCE,
    HIT_WHICH,
    ChainArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    ItemArrays,
    SectionArrays,
    Work,
)


@kernel
def settle(
    hand: HandArrays,
    exact: ExactArrays,
    T_palm_object: Floats,
    start: int,
    shared: SectionArrays,
    own: SectionArrays,
    items: ItemArrays,
    i: int,
    work: Work,
    sweep: SweepWork,
    answer: ClosingArrays,
) -> None:
    """Evaluate an item's contacts again at its final posture."""
    entry, turns = items.entry[i], answer.turn[i]
    if exact.wanted[i]:
        pose_movers(exact, hand.chain, entry, turns, sweep.poses)
    touch = TOUCH_FRACTION * hand.family_length[start]
    for n in range(answer.contacts[i]):
        hit, point = answer.hit[i, n], answer.point[i, n]
        family = hit[HIT_FAMILY]
        if hit[HIT_PLANE] < 0:
            settle_pair(exact, hand.chain, entry, turns, T_palm_object, hit, point, touch, sweep)
            continue
        settle_hit(hand, start, shared, own, turns, hit, point, work)
        if exact.wanted[i] and later_turned(hand, entry, family, turns):
            settle_carried(exact, hand, entry, turns, T_palm_object, hit, point, sweep)


@kernel
def later_turned(hand: HandArrays, entry: int, family: int, turns: Floats) -> bool:
    """Say whether joints of families after a contact's own have turned: its plane does not tell where it is by now."""
    for j in range(turns.shape[0]):
        if family < hand.chain.joint_family[j] < hand.entry_family[entry + 1] and turns[j] != 0.0:
            return True
    return False


@kernel
def closest_pair(exact: ExactArrays, T_palm_object: Floats, m: int, met: int, bound: float, sweep: SweepWork) -> float:
    """Find the closest elements of a link and of the body that it met, at `sweep.poses`; return their gap."""
    on_object = met == exact.checked.shape[0]
    copy_pose(sweep.poses[m], sweep.moving)
    copy_pose(T_palm_object if on_object else sweep.poses[met], sweep.resting)
    resting, r = (exact.object, 0) if on_object else (exact.links, met)
    return body_gap(exact.links, m, resting, r, bound, 1.0, sweep)


@kernel
def settle_carried(
    exact: ExactArrays,
    hand: HandArrays,
    entry: int,
    turns: Floats,
    T_palm_object: Floats,
    hit: Ints,
    point: Floats,
    sweep: SweepWork,
) -> None:
    """Describe a contact on a plane exactly if its link, which joints of later families carried on, still touches."""
    m, met = int(hand.outlines.link[hit[HIT_OUTLINE]]), exact.checked.shape[0]
    bound = 2.0 * PASSED_GAP
    if closest_pair(exact, T_palm_object, m, met, bound, sweep) > PASSED_GAP:
        return
    put_core(exact.links, sweep.pair[0], sweep.poses[m], sweep.core)
    put_core(exact.object, sweep.pair[1], T_palm_object, sweep.fixed)
    ka, kb = exact.links.corners[sweep.pair[0]], exact.object.corners[sweep.pair[1]]
    _, nx, ny, nz, _, _, x, y, z = separation(sweep.core, ka, sweep.fixed, kb)
    if holds_exactly(exact, hand.chain, entry, turns, hit, (x, y, z), (nx, ny, nz), sweep):
        keep_pair(sweep)
        describe_pair(exact, T_palm_object, met, hit[HIT_GROUP], hit[HIT_FAMILY], sweep, hit, point)


@kernel
def closest_element(exact: ExactArrays, T_palm_object: Floats, m: int, k: int, sweep: SweepWork) -> int:
    """Return the element of a link at `sweep.poses` that is closest to an element of the object."""
    links, target = exact.links, exact.object
    put_core(target, k, T_palm_object, sweep.fixed)
    closest, least = -1, math.inf
    begin, end = elements_of(links, m)
    for i in range(begin, end):
        put_core(links, i, sweep.poses[m], sweep.core)
        gap = separation(sweep.core, links.corners[i], sweep.fixed, target.corners[k])[0] - links.radius[i]
        if gap < least:
            closest, least = i, gap
    return closest


@kernel
def settle_pair(
    exact: ExactArrays,
    chain: ChainArrays,
    entry: int,
    turns: Floats,
    T_palm_object: Floats,
    hit: Ints,
    point: Floats,
    touch: float,
    sweep: SweepWork,
) -> None:
    """Evaluate an exact contact again with the links at `sweep.poses`; it may have rolled on to other elements.

    Where the link only touches something else by now, which does not hold what was stopped, the contact is left behind.
    """
    m, met = hit[HIT_OUTLINE], hit[HIT_WHICH]
    i, k = hit[HIT_FEATURE], hit[HIT_SOURCE]
    sweep.winner[0], sweep.winner[1], sweep.winner[2] = i, k, m
    describe_pair(exact, T_palm_object, met, hit[HIT_GROUP], hit[HIT_FAMILY], sweep, hit, point)
    if abs(point[HIT_GAP]) <= touch:
        return
    closest_pair(exact, T_palm_object, m, met, math.inf, sweep)
    keep_pair(sweep)
    describe_pair(exact, T_palm_object, met, hit[HIT_GROUP], hit[HIT_FAMILY], sweep, hit, point)
    if met == exact.checked.shape[0] and point[HIT_GAP] <= PASSED_GAP:
        at, normal = (point[0], point[1], point[2]), (point[3], point[4], point[5])
        if not holds_exactly(exact, chain, entry, turns, hit, at, normal, sweep):
            sweep.winner[0], sweep.winner[1] = closest_element(exact, T_palm_object, m, k, sweep), k
            describe_pair(exact, T_palm_object, met, hit[HIT_GROUP], hit[HIT_FAMILY], sweep, hit, point)


@kernel
def holds_exactly(
    exact: ExactArrays,
    chain: ChainArrays,
    entry: int,
    turns: Floats,
    hit: Ints,
    at: Vector,
    normal: Vector,
    sweep: SweepWork,
) -> bool:
    """Say what `holds` does of a point and a normal in the palm frame; the joints may be of several families."""
    place_axes(exact, entry, turns, sweep)
    slope, lever = 0.0, 0.0
    for j in range(exact.joint_first[entry], hit[HIT_JOINT] + 1):
        if chain.joint_group[j] == hit[HIT_GROUP]:
            axis = (sweep.axis[j, 0], sweep.axis[j, 1], sweep.axis[j, 2])
            arm = (at[0] - sweep.anchor[j, 0], at[1] - sweep.anchor[j, 1], at[2] - sweep.anchor[j, 2])
            speed = cross(axis, arm)
            slope += chain.rate[j] * dot(speed, normal)
            lever += abs(chain.rate[j]) * math.sqrt(dot(speed, speed))
    return slope <= STILL * lever
