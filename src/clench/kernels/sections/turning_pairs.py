"""All feature pairs of one link outline and one object feature, under one turning joint (docs/method.md section 3)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import KIND_SIDE, Flat, Ints, Line, Outline, Segment, Work
from clench.kernels.runtime.compiling import kernel

from .turning import disk_on_segment, disk_on_vertex, side_on_vertex

#: A positive number times this is the next one below it.
BELOW = 1.0 - 2.0**-53


@kernel
def sooner(found: float, best: float) -> float:
    """Return a winner's travel below `best`, which rounding may have lost."""
    return min(found, best * BELOW)


@kernel
def note(pair: Ints, kind: int, outline: int, feature: int, source: int, which: int, disk: int) -> None:
    """Write the winning pair."""
    pair[0], pair[1], pair[2], pair[3], pair[4], pair[5] = kind, outline, feature, source, which, disk


@kernel
def defer(pair: Ints, kind: int, outline: int, feature: int, source: int, which: int) -> None:
    """Write a sharp pair that touches at the start; `corners` decides whether it blocks."""
    pair[6] = 1
    pair[7], pair[8], pair[9], pair[10], pair[11], pair[12] = kind, outline, feature, source, which, 0


@kernel
def line_of(segment: Segment) -> Line:
    """Return the line that a segment lies on, between the segment's ends."""
    ax, az, bx, bz, nx, nz = segment
    ta, tb = -nz * ax + nx * az, -nz * bx + nx * bz
    return nx, nz, nx * ax + nz * az, min(ta, tb), max(ta, tb)


@kernel
def other_face(line: Line) -> Line:
    """Return a line as it is seen from its other side."""
    nx, nz, g, ta, tb = line
    return -nx, -nz, -g, -tb, -ta


@kernel
def turn_segment(
    outline: Outline, i: int, segment: Segment, closed: bool, touch: float, rate: float, best: float, work: Work
) -> float:
    """Return the first contact of a turning outline with segment `i`, in units of travel, before `best`.

    The segment is relative to the pivot; `work` has the outline about the pivot, and gets the winner. When the object
    is not closed, both sides of the segment count.
    """
    ax, az, bx, bz, _, _ = segment
    vertex, pair, w, (nx, nz, h, ta, tb) = work.vertex, work.best, outline.radius, line_of(segment)
    limit = best * rate
    turn = limit
    ra, rb = math.sqrt(ax * ax + az * az), math.sqrt(bx * bx + bz * bz)
    for v in range(outline.v0, outline.v1):
        vx, vz, rho = vertex[v, 0], vertex[v, 1], vertex[v, 2]
        found = disk_on_segment(vx, vz, w, nx, nz, h, ta, tb, touch, turn)
        if found == 0.0 and w == 0.0:
            defer(pair, outline.tip, outline.number, v, i, 0)
        elif found < turn:
            turn = found
            note(pair, outline.tip, outline.number, v, i, 0, 0)
        if not closed:
            found = disk_on_segment(vx, vz, w, -nx, -nz, -h, -tb, -ta, touch, turn)
            if found == 0.0 and w == 0.0:
                defer(pair, outline.tip, outline.number, v, i, 1)
            elif found < turn:
                turn = found
                note(pair, outline.tip, outline.number, v, i, 1, 0)
        if w > 0.0:
            found = disk_on_vertex(vx, vz, rho, ax, az, ra, w, touch, turn)
            if found < turn:
                turn = found
                note(pair, outline.tip, outline.number, v, i, 2, 0)
            found = disk_on_vertex(vx, vz, rho, bx, bz, rb, w, touch, turn)
            if found < turn:
                turn = found
                note(pair, outline.tip, outline.number, v, i, 3, 0)
    found = turn_sides(outline, (i, 0, 0), (ax, az), 0.0, touch, turn, work)
    turn = turn_sides(outline, (i, 1, 0), (bx, bz), 0.0, touch, found, work)
    return sooner(turn / rate, best) if turn < limit else best


@kernel
def turn_sides(
    outline: Outline, met: tuple[int, int, int], q: Flat, radius: float, touch: float, turn: float, work: Work
) -> float:
    """Return the first turn at which a side of the outline meets an object vertex of some radius.

    Args:
        met: number of the vertex's segment or disk, which end of the segment it is, and 1 for a disk. q: the vertex.
    """
    (i, end, disk), (qx, qz) = met, q
    side, pair, w = work.side, work.best, outline.radius + radius
    for s in range(outline.s0, outline.s1):
        nx, nz, g = side[s, 0], side[s, 1], side[s, 2]
        ta, tb = side[s, 3], side[s, 4]
        found = side_on_vertex(nx, nz, g, ta, tb, qx, qz, w, touch, turn)
        if found == 0.0 and w == 0.0:
            defer(pair, KIND_SIDE, outline.number, s, i, end)
        elif found < turn:
            turn = found
            note(pair, KIND_SIDE, outline.number, s, i, end, disk)
        if outline.both:
            found = side_on_vertex(-nx, -nz, -g, -tb, -ta, qx, qz, w, touch, turn)
            if found == 0.0 and w == 0.0:
                defer(pair, KIND_SIDE, outline.number, s, i, end + 2)
            elif found < turn:
                turn = found
                note(pair, KIND_SIDE, outline.number, s, i, end + 2, disk)
    return turn


@kernel
def turn_disk(
    outline: Outline, i: int, q: Flat, radius: float, touch: float, rate: float, best: float, work: Work
) -> float:
    """Return the first contact of a turning outline with a disk of the object, in units of travel, before `best`."""
    vertex, w, (qx, qz) = work.vertex, outline.radius, q
    limit = best * rate
    turn = limit
    r = math.sqrt(qx * qx + qz * qz)
    for v in range(outline.v0, outline.v1):
        vx, vz, rho = vertex[v, 0], vertex[v, 1], vertex[v, 2]
        found = disk_on_vertex(vx, vz, rho, qx, qz, r, w + radius, touch, turn)
        if found < turn:
            turn = found
            note(work.best, outline.tip, outline.number, v, i, 0, 1)
    turn = turn_sides(outline, (i, 0, 1), q, radius, touch, turn, work)
    return sooner(turn / rate, best) if turn < limit else best
