"""The first contact of a finger along one path segment, on some of its planes (METHOD.md sections 3 and 4)."""

from __future__ import annotations

import math

import numpy as np

from clench.base.tolerances import TOUCH_FRACTION

from .compiling import inner_allocating_kernel, inner_kernel
from .conics import sweep_region
from .corners import sharp_blocks
from .coupled_pairs import sweep_disk, sweep_segment
from .layout import (
    KIND_EDGE,
    KIND_TIP,
    ChainArrays,
    Floats,
    HandArrays,
    Outline,
    OutlineArrays,
    SectionArrays,
    Work,
)
from .turning_pairs import sooner, turn_disk, turn_segment

#: Several joints at once move on by at most this before gaps are looked at anew [travel].
STRIDE = 0.06


@inner_allocating_kernel
def make_work(joints: int, outlines: OutlineArrays) -> Work:
    """Allocate the scratch space for a hand."""
    rows = joints + 1
    return Work(
        np.zeros((joints, 3)),
        np.zeros((joints, 3)),
        np.zeros(joints),
        np.empty((outlines.vertex.shape[0], 3)),
        np.empty((outlines.side.shape[0], 5)),
        np.empty((outlines.joint.shape[0], 3)),
        np.empty((rows, 3)),
        np.empty((rows * (rows + 1), 3)),
        np.empty(8),
        np.zeros(13, dtype=np.int64),
    )


@inner_kernel
def place_joints(chain: ChainArrays, family: int, turns: Floats, place: Floats) -> None:
    """Write where the joints of a family are when each has turned by `turns` [rad]."""
    x, z, angle = 0.0, 0.0, 0.0
    for j in range(turns.shape[0]):
        if chain.joint_family[j] == family:
            c, s = math.cos(angle), math.sin(angle)
            x += c * chain.pivot[j, 0] - s * chain.pivot[j, 1]
            z += s * chain.pivot[j, 0] + c * chain.pivot[j, 1]
            angle += turns[j]
            place[j, 0], place[j, 1], place[j, 2] = x, z, angle


@inner_kernel
def put_outline(
    outlines: OutlineArrays, o: int, j: int, place: Floats, cx: float, cz: float, mirror: float, work: Work
) -> Outline:
    """Write an outline's features at its placed joint `j` about a centre, mirrored in z for clockwise turns."""
    dx, dz, angle = place[j, 0] - cx, place[j, 1] - cz, place[j, 2]
    c, s = math.cos(angle), math.sin(angle)
    v0, v1 = outlines.vertex_first[o], outlines.vertex_first[o + 1]
    for i in range(v0, v1):
        x, z = outlines.vertex[i, 0], outlines.vertex[i, 1]
        work.vertex[i, 0] = c * x - s * z + dx
        work.vertex[i, 1] = (s * x + c * z + dz) * mirror
        work.vertex[i, 2] = math.sqrt(work.vertex[i, 0] ** 2 + work.vertex[i, 1] ** 2)
    s0, s1 = outlines.side_first[o], outlines.side_first[o + 1]
    for i in range(s0, s1):
        nx, nz = outlines.side[i, 0], outlines.side[i, 1]
        mx, mz = c * nx - s * nz, s * nx + c * nz
        g = outlines.side[i, 2] + mx * dx + mz * dz
        shift = -mz * dx + mx * dz
        ta, tb = outlines.side[i, 3] + shift, outlines.side[i, 4] + shift
        if mirror < 0.0:
            mz, ta, tb = -mz, -tb, -ta
        work.side[i, 0], work.side[i, 1], work.side[i, 2], work.side[i, 3], work.side[i, 4] = mx, mz, g, ta, tb
    x, z = outlines.disk[o, 0], outlines.disk[o, 1]
    work.disk[o, 0] = c * x - s * z + dx
    work.disk[o, 1] = (s * x + c * z + dz) * mirror
    work.disk[o, 2] = outlines.disk[o, 2]
    radius = outlines.radius[o]
    return Outline(o, v0, v1, s0, s1, radius, outlines.both[o] != 0, KIND_TIP if radius > 0.0 else KIND_EDGE)


@inner_kernel
def fill_chain(joint: int, first: int, rates: Floats, place: Floats, work: Work) -> tuple[int, int, float, float]:
    """Write the chain of active joints up to `joint`.

    Returns:
        its length, its last joint, the total rate and a bound on the speed of the last joint's pivot.
    """
    count, last, rate, speed = 0, first, 0.0, 0.0
    for j in range(first, joint + 1):
        if rates[j] != 0.0:
            if count:
                ex, ez = place[j, 0] - place[last, 0], place[j, 1] - place[last, 1]
                work.chain[count - 1, 1], work.chain[count - 1, 2] = ex, ez
                speed += abs(rate) * math.hypot(ex, ez)
            rate += rates[j]
            work.chain[count, 0] = rate
            count += 1
            last = j
    return count, last, rate, speed


@inner_kernel
def misses(
    cx: float, cz: float, d: float, ex: float, ez: float, wide: bool, mx: float, mz: float, reach: float
) -> bool:
    """Say whether a circle that turns from `c` to `e` at distance `d` stays farther than `reach` from the point `m`.

    `wide`: it turns by more than half a turn, so that only the distance from the pivot tells.
    """
    r = math.sqrt(mx * mx + mz * mz)
    if abs(d - r) > reach:
        return True
    if wide or (cx * mz - cz * mx >= 0.0 and mx * ez - mz * ex >= 0.0):
        return False
    square = reach * reach
    return (mx - cx) ** 2 + (mz - cz) ** 2 > square and (mx - ex) ** 2 + (mz - ez) ** 2 > square


@inner_kernel
def deferred_blocks(
    outline: Outline,
    sections: SectionArrays,
    row: int,
    px: float,
    pz: float,
    mirror: float,
    closed: bool,
    touch: float,
    count: int,
    work: Work,
) -> bool:
    """Decide on sharp pairs that touch at the start; if they block, make the last of them the winner."""
    work.best[6] = 0
    if not sharp_blocks(
        outline,
        sections.segments[row],
        sections.counts[row, 0],
        px,
        pz,
        mirror,
        closed,
        touch,
        work.vertex,
        work.side,
        work.chain,
        work.terms,
        count,
    ):
        return False
    for k in range(6):
        work.best[k] = work.best[7 + k]
    return True


@inner_kernel
def turn_outline(
    outline: Outline,
    sections: SectionArrays,
    row: int,
    closed: bool,
    px: float,
    pz: float,
    mirror: float,
    rate: float,
    touch: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline behind one active joint with a plane's section, before `best`."""
    segments, disks = sections.segments, sections.disks
    vertex, side, pair = work.vertex, work.side, work.best
    cx, cz, reach = work.disk[outline.number, 0], work.disk[outline.number, 1], work.disk[outline.number, 2] + touch
    d = math.sqrt(cx * cx + cz * cz)
    before, ex, ez, wide = -1.0, 0.0, 0.0, False
    for i in range(sections.counts[row, 0]):
        if best != before:
            before, turn = best, best * rate
            c, s = math.cos(turn), math.sin(turn)
            ex, ez, wide = c * cx - s * cz, s * cx + c * cz, turn >= 3.0
        ax, az = segments[row, i, 0] - px, (segments[row, i, 1] - pz) * mirror
        bx, bz = segments[row, i, 2] - px, (segments[row, i, 3] - pz) * mirror
        half = 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
        if not misses(cx, cz, d, ex, ez, wide, 0.5 * (ax + bx), 0.5 * (az + bz), reach + half):
            nx, nz = segments[row, i, 4], segments[row, i, 5] * mirror
            best = turn_segment(outline, i, ax, az, bx, bz, nx, nz, closed, touch, rate, best, vertex, side, pair)
            if best == 0.0:
                return best
    if pair[6] and deferred_blocks(outline, sections, row, px, pz, mirror, closed, touch, 1, work):
        return 0.0
    for i in range(sections.counts[row, 1]):
        qx, qz = disks[row, i, 0] - px, (disks[row, i, 1] - pz) * mirror
        best = turn_disk(outline, i, qx, qz, disks[row, i, 2], touch, rate, best, vertex, side, pair)
    return best


@inner_kernel
def sweep_outline(
    outline: Outline,
    sections: SectionArrays,
    row: int,
    closed: bool,
    px: float,
    pz: float,
    count: int,
    speed: float,
    touch: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline behind several active joints with a plane's section, before `best`."""
    segments, disks = sections.segments, sections.disks
    vertex, side, chain, terms, pair = work.vertex, work.side, work.chain, work.terms, work.best
    # The outline's enclosing circle, relative to the first pivot, and how far it gets.
    x, z = work.disk[outline.number, 0], work.disk[outline.number, 1]
    for k in range(count - 1):
        x += chain[k, 1]
        z += chain[k, 2]
    reach = work.disk[outline.number, 2] + touch + speed * best
    for i in range(sections.counts[row, 0]):
        ax, az = segments[row, i, 0] - px, segments[row, i, 1] - pz
        bx, bz = segments[row, i, 2] - px, segments[row, i, 3] - pz
        near = reach + 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
        if (0.5 * (ax + bx) - x) ** 2 + (0.5 * (az + bz) - z) ** 2 <= near * near:
            nx, nz = segments[row, i, 4], segments[row, i, 5]
            best = sweep_segment(
                outline, i, ax, az, bx, bz, nx, nz, closed, touch, count, speed, best, vertex, side, chain, terms, pair
            )
            if best == 0.0:
                return best
    if pair[6] and deferred_blocks(outline, sections, row, px, pz, 1.0, closed, touch, count, work):
        return 0.0
    for i in range(sections.counts[row, 1]):
        qx, qz = disks[row, i, 0] - px, disks[row, i, 1] - pz
        best = sweep_disk(
            outline, i, qx, qz, disks[row, i, 2], touch, count, speed, best, vertex, side, chain, terms, pair
        )
    return best


@inner_kernel
def advance_outline(
    chain: ChainArrays,
    outlines: OutlineArrays,
    o: int,
    family: int,
    sections: SectionArrays,
    row: int,
    closed: bool,
    first: int,
    turns: Floats,
    rates: Floats,
    touch: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of one outline with a plane's section before `best`, else `best`.

    Behind one active joint an outline turns about that joint's pivot (mirrored when it turns clockwise). Behind
    several, its features are relative to the last of them, and the motion is cut into short strides: at the start of
    a stride a feature's gap costs no trigonometry, and most are too wide for the stride.
    """
    joint, place = outlines.joint[o], work.place
    count, last, rate, speed = fill_chain(joint, first, rates, place, work)
    if count == 0:
        return best
    px, pz = place[first, 0], place[first, 1]
    if count == 1:
        mirror = -1.0 if rate < 0.0 else 1.0
        outline = put_outline(outlines, o, joint, place, place[last, 0], place[last, 1], mirror, work)
        work.chain[0, 0] = abs(rate)
        best = turn_outline(outline, sections, row, closed, px, pz, mirror, abs(rate), touch, best, work)
        return sweep_ellipses(outline, sections, row, px, pz, mirror, 1, touch, best, work)
    begun = 0.0
    while begun < best:
        stride = min(STRIDE, best - begun)
        for j in range(turns.shape[0]):
            work.turns[j] = turns[j] + rates[j] * begun
        place_joints(chain, family, work.turns, work.moved)
        count, last, rate, speed = fill_chain(joint, first, rates, work.moved, work)
        outline = put_outline(outlines, o, joint, work.moved, work.moved[last, 0], work.moved[last, 1], 1.0, work)
        speed += abs(rate) * (math.hypot(work.disk[o, 0], work.disk[o, 1]) + work.disk[o, 2])
        found = sweep_outline(outline, sections, row, closed, px, pz, count, speed, touch, stride, work)
        found = sweep_ellipses(outline, sections, row, px, pz, 1.0, count, touch, found, work)
        if found < stride:
            return sooner(begun + found, best)
        begun += stride
    return best


@inner_kernel
def sweep_ellipses(
    outline: Outline,
    sections: SectionArrays,
    row: int,
    px: float,
    pz: float,
    mirror: float,
    count: int,
    touch: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of a moving outline with the ellipses of a plane's section, before `best`."""
    for i in range(sections.counts[row, 2]):
        for k in range(8):
            work.ellipse[k] = sections.ellipses[row, i, k]
        work.ellipse[0] -= px
        work.ellipse[1] = (work.ellipse[1] - pz) * mirror
        work.ellipse[3] *= mirror
        best = sweep_region(
            outline, i, work.ellipse, touch, count, best, work.vertex, work.side, work.chain, work.terms, work.best
        )
    return best


@inner_kernel
def advance(
    hand: HandArrays,
    family: int,
    sections: SectionArrays,
    base: int,
    low: int,
    high: int,
    closed: bool,
    turns: Floats,
    rates: Floats,
    length: float,
    work: Work,
) -> tuple[float, int]:
    """Return how far a finger gets along a path segment before its first contact, and the plane of that contact.

    Args:
        hand: the fingers. family: the family of the active joints.
        sections: whose row `plane - base` belongs to `plane`. low, high: the range of planes in use.
        closed: the object's winding is known, so that only its outer side counts.
        turns: of every joint at the start [rad], (J,). rates: turn per unit of travel, 0 for resting joints, (J,).
        length: of the segment [travel].

    Returns:
        the travel, `length` when nothing touches; the plane of the contact or -1. `work.best` describes it.
    """
    first = -1
    for j in range(rates.shape[0]):
        if rates[j] != 0.0:
            first = j
            break
    best, hit = length, -1
    if first < 0:
        return best, hit
    place_joints(hand.chain, family, turns, work.place)
    touch = TOUCH_FRACTION * hand.family_length[family]
    for plane in range(low, high):
        for o in range(hand.plane_outline[plane], hand.plane_outline[plane + 1]):
            found = advance_outline(
                hand.chain,
                hand.outlines,
                o,
                family,
                sections,
                plane - base,
                closed,
                first,
                turns,
                rates,
                touch,
                best,
                work,
            )
            if found < best:
                best, hit = found, plane
                if best == 0.0:
                    return best, hit
    return best, hit
