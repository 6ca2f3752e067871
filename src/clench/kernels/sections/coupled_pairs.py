"""All feature pairs of one link outline and one object feature, under several joints (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.core.tolerances import FOOT_FRACTION
from clench.kernels.closing.layout import KIND_SIDE, Flat, Floats, Line, Outline, Segment, Work
from clench.kernels.runtime.compiling import kernel

from .coupled import at_start, bounds, line_on_point, next_root, place, point_on_line, point_on_point
from .turning_pairs import defer, line_of, note, other_face


@kernel
def side_foot(chain: Floats, count: int, nx: float, nz: float, qx: float, qz: float, s: float) -> float:
    """Return where along a moving side with start normal `n` a fixed point is at `s`, from the last pivot."""
    x, z = place(chain, count - 1, s)
    turn = chain[count - 1, 0] * s
    c, d = math.cos(turn), math.sin(turn)
    mx, mz = c * nx - d * nz, d * nx + c * nz
    return -mz * (qx - x) + mx * (qz - z)


@kernel
def sweep_vertex_line(
    chain: Floats, terms: Floats, count: int, v: Flat, w: float, line: Line, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving vertex disk meets a fixed segment from its outer side."""
    nx, nz, h, ta, tb = line
    chain[count - 1, 1], chain[count - 1, 2] = v
    n, constant = point_on_line(chain, count, nx, nz, h + w, terms)
    first, second = bounds(terms, n)
    value = at_start(terms, n, constant)
    if abs(value) - touch > first * best:
        return best
    slack = FOOT_FRACTION * (tb - ta)
    s, sign = 0.0, 1.0 if value >= -touch else -1.0
    while True:
        s = next_root(terms, n, constant, s, sign, second, touch, best)
        if s >= best:
            return best
        if sign > 0.0:
            x, z = place(chain, count, s)
            if ta - slack <= nx * z - nz * x <= tb + slack:
                return s
        sign = -sign


@kernel
def sweep_side_point(
    chain: Floats, terms: Floats, count: int, line: Line, q: Flat, w: float, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving side meets a fixed point from the side's outer side."""
    (nx, nz, g, ta, tb), (qx, qz) = line, q
    n, constant = line_on_point(chain, count, nx, nz, g, qx, qz, w, terms)
    first, second = bounds(terms, n)
    value = at_start(terms, n, constant)
    if abs(value) - touch > first * best:
        return best
    slack = FOOT_FRACTION * (tb - ta)
    s, sign = 0.0, 1.0 if value >= -touch else -1.0
    while True:
        s = next_root(terms, n, constant, s, sign, second, touch, best)
        if s >= best:
            return best
        if sign > 0.0 and ta - slack <= side_foot(chain, count, nx, nz, qx, qz, s) <= tb + slack:
            return s
        sign = -sign


@kernel
def sweep_vertex_point(
    chain: Floats, terms: Floats, count: int, v: Flat, q: Flat, w: float, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving vertex comes within `w` > 0 of a fixed point."""
    chain[count - 1, 1], chain[count - 1, 2] = v
    n, constant = point_on_point(chain, count, q[0], q[1], w, terms)
    first, second = bounds(terms, n)
    value = at_start(terms, n, constant)
    if value - touch > first * best or value < -touch:
        return best
    return next_root(terms, n, constant, 0.0, 1.0, second, touch, best)


@kernel
def sweep_segment(
    outline: Outline,
    i: int,
    segment: Segment,
    closed: bool,
    touch: float,
    count: int,
    speed: float,
    best: float,
    work: Work,
) -> float:
    """Return the first contact of an outline moved by several joints with segment `i` before `best`.

    The segment is relative to the first pivot; `work` has the outline about the last one.
    """
    ax, az, bx, bz, _, _ = segment
    chain, terms, pair, w, line = work.chain, work.terms, work.best, outline.radius, line_of(segment)
    for v in range(outline.v0, outline.v1):
        p = (work.vertex[v, 0], work.vertex[v, 1])
        found = sweep_vertex_line(chain, terms, count, p, w, line, touch, best)
        if w == 0.0 and found * speed <= touch:
            defer(pair, outline.tip, outline.number, v, i, 0)
        elif found < best:
            best = found
            note(pair, outline.tip, outline.number, v, i, 0, 0)
        if not closed:
            found = sweep_vertex_line(chain, terms, count, p, w, other_face(line), touch, best)
            if w == 0.0 and found * speed <= touch:
                defer(pair, outline.tip, outline.number, v, i, 1)
            elif found < best:
                best = found
                note(pair, outline.tip, outline.number, v, i, 1, 0)
        if w > 0.0:
            found = sweep_vertex_point(chain, terms, count, p, (ax, az), w, touch, best)
            if found < best:
                best = found
                note(pair, outline.tip, outline.number, v, i, 2, 0)
            found = sweep_vertex_point(chain, terms, count, p, (bx, bz), w, touch, best)
            if found < best:
                best = found
                note(pair, outline.tip, outline.number, v, i, 3, 0)
    best = sweep_sides(outline, (i, 0, 0), (ax, az), 0.0, touch, count, speed, best, work)
    return sweep_sides(outline, (i, 1, 0), (bx, bz), 0.0, touch, count, speed, best, work)


@kernel
def sweep_sides(
    outline: Outline,
    met: tuple[int, int, int],
    q: Flat,
    radius: float,
    touch: float,
    count: int,
    speed: float,
    best: float,
    work: Work,
) -> float:
    """Return the first `s` at which a side of the outline meets an object vertex of some radius; see `turn_sides`."""
    i, end, disk = met
    chain, terms, side, pair, w = work.chain, work.terms, work.side, work.best, outline.radius + radius
    for k in range(outline.s0, outline.s1):
        line = (side[k, 0], side[k, 1], side[k, 2], side[k, 3], side[k, 4])
        found = sweep_side_point(chain, terms, count, line, q, w, touch, best)
        if w == 0.0 and found * speed <= touch:
            defer(pair, KIND_SIDE, outline.number, k, i, end)
        elif found < best:
            best = found
            note(pair, KIND_SIDE, outline.number, k, i, end, disk)
        if outline.both:
            found = sweep_side_point(chain, terms, count, other_face(line), q, w, touch, best)
            if w == 0.0 and found * speed <= touch:
                defer(pair, KIND_SIDE, outline.number, k, i, end + 2)
            elif found < best:
                best = found
                note(pair, KIND_SIDE, outline.number, k, i, end + 2, disk)
    return best


@kernel
def sweep_disk(
    outline: Outline, i: int, q: Flat, radius: float, touch: float, count: int, speed: float, best: float, work: Work
) -> float:
    """Return the first contact of an outline moved by several joints with a disk of the object before `best`."""
    chain, terms, vertex, w = work.chain, work.terms, work.vertex, outline.radius + radius
    for v in range(outline.v0, outline.v1):
        found = sweep_vertex_point(chain, terms, count, (vertex[v, 0], vertex[v, 1]), q, w, touch, best)
        if found < best:
            best = found
            note(work.best, outline.tip, outline.number, v, i, 0, 1)
    return sweep_sides(outline, (i, 0, 1), q, radius, touch, count, speed, best, work)
