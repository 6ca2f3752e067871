"""Compute a link's contact on a curl plane, at the contact and at the final posture (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import PASSED_GAP, TOUCH_FRACTION
from clench.kernels.closing.layout import (
    CONTACT_AXIS_GROUP,
    CONTACT_CURVE_X,
    CONTACT_CURVE_Z,
    CONTACT_DOF,
    CONTACT_FEATURE,
    CONTACT_GAP,
    CONTACT_JOINT,
    CONTACT_KIND,
    CONTACT_NX,
    CONTACT_NZ,
    CONTACT_OUTLINE,
    CONTACT_PLANE,
    CONTACT_SOURCE,
    CONTACT_WHICH,
    CONTACT_X,
    CONTACT_Z,
    KIND_SIDE,
    ChainArrays,
    Floats,
    HandArrays,
    Ints,
    Outline,
    OutlineArrays,
    SectionArrays,
    Work,
)
from clench.kernels.runtime.compiling import kernel

from .advance import place_joints, put_outline
from .conics import region_gap, support
from .outline_gap import core_distance, outline_distance, point_segment
from .turning import STILL


@kernel
def outline_point(outlines: OutlineArrays, work: Work, o: int, v: int) -> tuple[float, float]:
    """Return where a vertex of an outline is at the placed joints."""
    j = outlines.joint[o]
    x, z = outlines.vertex[v, 0], outlines.vertex[v, 1]
    c, s = work.place[j, 3], work.place[j, 4]
    return c * x - s * z + work.place[j, 0], s * x + c * z + work.place[j, 1]


@kernel
def side_normal(outlines: OutlineArrays, work: Work, o: int, side: int, which: int) -> tuple[float, float]:
    """Return the outward normal of a touching link side at the placed joints; `which` >= 2 is its other face."""
    j = outlines.joint[o]
    c, s = work.place[j, 3], work.place[j, 4]
    if which >= 2:
        c, s = -c, -s
    return c * outlines.side[side, 0] - s * outlines.side[side, 1], s * outlines.side[side, 0] + c * outlines.side[
        side, 1
    ]


@kernel
def touch_segment(
    outlines: OutlineArrays, segment: Floats, work: Work
) -> tuple[float, float, float, float, float, float]:
    """Return point, object normal and curve normal of a touch on a segment or its ends."""
    kind, o, feature, which = work.best[0], work.best[1], work.best[2], work.best[4]
    cx, cz = segment[4], segment[5]
    end = which & 1
    ox, oz = segment[2 * end], segment[2 * end + 1]
    if kind == KIND_SIDE:
        nx, nz = side_normal(outlines, work, o, feature, which)
        nx, nz = -nx, -nz
    else:
        vx, vz = outline_point(outlines, work, o, feature)
        if which >= 2:
            size = math.hypot(vx - ox, vz - oz)
            nx, nz = (vx - ox) / size, (vz - oz) / size
        else:
            nx, nz = (-cx, -cz) if which == 1 else (cx, cz)
            w = outlines.radius[o]
            # At a grazing touch the foot is known to the root of the tolerance only: keep the point on the segment.
            _, ox, oz = point_segment(vx - w * nx, vz - w * nz, segment[0], segment[1], segment[2], segment[3])
    if cx * nx + cz * nz < 0.0:
        cx, cz = -cx, -cz
    return ox, oz, nx, nz, cx, cz


@kernel
def touch_round(
    outlines: OutlineArrays, sections: SectionArrays, row: int, work: Work
) -> tuple[float, float, float, float]:
    """Return point and normal of a touch on a disk or an ellipse of the object."""
    kind, o, feature = work.best[0], work.best[1], work.best[2]
    source, which, shape = work.best[3], work.best[4], work.best[5]
    nx, nz = 0.0, 0.0
    vx, vz = 0.0, 0.0
    if kind == KIND_SIDE:
        nx, nz = side_normal(outlines, work, o, feature, which)
        nx, nz = -nx, -nz
    else:
        vx, vz = outline_point(outlines, work, o, feature)
    if shape == 1:
        x, z, radius = sections.disks[row, source]
        if kind != KIND_SIDE:
            size = math.hypot(vx - x, vz - z)
            nx, nz = (vx - x) / size, (vz - z) / size
        return x + radius * nx, z + radius * nz, nx, nz
    e = sections.ellipses[row, source]
    if kind == KIND_SIDE:
        size, _, t = support(e, nx, nz)
        y = e[5] * e[5] * (-nx * e[3] + nz * e[2]) / size
        return e[0] + t * e[2] - y * e[3], e[1] + t * e[3] + y * e[2], nx, nz
    _, nx, nz, x, z = region_gap(e, vx, vz)
    return x, z, nx, nz


@kernel
def describe_contact(
    hand: HandArrays,
    sections: SectionArrays,
    base: int,
    axis_group: int,
    plane: int,
    dof: int,
    turns: Floats,
    work: Work,
    contact: Ints,
    point: Floats,
) -> None:
    """Write where and how the winner of `advance` touches, at the posture it was stopped in."""
    place_joints(hand.chain, axis_group, turns, work.place)
    contact[CONTACT_PLANE], contact[CONTACT_DOF], contact[CONTACT_AXIS_GROUP] = plane, dof, axis_group
    describe_touch(hand, sections, plane - base, work, contact, point)


@kernel
def touch_found(
    hand: HandArrays, sections: SectionArrays, row: int, work: Work
) -> tuple[float, float, float, float, float, float]:
    """Return where the pair in `work.best` touches with the joints where they are placed; see `touch_segment`."""
    if work.best[5] == 0:
        return touch_segment(hand.outlines, sections.segments[row, work.best[3]], work)
    x, z, nx, nz = touch_round(hand.outlines, sections, row, work)
    return x, z, nx, nz, nx, nz


@kernel
def describe_touch(
    hand: HandArrays, sections: SectionArrays, row: int, work: Work, contact: Ints, point: Floats
) -> None:
    """Write where and how the pair in `work.best` touches with the joints where they are placed."""
    source, shape = work.best[3], work.best[5]
    contact[CONTACT_OUTLINE], contact[CONTACT_KIND] = work.best[1], work.best[0]
    contact[CONTACT_FEATURE], contact[CONTACT_WHICH] = work.best[2], work.best[4]
    if shape == 0:
        contact[CONTACT_SOURCE] = sections.sources[row, source]
    else:
        contact[CONTACT_SOURCE] = (
            sections.disk_sources[row, source] if shape == 1 else sections.ellipse_sources[row, source]
        )
    x, z, nx, nz, cx, cz = touch_found(hand, sections, row, work)
    point[CONTACT_X], point[CONTACT_Z], point[CONTACT_NX], point[CONTACT_NZ] = x, z, nx, nz
    point[CONTACT_CURVE_X], point[CONTACT_CURVE_Z] = cx, cz


@kernel
def still_touches(outline: Outline, contact: Ints, point: Floats, work: Work) -> bool:
    """Say whether the feature that touched a point is still where the touch's normal says, to `PASSED_GAP`."""
    x, z = point[CONTACT_X] + outline.radius * point[CONTACT_NX], point[CONTACT_Z] + outline.radius * point[CONTACT_NZ]
    if contact[CONTACT_KIND] != KIND_SIDE:
        vertex = work.vertex[contact[CONTACT_FEATURE]]
        return bool(math.hypot(vertex[0] - x, vertex[1] - z) <= PASSED_GAP)
    side = work.side[contact[CONTACT_FEATURE]]
    turned = abs(side[0] * point[CONTACT_NZ] - side[1] * point[CONTACT_NX])
    along, away = side[0] * z - side[1] * x, abs(side[0] * x + side[1] * z - side[2])
    inside = side[3] - PASSED_GAP <= along <= side[4] + PASSED_GAP
    return bool(inside and turned <= PASSED_GAP and away <= PASSED_GAP)


@kernel
def holds(chain: ChainArrays, contact: Ints, x: float, z: float, nx: float, nz: float, place: Floats) -> bool:
    """Say whether a touch with this outward normal holds what a contact stopped: it would not be left by going on."""
    slope, lever = 0.0, 0.0
    for j in range(contact[CONTACT_JOINT] + 1):
        if chain.joint_dof[j] == contact[CONTACT_DOF] and chain.joint_axis_group[j] == contact[CONTACT_AXIS_GROUP]:
            dx, dz = x - place[j, 0], z - place[j, 1]
            slope += chain.rate[j] * (dx * nz - dz * nx)
            lever += abs(chain.rate[j]) * math.hypot(dx, dz)
    return slope <= STILL * lever


@kernel
def settle_contact(
    hand: HandArrays,
    start: int,
    shared: SectionArrays,
    own: SectionArrays,
    turns: Floats,
    contact: Ints,
    point: Floats,
    work: Work,
) -> None:
    """Evaluate a contact again at the final posture; what later motions carried along gets its new place and pair.

    Where the link only touches something else by now, which does not hold what was stopped, the contact is left behind.
    """
    axis_group, plane, o = contact[CONTACT_AXIS_GROUP], contact[CONTACT_PLANE], contact[CONTACT_OUTLINE]
    sections, row = shared, plane
    if axis_group > start:
        sections, row = own, plane - hand.axis_group_plane[start]
    place_joints(hand.chain, axis_group, turns, work.place)
    outline = put_outline(hand.outlines, o, hand.outlines.joint[o], work.place, 0.0, 0.0, 1.0, work)
    touch = TOUCH_FRACTION * hand.axis_group_length[axis_group]
    gap, _, _ = core_distance(outline, point[CONTACT_X], point[CONTACT_Z], work)
    point[CONTACT_GAP] = gap - outline.radius
    if abs(point[CONTACT_GAP]) > touch or not still_touches(outline, contact, point, work):
        left, point[CONTACT_GAP] = point[CONTACT_GAP], outline_distance(outline, sections, row, touch, work)
        if point[CONTACT_GAP] <= PASSED_GAP:
            x, z, nx, nz, _, _ = touch_found(hand, sections, row, work)
            if holds(hand.chain, contact, x, z, nx, nz, work.place):
                describe_touch(hand, sections, row, work, contact, point)
            else:
                point[CONTACT_GAP] = left
