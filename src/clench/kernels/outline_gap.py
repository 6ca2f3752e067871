"""How far an outline is from the object's section at one posture (METHOD.md section 4)."""

from __future__ import annotations

import math

from .compiling import inner_kernel
from .conics import region_gap
from .layout import Floats, Outline, SectionArrays, Work


@inner_kernel
def point_segment(px: float, pz: float, ax: float, az: float, bx: float, bz: float) -> tuple[float, float, float]:
    """Return the distance of a point to a segment, and the foot."""
    dx, dz = bx - ax, bz - az
    square = dx * dx + dz * dz
    t = 0.0
    if square > 0.0:
        t = min(max(((px - ax) * dx + (pz - az) * dz) / square, 0.0), 1.0)
    fx, fz = ax + t * dx, az + t * dz
    return math.hypot(px - fx, pz - fz), fx, fz


@inner_kernel
def side_ends(side: Floats, i: int) -> tuple[float, float, float, float]:
    """Return the end points of a side."""
    nx, nz, g = side[i, 0], side[i, 1], side[i, 2]
    ta, tb = side[i, 3], side[i, 4]
    return g * nx - ta * nz, g * nz + ta * nx, g * nx - tb * nz, g * nz + tb * nx


@inner_kernel
def outline_distance(outline: Outline, sections: SectionArrays, row: int, work: Work) -> tuple[float, float, float]:
    """Return the least distance of an outline (put in family coordinates) to a section, and the section's point."""
    best, x, z = math.inf, 0.0, 0.0
    segments = sections.segments
    for i in range(sections.counts[row, 0]):
        ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
        for v in range(outline.v0, outline.v1):
            d, fx, fz = point_segment(work.vertex[v, 0], work.vertex[v, 1], ax, az, bx, bz)
            if d < best:
                best, x, z = d, fx, fz
        for s in range(outline.s0, outline.s1):
            cx, cz, dx, dz = side_ends(work.side, s)
            d, _, _ = point_segment(ax, az, cx, cz, dx, dz)
            if d < best:
                best, x, z = d, ax, az
            d, _, _ = point_segment(bx, bz, cx, cz, dx, dz)
            if d < best:
                best, x, z = d, bx, bz
    gap, fx, fz = round_distance(outline, sections, row, work)
    return (best - outline.radius, x, z) if best - outline.radius <= gap else (gap, fx, fz)


@inner_kernel
def round_distance(outline: Outline, sections: SectionArrays, row: int, work: Work) -> tuple[float, float, float]:
    """Return the least distance of an outline to the round parts of a section, and the section's point."""
    best, x, z = math.inf, 0.0, 0.0
    for i in range(sections.counts[row, 1]):
        qx, qz, radius = sections.disks[row, i, 0], sections.disks[row, i, 1], sections.disks[row, i, 2]
        d, nx, nz = core_distance(outline, qx, qz, work)
        if d - radius - outline.radius < best:
            best = d - radius - outline.radius
            x, z = qx + radius * nx, qz + radius * nz
    for i in range(sections.counts[row, 2]):
        for v in range(outline.v0, outline.v1):
            d, _, _, fx, fz = region_gap(sections.ellipses[row, i], work.vertex[v, 0], work.vertex[v, 1])
            if d - outline.radius < best:
                best, x, z = d - outline.radius, fx, fz
        for s in range(outline.s0, outline.s1):
            px, pz = nearest_scaled(sections.ellipses[row, i], work.side, s)
            d, _, _, fx, fz = region_gap(sections.ellipses[row, i], px, pz)
            if d - outline.radius < best:
                best, x, z = d - outline.radius, fx, fz
    return best, x, z


@inner_kernel
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


@inner_kernel
def nearest_scaled(e: Floats, side: Floats, s: int) -> tuple[float, float]:
    """Return the point of a side nearest to an ellipse's centre where the ellipse is a unit circle."""
    ax, az, bx, bz = side_ends(side, s)
    px, pz = ((ax - e[0]) * e[2] + (az - e[1]) * e[3]) / e[4], ((az - e[1]) * e[2] - (ax - e[0]) * e[3]) / e[5]
    qx, qz = ((bx - e[0]) * e[2] + (bz - e[1]) * e[3]) / e[4], ((bz - e[1]) * e[2] - (bx - e[0]) * e[3]) / e[5]
    dx, dz = qx - px, qz - pz
    square = dx * dx + dz * dz
    t = min(max(-(px * dx + pz * dz) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return ax + t * (bx - ax), az + t * (bz - az)
