"""All feature pairs of one link outline and one object feature, under several turning joints (METHOD.md section 4)."""

from __future__ import annotations

import math

from clench.base.tolerances import FOOT_FRACTION

from .compiling import kernel
from .coupled import at_start, bounds, line_on_point, next_root, place, point_on_line, point_on_point
from .layout import KIND_SIDE, Outline, Work
from .turning_pairs import note


@kernel
def vertex_foot(work: Work, count: int, v: int, nx: float, nz: float, s: float) -> float:
    """Return where along a line with normal `n` a moving vertex is at `s`."""
    x, z = place(work.chain, count, s)
    return -nz * x + nx * z


@kernel
def side_foot(work: Work, count: int, nx: float, nz: float, qx: float, qz: float, s: float) -> float:
    """Return where along a moving side with start normal `n` a fixed point is at `s`, from the last pivot."""
    x, z = place(work.chain, count - 1, s)
    turn = work.chain[count - 1, 0] * s
    c, d = math.cos(turn), math.sin(turn)
    mx, mz = c * nx - d * nz, d * nx + c * nz
    return -mz * (qx - x) + mx * (qz - z)


@kernel
def sweep_vertex_line(
    work: Work,
    count: int,
    v: int,
    w: float,
    nx: float,
    nz: float,
    h: float,
    ta: float,
    tb: float,
    touch: float,
    best: float,
) -> float:
    """Return the first `s` before `best` at which a moving vertex disk meets a fixed segment from its outer side."""
    work.chain[count - 1, 1], work.chain[count - 1, 2] = work.vertex[v, 0], work.vertex[v, 1]
    n, constant = point_on_line(work.chain, count, nx, nz, h + w, work.terms)
    first, second = bounds(work.terms, n)
    value = at_start(work.terms, n, constant)
    if abs(value) - touch > first * best:
        return best
    slack = FOOT_FRACTION * (tb - ta)
    s, sign = 0.0, 1.0 if value >= -touch else -1.0
    while True:
        s = next_root(work.terms, n, constant, s, sign, second, touch, best)
        if s >= best:
            return best
        if sign > 0.0 and ta - slack <= vertex_foot(work, count, v, nx, nz, s) <= tb + slack:
            return s
        sign = -sign


@kernel
def sweep_side_point(
    work: Work,
    count: int,
    nx: float,
    nz: float,
    g: float,
    ta: float,
    tb: float,
    qx: float,
    qz: float,
    w: float,
    touch: float,
    best: float,
) -> float:
    """Return the first `s` before `best` at which a moving side meets a fixed point from the side's outer side."""
    n, constant = line_on_point(work.chain, count, nx, nz, g, qx, qz, w, work.terms)
    first, second = bounds(work.terms, n)
    value = at_start(work.terms, n, constant)
    if abs(value) - touch > first * best:
        return best
    slack = FOOT_FRACTION * (tb - ta)
    s, sign = 0.0, 1.0 if value >= -touch else -1.0
    while True:
        s = next_root(work.terms, n, constant, s, sign, second, touch, best)
        if s >= best:
            return best
        if sign > 0.0 and ta - slack <= side_foot(work, count, nx, nz, qx, qz, s) <= tb + slack:
            return s
        sign = -sign


@kernel
def sweep_vertex_point(
    work: Work, count: int, v: int, qx: float, qz: float, w: float, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving vertex comes within `w` > 0 of a fixed point."""
    work.chain[count - 1, 1], work.chain[count - 1, 2] = work.vertex[v, 0], work.vertex[v, 1]
    n, constant = point_on_point(work.chain, count, qx, qz, w, work.terms)
    first, second = bounds(work.terms, n)
    value = at_start(work.terms, n, constant)
    if value - touch > first * best or value < -touch:
        return best
    return next_root(work.terms, n, constant, 0.0, 1.0, second, touch, best)


@kernel
def sweep_segment(
    outline: Outline,
    i: int,
    ax: float,
    az: float,
    bx: float,
    bz: float,
    nx: float,
    nz: float,
    closed: bool,
    touch: float,
    count: int,
    speed: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline moved by several joints with segment `i` before `best`.

    The segment is relative to the first pivot; `work` holds the outline about the last one and the chain.
    """
    w = outline.radius
    x, z = place(work.chain, count - 1, 0.0)
    distance = math.hypot(
        0.5 * (ax + bx) - x - work.disk[outline.index, 0], 0.5 * (az + bz) - z - work.disk[outline.index, 1]
    )
    if distance - work.disk[outline.index, 2] - 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2) - touch > speed * best:
        return best
    ta, tb = -nz * ax + nx * az, -nz * bx + nx * bz
    h = nx * ax + nz * az
    if ta > tb:
        ta, tb = tb, ta
    for v in range(outline.v0, outline.v1):
        found = sweep_vertex_line(work, count, v, w, nx, nz, h, ta, tb, touch, best)
        if found < best:
            best = found
            note(work.best, outline.tip, outline.index, v, i, 0, 0)
        if not closed:
            found = sweep_vertex_line(work, count, v, w, -nx, -nz, -h, -tb, -ta, touch, best)
            if found < best:
                best = found
                note(work.best, outline.tip, outline.index, v, i, 1, 0)
        if w > 0.0:
            found = sweep_vertex_point(work, count, v, ax, az, w, touch, best)
            if found < best:
                best = found
                note(work.best, outline.tip, outline.index, v, i, 2, 0)
            found = sweep_vertex_point(work, count, v, bx, bz, w, touch, best)
            if found < best:
                best = found
                note(work.best, outline.tip, outline.index, v, i, 3, 0)
    best = sweep_sides(outline, i, 0, ax, az, 0.0, 0, touch, count, best, work)
    return sweep_sides(outline, i, 1, bx, bz, 0.0, 0, touch, count, best, work)


@kernel
def sweep_sides(
    outline: Outline,
    i: int,
    end: int,
    qx: float,
    qz: float,
    radius: float,
    disk: int,
    touch: float,
    count: int,
    best: float,
    work: Work,
) -> float:
    """Return the first `s` at which a side of the moving outline meets an object vertex of some radius."""
    w = outline.radius + radius
    for side in range(outline.s0, outline.s1):
        nx, nz, g = work.side[side, 0], work.side[side, 1], work.side[side, 2]
        ta, tb = work.side[side, 3], work.side[side, 4]
        found = sweep_side_point(work, count, nx, nz, g, ta, tb, qx, qz, w, touch, best)
        if found < best:
            best = found
            note(work.best, KIND_SIDE, outline.index, side, i, end, disk)
        if outline.both:
            found = sweep_side_point(work, count, -nx, -nz, -g, -tb, -ta, qx, qz, w, touch, best)
            if found < best:
                best = found
                note(work.best, KIND_SIDE, outline.index, side, i, end + 2, disk)
    return best


@kernel
def sweep_disk(
    outline: Outline,
    i: int,
    qx: float,
    qz: float,
    radius: float,
    touch: float,
    count: int,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline moved by several joints with a disk of the object before `best`."""
    w = outline.radius
    for v in range(outline.v0, outline.v1):
        found = sweep_vertex_point(work, count, v, qx, qz, w + radius, touch, best)
        if found < best:
            best = found
            note(work.best, outline.tip, outline.index, v, i, 0, 1)
    return sweep_sides(outline, i, 0, qx, qz, radius, 1, touch, count, best, work)
