"""How far an outline is from the object's section at one posture (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import KIND_SIDE, Floats, Outline, SectionArrays, Work
from clench.kernels.runtime.compiling import kernel

from .conics import region_gap, support
from .turning_pairs import note


@kernel
def point_segment(px: float, pz: float, ax: float, az: float, bx: float, bz: float) -> tuple[float, float, float]:
    """Return the distance of a point to a segment, and the foot."""
    dx, dz = bx - ax, bz - az
    square = dx * dx + dz * dz
    t = 0.0
    if square > 0.0:
        t = min(max(((px - ax) * dx + (pz - az) * dz) / square, 0.0), 1.0)
    # Which end is touched is told by the foot: rounding must not take it off the second one.
    fx, fz = (ax + t * dx, az + t * dz) if t < 1.0 else (bx, bz)
    return math.hypot(px - fx, pz - fz), fx, fz


@kernel
def side_ends(side: Floats, i: int) -> tuple[float, float, float, float]:
    """Return the end points of a side."""
    nx, nz, g = side[i, 0], side[i, 1], side[i, 2]
    ta, tb = side[i, 3], side[i, 4]
    return g * nx - ta * nz, g * nz + ta * nx, g * nx - tb * nz, g * nz + tb * nx


@kernel
def outline_distance(outline: Outline, sections: SectionArrays, row: int, touch: float, work: Work) -> float:
    """Return the least distance of an outline (in coordinates of the axis group) to a section; `work.best` gets the
    pair.
    """
    best = math.inf
    segments, pair = sections.segments, work.best
    for i in range(sections.counts[row, 0]):
        ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
        for v in range(outline.v0, outline.v1):
            x, z = work.vertex[v, 0], work.vertex[v, 1]
            d, fx, fz = point_segment(x, z, ax, az, bx, bz)
            if d < best:
                best, which = d, 0
                if segments[row, i, 4] * (x - fx) + segments[row, i, 5] * (z - fz) < -touch:
                    which = 1
                if outline.radius > 0.0 and ((fx == ax and fz == az) or (fx == bx and fz == bz)):
                    which = 2 if fx == ax and fz == az else 3
                note(pair, outline.tip, outline.number, v, i, which, 0)
        for s in range(outline.s0, outline.s1):
            d = side_distance(work.side, s, ax, az)
            if d < best:
                best = d
                note(pair, KIND_SIDE, outline.number, s, i, face(outline, work.side, s, ax, az), 0)
            d = side_distance(work.side, s, bx, bz)
            if d < best:
                best = d
                note(pair, KIND_SIDE, outline.number, s, i, 1 + face(outline, work.side, s, bx, bz), 0)
    return round_distance(outline, sections, row, best - outline.radius, work)


@kernel
def side_distance(side: Floats, s: int, px: float, pz: float) -> float:
    """Return the distance of a point to the inside of a side, infinite where an end, which is a vertex, is nearest."""
    along = side[s, 0] * pz - side[s, 1] * px
    return abs(side[s, 0] * px + side[s, 1] * pz - side[s, 2]) if side[s, 3] < along < side[s, 4] else math.inf


@kernel
def face(outline: Outline, side: Floats, s: int, px: float, pz: float) -> int:
    """Return 2 where a point is behind a side of which both faces count, else 0."""
    return 2 if outline.both and side[s, 0] * px + side[s, 1] * pz < side[s, 2] else 0


@kernel
def round_distance(outline: Outline, sections: SectionArrays, row: int, best: float, work: Work) -> float:
    """Return the least distance of an outline to the round parts of a section, if below `best`; as above."""
    for i in range(sections.counts[row, 1]):
        qx, qz, reach = sections.disks[row, i, 0], sections.disks[row, i, 1], sections.disks[row, i, 2] + outline.radius
        for v in range(outline.v0, outline.v1):
            d = math.hypot(work.vertex[v, 0] - qx, work.vertex[v, 1] - qz) - reach
            if d < best:
                best = d
                note(work.best, outline.tip, outline.number, v, i, 0, 1)
        for s in range(outline.s0, outline.s1):
            d = side_distance(work.side, s, qx, qz) - reach
            if d < best:
                best = d
                note(work.best, KIND_SIDE, outline.number, s, i, face(outline, work.side, s, qx, qz), 1)
    for i in range(sections.counts[row, 2]):
        e = sections.ellipses[row, i]
        for v in range(outline.v0, outline.v1):
            d = region_gap(e, work.vertex[v, 0], work.vertex[v, 1])[0] - outline.radius
            if d < best:
                best = d
                note(work.best, outline.tip, outline.number, v, i, 0, 2)
        for s in range(outline.s0, outline.s1):
            px, pz, inside = nearest_on_side(e, work.side, s)
            d = region_gap(e, px, pz)[0] - outline.radius
            if inside and d < best:
                best = d
                note(work.best, KIND_SIDE, outline.number, s, i, face(outline, work.side, s, e[0], e[1]), 2)
    return best


@kernel
def core_distance(outline: Outline, qx: float, qz: float, work: Work) -> tuple[float, float, float]:
    """Return the distance of a point to an outline's core, and the unit direction towards it."""
    best, x, z = math.inf, 0.0, 0.0
    for v in range(outline.v0, outline.v1):
        d = math.hypot(work.vertex[v, 0] - qx, work.vertex[v, 1] - qz)
        if d < best:
            best, x, z = d, work.vertex[v, 0], work.vertex[v, 1]
    for s in range(outline.s0, outline.s1):
        ax, az, bx, bz = side_ends(work.side, s)
        d, fx, fz = point_segment(qx, qz, ax, az, bx, bz)
        if d < best:
            best, x, z = d, fx, fz
    if best == 0.0:
        return 0.0, 0.0, 0.0
    return best, (x - qx) / best, (z - qz) / best


@kernel
def nearest_on_side(e: Floats, side: Floats, s: int) -> tuple[float, float, bool]:
    """Return the point of a side's line that is nearest to a whole ellipse; whether it lies on the side, at no end.

    Beside the ellipse that is above the point whose normal is the side's; where the line goes through the ellipse, it
    is the middle of the chord.
    """
    nx, nz, g = side[s, 0], side[s, 1], side[s, 2]
    size, _, t = support(e, nx, nz)
    y = e[5] * e[5] * (-nx * e[3] + nz * e[2]) / size
    part = min(max((g - nx * e[0] - nz * e[1]) / size, -1.0), 1.0)
    x, z = e[0] + part * (t * e[2] - y * e[3]), e[1] + part * (t * e[3] + y * e[2])
    along = nx * z - nz * x
    return g * nx - along * nz, g * nz + along * nx, side[s, 3] < along < side[s, 4]
