"""The first contact of a finger along one path segment, on some of its planes (docs/method.md sections 3 and 4)."""

from __future__ import annotations

import math

import numpy as np

from clench.core.tolerances import TOUCH_FRACTION
from clench.kernels.closing.layout import (
    KIND_EDGE,
    KIND_TIP,
    ChainArrays,
    Floats,
    HandArrays,
    Outline,
    OutlineArrays,
    PlaneSection,
    SectionArrays,
    Work,
)
from clench.kernels.runtime.compiling import kernel

from .outline_sweep import farthest, first_near, put_stadium, sweep_ellipses, sweep_outline, turn_outline
from .turning_pairs import sooner

#: Several joints at once move on by at most this before gaps are looked at anew [travel].
STRIDE = 0.06


@kernel(allocates=True)
def make_work(joints: int, outlines: OutlineArrays) -> Work:
    """Allocate the scratch space for a hand."""
    rows = joints + 1
    return Work(
        np.zeros((joints, 5)),
        np.zeros((joints, 5)),
        np.zeros(joints),
        np.empty((outlines.vertex.shape[0], 3)),
        np.empty((outlines.side.shape[0], 5)),
        np.empty((outlines.joint.shape[0], 6)),
        np.empty((rows, 3)),
        np.empty((rows * (rows + 1), 3)),
        np.empty(8),
        np.zeros(joints),
        np.zeros(joints),
        np.zeros(joints, dtype=np.int64),
        np.zeros((2, 3, 4)),
        np.zeros(13, dtype=np.int64),
    )


@kernel
def place_joints(chain: ChainArrays, axis_group: int, turns: Floats, place: Floats) -> None:
    """Write where the joints of an axis group are when each has turned by `turns` [rad]; see `Work`."""
    x, z, angle, c, s = 0.0, 0.0, 0.0, 1.0, 0.0
    for j in range(turns.shape[0]):
        if chain.joint_axis_group[j] == axis_group:
            x += c * chain.pivot[j, 0] - s * chain.pivot[j, 1]
            z += s * chain.pivot[j, 0] + c * chain.pivot[j, 1]
            angle += turns[j]
            c, s = math.cos(angle), math.sin(angle)
            place[j, 0], place[j, 1], place[j, 2], place[j, 3], place[j, 4] = x, z, angle, c, s


@kernel
def put_outline(
    outlines: OutlineArrays, o: int, j: int, place: Floats, cx: float, cz: float, mirror: float, work: Work
) -> Outline:
    """Write an outline's features at its placed joint `j` about a centre, mirrored in z for clockwise turns."""
    dx, dz, c, s = place[j, 0] - cx, place[j, 1] - cz, place[j, 3], place[j, 4]
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
    put_stadium(outlines.stadium, o, c, s, dx, dz, mirror, work.stadium)
    radius = outlines.radius[o]
    return Outline(o, v0, v1, s0, s1, radius, outlines.both[o] != 0, KIND_TIP if radius > 0.0 else KIND_EDGE)


@kernel
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


@kernel
def advance_outline(
    hand: HandArrays,
    o: int,
    axis_group: int,
    section: PlaneSection,
    first: int,
    turns: Floats,
    rates: Floats,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of one outline with a plane's section before `best`, else `best`.

    Behind one active joint an outline turns about that joint's pivot (mirrored when it turns clockwise). Behind
    several, its features are relative to the last of them. Certainly free motion is passed in one step, and the rest is
    cut into short strides. At the start of a stride a feature's gap costs no trigonometry, and most gaps are too wide
    for it.
    """
    chain, outlines = hand.chain, hand.outlines
    joint, place = outlines.joint[o], work.place
    count, last, rate, speed = fill_chain(joint, first, rates, place, work)
    if count == 0:
        return best
    px, pz = place[first, 0], place[first, 1]
    if count == 1:
        mirror = -1.0 if rate < 0.0 else 1.0
        outline = put_outline(outlines, o, joint, place, place[last, 0], place[last, 1], mirror, work)
        work.chain[0, 0] = abs(rate)
        best = turn_outline(outline, section, (px, pz, mirror), abs(rate), best, work)
        return sweep_ellipses(outline, section, (px, pz, mirror), 1, best, work)
    begun, origin = 0.0, (px, pz, 1.0)
    while begun < best:
        for j in range(turns.shape[0]):
            work.turns[j] = turns[j] + rates[j] * begun
        place_joints(chain, axis_group, work.turns, work.moved)
        count, last, rate, speed = fill_chain(joint, first, rates, work.moved, work)
        outline = put_outline(outlines, o, joint, work.moved, work.moved[last, 0], work.moved[last, 1], 1.0, work)
        x, z = work.moved[last, 0], work.moved[last, 1]
        speed += abs(rate) * farthest(work.stadium, o)
        lead, nearest = first_near(outline, section.sections, section.row, x, z, speed, section.touch, work)
        if lead > STRIDE:
            begun += lead
            continue
        stride = min(STRIDE, best - begun)
        found = sweep_outline(outline, section, origin, (x, z), nearest, count, speed, stride, work)
        found = sweep_ellipses(outline, section, origin, count, found, work)
        if found < stride:
            return sooner(begun + found, best)
        begun += stride
    return best


@kernel
def advance(
    hand: HandArrays,
    axis_group: int,
    sections: SectionArrays,
    base: int,
    planes: tuple[int, int],
    closed: bool,
    turns: Floats,
    rates: Floats,
    length: float,
    work: Work,
) -> tuple[float, int]:
    """Return how far a finger gets along a path segment before its first contact, and the plane of that contact.

    Args:
        hand: the fingers. axis_group: the axis group of the active joints.
        sections: whose row `plane - base` belongs to `plane`. planes: the range of those in use.
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
    best, contact = length, -1
    if first < 0:
        return best, contact
    place_joints(hand.chain, axis_group, turns, work.place)
    touch = TOUCH_FRACTION * hand.axis_group_length[axis_group]
    for plane in range(planes[0], planes[1]):
        section = PlaneSection(sections, plane - base, closed, touch)
        for o in range(hand.plane_outline[plane], hand.plane_outline[plane + 1]):
            found = advance_outline(hand, o, axis_group, section, first, turns, rates, best, work)
            if found < best:
                best, contact = found, plane
                if best == 0.0:
                    return best, contact
    return best, contact
