"""Whether a finger overlaps the object before anything moves (docs/method.md section 3)."""

from __future__ import annotations

import math

from clench.core.tolerances import TOUCH_FRACTION
from clench.kernels.closing.layout import RUN, Floats, HandArrays, Ints, Outline, RoundArrays, SectionArrays, Work
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.geometry.mesh_distance import Point, is_inside
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import MeshTree

from .advance import place_joints, put_outline
from .outline_gap import core_distance, point_segment, round_distance, side_ends
from .outline_sweep import stadium_gap
from .plane_pose import back, compose_inverse
from .round_section import CAPSULE, CYLINDER, ELLIPSOID


@kernel
def crosses(
    ax: float, az: float, bx: float, bz: float, cx: float, cz: float, dx: float, dz: float, margin: float
) -> bool:
    """Say whether two segments cross with every end farther than `margin` from the other's line."""
    ux, uz, vx, vz = bx - ax, bz - az, dx - cx, dz - cz
    u, v = math.hypot(ux, uz), math.hypot(vx, vz)
    c = ux * (cz - az) - uz * (cx - ax)
    d = ux * (dz - az) - uz * (dx - ax)
    a = vx * (az - cz) - vz * (ax - cx)
    b = vx * (bz - cz) - vz * (bx - cx)
    mu, mv = margin * u, margin * v
    return ((c > mu and d < -mu) or (c < -mu and d > mu)) and ((a > mv and b < -mv) or (a < -mv and b > mv))


@kernel
def core_holds(outline: Outline, qx: float, qz: float, work: Work) -> bool:
    """Say whether an outline's core goes around a point (by the crossings of a ray along x)."""
    around = 0
    for s in range(outline.s0, outline.s1):
        ax, az, bx, bz = side_ends(work.side, s)
        if (az > qz) != (bz > qz) and ax + (qz - az) / (bz - az) * (bx - ax) > qx:
            around += 1 if work.side[s, 0] > 0.0 else -1
    return around != 0


@kernel
def segment_overlaps(outline: Outline, ax: float, az: float, bx: float, bz: float, margin: float, work: Work) -> bool:
    """Say whether a segment crosses an outline, comes closer to its core than the radius, or begins inside it."""
    limit = outline.radius - margin
    for v in range(outline.v0, outline.v1):
        if limit > 0.0:
            d, _, _ = point_segment(work.vertex[v, 0], work.vertex[v, 1], ax, az, bx, bz)
            if d < limit:
                return True
    for s in range(outline.s0, outline.s1):
        cx, cz, dx, dz = side_ends(work.side, s)
        if crosses(ax, az, bx, bz, cx, cz, dx, dz, margin):
            return True
        if limit > 0.0:
            # Both ends: an open sheet ends where no other segment begins.
            d, _, _ = point_segment(ax, az, cx, cz, dx, dz)
            e, _, _ = point_segment(bx, bz, cx, cz, dx, dz)
            if min(d, e) < limit:
                return True
    if outline.s1 - outline.s0 >= 3 and core_holds(outline, ax, az, work):
        d, _, _ = core_distance(outline, ax, az, work)
        return d > margin
    return False


@kernel
def curves_overlap(outline: Outline, sections: SectionArrays, row: int, touch: float, work: Work) -> bool:
    """Say whether an outline and a section cross, or one of the section's pieces lies in the outline."""
    margin = 4.0 * touch
    segments = sections.segments
    circles, count, stadium, o = sections.circles, sections.counts[row, 0], work.stadium, outline.number
    for run in range(-(-count // RUN)):
        if stadium_gap(stadium, o, circles[row, run, 0], circles[row, run, 1]) > circles[row, run, 2]:
            continue
        for i in range(RUN * run, min(RUN * run + RUN, count)):
            ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
            half = 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            gap = stadium_gap(stadium, o, 0.5 * (ax + bx), 0.5 * (az + bz))
            if gap <= half and segment_overlaps(outline, ax, az, bx, bz, margin, work):
                return True
    if sections.counts[row, 1] == 0 and sections.counts[row, 2] == 0:
        return False
    if round_distance(outline, sections, row, 0.0, work) < -margin:
        return True
    for i in range(sections.counts[row, 1]):
        if core_holds(outline, sections.disks[row, i, 0], sections.disks[row, i, 1], work):
            return True
    for i in range(sections.counts[row, 2]):
        e = sections.ellipses[row, i]
        # Its centre may lie beyond the band that belongs to the section.
        t = min(max(0.0, e[6]), e[7])
        if core_holds(outline, e[0] + t * e[2], e[1] + t * e[3], work):
            return True
    return False


@kernel
def inside_round(rounds: RoundArrays, i: int, p: Point) -> bool:
    """Say whether a point of the object's frame lies inside a round primitive."""
    pose, size = rounds.pose[i], rounds.size[i]
    x, y, z = 0.0, 0.0, 0.0
    for k in range(3):
        d = p[k] - pose[k, 3]
        x += pose[k, 0] * d
        y += pose[k, 1] * d
        z += pose[k, 2] * d
    if rounds.kind[i] == ELLIPSOID:
        return bool((x / size[0]) ** 2 + (y / size[1]) ** 2 + (z / size[2]) ** 2 < 1.0)
    if rounds.kind[i] == CYLINDER:
        return bool(abs(z) < size[1] and x * x + y * y < size[0] ** 2)
    beyond = max(abs(z) - size[1], 0.0) if rounds.kind[i] == CAPSULE else z
    return bool(x * x + y * y + beyond * beyond < size[0] ** 2)


@kernel
def starts_inside(
    tree: MeshTree, rounds: RoundArrays, closed: bool, T_axis_group_object: Floats, x: float, y: float, z: float
) -> bool:
    """Say whether a point in an axis group's frame lies inside the object's mesh or one of its round primitives."""
    p = back(T_axis_group_object, x, y, z)
    for i in range(rounds.kind.shape[0]):
        if inside_round(rounds, i, p):
            return True
    if tree.low.shape[0] == 0:
        return False
    for k in range(3):
        if p[k] < tree.low[0, k] or p[k] > tree.high[0, k]:
            return False
    return bool(is_inside(tree, p, closed))


@kernel
def outline_overlaps(
    hand: HandArrays,
    o: int,
    plane: int,
    touch: float,
    obj: ObjectArrays,
    T_axis_group_object: Floats,
    sections: SectionArrays,
    row: int,
    work: Work,
) -> bool:
    """Say whether an outline of a plane overlaps the object with the joints where they are placed."""
    outline = put_outline(hand.outlines, o, hand.outlines.joint[o], work.place, 0.0, 0.0, 1.0, work)
    x, z = work.vertex[outline.v0, 0], work.vertex[outline.v0, 1]
    y = hand.plane_offset[plane]
    inside = starts_inside(obj.tree, obj.rounds, obj.closed, T_axis_group_object, x, y, z)
    if inside and not closer_than(outline, sections, row, 4.0 * touch, work):
        return True
    return bool(curves_overlap(outline, sections, row, touch, work))


@entry_kernel
def look_for_overlaps(
    hand: HandArrays, obj: ObjectArrays, T_palm_object: Floats, sections: SectionArrays, overlaps: Ints, work: Work
) -> None:
    """Write, for every finger posture, an outline that overlaps the object before anything moves, or -1, shape (E,)."""
    turns, T = work.turns, work.pose[0]
    for j in range(turns.shape[0]):
        turns[j] = 0.0
    for finger_posture in range(hand.first_axis_group.shape[0] - 1):
        overlaps[finger_posture] = -1
        axis_group = hand.first_axis_group[finger_posture]
        touch = TOUCH_FRACTION * hand.axis_group_length[axis_group]
        place_joints(hand.chain, axis_group, turns, work.place)
        compose_inverse(hand.axis_group_pose[axis_group], T_palm_object, T)
        for plane in range(hand.axis_group_plane[axis_group], hand.axis_group_plane[axis_group + 1]):
            for o in range(hand.plane_outline[plane], hand.plane_outline[plane + 1]):
                if outline_overlaps(hand, o, plane, touch, obj, T, sections, plane, work):
                    overlaps[finger_posture] = o
                    break
            if overlaps[finger_posture] >= 0:
                break


@kernel
def closer_than(outline: Outline, sections: SectionArrays, row: int, margin: float, work: Work) -> bool:
    """Say whether an outline's first vertex is within `margin` of a section's segments, so that inside is not sure."""
    x, z = work.vertex[outline.v0, 0], work.vertex[outline.v0, 1]
    segments = sections.segments
    for i in range(sections.counts[row, 0]):
        d, _, _ = point_segment(
            x, z, segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
        )
        if d <= margin:
            return True
    return False
