"""The first contact of a moving outline with a section, the nearest segments first (docs/method.md section 3)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import RUN, Flat, Floats, Origin, Outline, PlaneSection, SectionArrays, Work
from clench.kernels.runtime.compiling import kernel

from .conics import sweep_region
from .corners import sharp_blocks
from .coupled_pairs import sweep_disk, sweep_segment
from .turning_pairs import turn_disk, turn_segment

#: The way of a point that turns about the pivot: where it begins (x, z), its distance, and where it ends (x, z).
Arc = tuple[float, float, float, float, float]


@kernel
def put_stadium(stadium: Floats, o: int, c: float, s: float, dx: float, dz: float, mirror: float, out: Floats) -> None:
    """Write the stadium around a placed outline: an end, the way to the other one, 1 / its square, and the radius."""
    ax, az = stadium[o, 0], stadium[o, 1]
    ux, uz = stadium[o, 2] - ax, stadium[o, 3] - az
    square = ux * ux + uz * uz
    out[o, 0], out[o, 1] = c * ax - s * az + dx, (s * ax + c * az + dz) * mirror
    out[o, 2], out[o, 3] = c * ux - s * uz, (s * ux + c * uz) * mirror
    out[o, 4] = 1.0 / square if square > 0.0 else 0.0
    out[o, 5] = stadium[o, 4]


@kernel
def stadium_gap(stadium: Floats, o: int, x: float, z: float) -> float:
    """Return the distance from a point to a placed stadium, negative inside."""
    dx, dz = x - stadium[o, 0], z - stadium[o, 1]
    ux, uz = stadium[o, 2], stadium[o, 3]
    t = min(max((dx * ux + dz * uz) * stadium[o, 4], 0.0), 1.0)
    dx -= t * ux
    dz -= t * uz
    return float(math.sqrt(dx * dx + dz * dz) - stadium[o, 5])


@kernel
def farthest(stadium: Floats, o: int) -> float:
    """Return how far a placed stadium gets from the origin."""
    ax, az = stadium[o, 0], stadium[o, 1]
    bx, bz = ax + stadium[o, 2], az + stadium[o, 3]
    return float(math.sqrt(max(ax * ax + az * az, bx * bx + bz * bz)) + stadium[o, 5])


@kernel
def misses(arc: Arc, wide: bool, mx: float, mz: float, reach: float) -> bool:
    """Say whether the middle of a circle that turns along an arc stays farther than `reach` from the point `m`.

    `wide`: it turns by more than half a turn, so that only the distance from the pivot tells.
    """
    cx, cz, d, ex, ez = arc
    r = math.sqrt(mx * mx + mz * mz)
    if abs(d - r) > reach:
        return True
    if wide or (cx * mz - cz * mx >= 0.0 and mx * ez - mz * ex >= 0.0):
        return False
    square = reach * reach
    return (mx - cx) ** 2 + (mz - cz) ** 2 > square and (mx - ex) ** 2 + (mz - ez) ** 2 > square


@kernel
def deferred_blocks(outline: Outline, section: PlaneSection, origin: Origin, count: int, work: Work) -> bool:
    """Decide on sharp pairs that touch at the start; if they block, make the last of them the winner."""
    work.best[6] = 0
    if not sharp_blocks(outline, section, origin, count, work):
        return False
    for k in range(6):
        work.best[k] = work.best[7 + k]
    return True


@kernel
def turned(x: float, z: float, turn: float) -> tuple[float, float]:
    """Return a point after a turn about the origin [rad]."""
    c, s = math.cos(turn), math.sin(turn)
    return c * x - s * z, s * x + c * z


@kernel
def nearest_turn(
    outline: Outline, section: PlaneSection, origin: Origin, arc: Arc, reach: float, turn: float, work: Work
) -> int:
    """Return the segment that a turning outline may meet first, as its distance over its speed tells, or -1.

    Args:
        arc, reach: how the circle around the outline moves, and its radius. turn: the last of interest.
    """
    sections, row, touch, (px, pz, mirror) = section.sections, section.row, section.touch, origin
    segments, circles, count = sections.segments, sections.circles, sections.counts[row, 0]
    nearest, least, wide, stadium, o = -1, math.inf, turn >= 3.0, work.stadium, outline.number
    for run in range(-(-count // RUN)):
        mx, mz, around = circles[row, run, 0] - px, (circles[row, run, 1] - pz) * mirror, circles[row, run, 2]
        arm = math.sqrt(mx * mx + mz * mz) + around
        if misses(arc, wide, mx, mz, reach + around) or (
            stadium_gap(stadium, o, mx, mz) - around - touch > arm * min(turn, least)
        ):
            continue
        for i in range(RUN * run, min(RUN * run + RUN, count)):
            ax, az = segments[row, i, 0] - px, (segments[row, i, 1] - pz) * mirror
            bx, bz = segments[row, i, 2] - px, (segments[row, i, 3] - pz) * mirror
            mx, mz, half = 0.5 * (ax + bx), 0.5 * (az + bz), 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            if not misses(arc, wide, mx, mz, reach + half):
                gap, arm = stadium_gap(stadium, o, mx, mz) - half - touch, math.sqrt(mx * mx + mz * mz)
                # A part of the object turns about the pivot, seen from the link: along an arc no shorter than the gap.
                if gap <= arm * min(turn, least):
                    nearest, least = i, max(gap, 0.0) / arm if arm > 0.0 else 0.0
    return nearest


@kernel
def turn_outline(
    outline: Outline, section: PlaneSection, origin: Origin, rate: float, best: float, work: Work
) -> float:
    """Return the first contact of an outline behind one active joint with a plane's section, before `best`."""
    sections, row, closed, touch = section.sections, section.row, section.closed, section.touch
    segments, disks, stadium, o = sections.segments, sections.disks, work.stadium, outline.number
    circles, count, (px, pz, mirror) = sections.circles, sections.counts[row, 0], origin
    # The circle around the turning stadium, and its place at the end.
    cx, cz = stadium[o, 0] + 0.5 * stadium[o, 2], stadium[o, 1] + 0.5 * stadium[o, 3]
    reach = 0.5 * math.sqrt(stadium[o, 2] ** 2 + stadium[o, 3] ** 2) + stadium[o, 5] + touch
    d = math.sqrt(cx * cx + cz * cz)
    nearest, before, arc, wide = -1, -1.0, (cx, cz, d, 0.0, 0.0), False
    if count > 0:
        before, turn = best, best * rate
        (ex, ez), wide = turned(cx, cz, turn), turn >= 3.0
        arc = (cx, cz, d, ex, ez)
        nearest = nearest_turn(outline, section, origin, arc, reach, turn, work)
    # The nearest segment first, then run after run, if one has come that near.
    for run in range(-1, -(-count // RUN) if nearest >= 0 else -1):
        first, last = nearest, nearest + 1
        if run >= 0:
            first, last = RUN * run, min(RUN * run + RUN, count)
            mx, mz, around = circles[row, run, 0] - px, (circles[row, run, 1] - pz) * mirror, circles[row, run, 2]
            arm = math.sqrt(mx * mx + mz * mz) + around
            if misses(arc, wide, mx, mz, reach + around) or (
                stadium_gap(stadium, o, mx, mz) - around - touch > arm * best * rate
            ):
                continue
        for i in range(first, last):
            if run >= 0 and i == nearest:
                continue
            if best != before:
                before, turn = best, best * rate
                (ex, ez), wide = turned(cx, cz, turn), turn >= 3.0
                arc = (cx, cz, d, ex, ez)
            ax, az = segments[row, i, 0] - px, (segments[row, i, 1] - pz) * mirror
            bx, bz = segments[row, i, 2] - px, (segments[row, i, 3] - pz) * mirror
            mx, mz, half = 0.5 * (ax + bx), 0.5 * (az + bz), 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            if (
                not misses(arc, wide, mx, mz, reach + half)
                and stadium_gap(stadium, o, mx, mz) - half - touch <= math.sqrt(mx * mx + mz * mz) * best * rate
            ):
                nx, nz = segments[row, i, 4], segments[row, i, 5] * mirror
                best = turn_segment(outline, i, (ax, az, bx, bz, nx, nz), closed, touch, rate, best, work)
                if best == 0.0:
                    return best
    if work.best[6] and deferred_blocks(outline, section, origin, 1, work):
        return 0.0
    for i in range(sections.counts[row, 1]):
        q = (disks[row, i, 0] - px, (disks[row, i, 1] - pz) * mirror)
        best = turn_disk(outline, i, q, disks[row, i, 2], touch, rate, best, work)
    return best


@kernel
def first_near(
    outline: Outline,
    sections: SectionArrays,
    row: int,
    x: float,
    z: float,
    speed: float,
    touch: float,
    work: Work,
) -> tuple[float, int]:
    """Return a travel for which nothing of a section is met, and its nearest segment or -1.

    Args:
        x, z: where the outline's features are relative to. speed: no point of it is faster [m].
    """
    if sections.counts[row, 2]:
        return 0.0, -1
    segments, disks, nearest, least = sections.segments, sections.disks, -1, math.inf
    circles, count, stadium, o = sections.circles, sections.counts[row, 0], work.stadium, outline.number
    for run in range(-(-count // RUN)):
        around = circles[row, run, 2]
        if stadium_gap(stadium, o, circles[row, run, 0] - x, circles[row, run, 1] - z) - around >= least:
            continue
        for i in range(RUN * run, min(RUN * run + RUN, count)):
            ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
            half = 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            gap = stadium_gap(stadium, o, 0.5 * (ax + bx) - x, 0.5 * (az + bz) - z) - half
            if gap < least:
                nearest, least = i, gap
    for i in range(sections.counts[row, 1]):
        gap = stadium_gap(work.stadium, outline.number, disks[row, i, 0] - x, disks[row, i, 1] - z) - disks[row, i, 2]
        least = min(least, gap)
    free = max(least - touch, 0.0)
    return free / speed if speed > 0.0 else (math.inf if free > 0.0 else 0.0), nearest


@kernel
def sweep_outline(
    outline: Outline,
    section: PlaneSection,
    origin: Origin,
    last: Flat,
    nearest: int,
    count: int,
    speed: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline behind several active joints with a plane's section, before `best`.

    Args:
        origin: the first pivot; last: the last one, see `first_near`, which gives `nearest`, too.
    """
    sections, row, touch, (px, pz, _), (x, z) = section.sections, section.row, section.touch, origin, last
    segments, disks, circles, o = sections.segments, sections.disks, sections.circles, outline.number
    segment_count = sections.counts[row, 0]
    for run in range(-1, -(-segment_count // RUN)):
        begin, end = nearest, nearest + 1
        if run >= 0:
            begin, end = RUN * run, min(RUN * run + RUN, segment_count)
            near = touch + speed * best + circles[row, run, 2]
            if stadium_gap(work.stadium, o, circles[row, run, 0] - x, circles[row, run, 1] - z) > near:
                continue
        for i in range(max(begin, 0), end):
            if run >= 0 and i == nearest:
                continue
            ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
            near = touch + speed * best + 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            if stadium_gap(work.stadium, o, 0.5 * (ax + bx) - x, 0.5 * (az + bz) - z) <= near:
                one = (ax - px, az - pz, bx - px, bz - pz, segments[row, i, 4], segments[row, i, 5])
                best = sweep_segment(outline, i, one, section.closed, touch, count, speed, best, work)
                if best == 0.0:
                    return best
    if work.best[6] and deferred_blocks(outline, section, origin, count, work):
        return 0.0
    for i in range(sections.counts[row, 1]):
        q = (disks[row, i, 0] - px, disks[row, i, 1] - pz)
        best = sweep_disk(outline, i, q, disks[row, i, 2], touch, count, speed, best, work)
    return best


@kernel
def sweep_ellipses(
    outline: Outline, section: PlaneSection, origin: Origin, count: int, best: float, work: Work
) -> float:
    """Return the first contact of a moving outline with the ellipses of a plane's section, before `best`."""
    sections, row, (px, pz, mirror) = section.sections, section.row, origin
    for i in range(sections.counts[row, 2]):
        for k in range(8):
            work.ellipse[k] = sections.ellipses[row, i, k]
        work.ellipse[0] -= px
        work.ellipse[1] = (work.ellipse[1] - pz) * mirror
        work.ellipse[3] *= mirror
        best = sweep_region(outline, i, work.ellipse, section.touch, count, best, work)
    return best
