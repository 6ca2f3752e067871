"""All feature pairs of one link outline and one object feature, under one turning joint (docs/method.md section 3)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import KIND_SIDE, Floats, Ints, Outline
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
def turn_segment(
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
    rate: float,
    best: float,
    vertex: Floats,
    side: Floats,
    pair: Ints,
) -> float:
    """Return the first contact of a turning outline with segment `i`, in units of travel, before `best`.

    The segment is relative to the pivot; `vertex` and `side` hold the outline about the pivot, `pair` gets the winner.
    When the object is not closed,
    both sides of the segment count.
    """
    w = outline.radius
    ta, tb = -nz * ax + nx * az, -nz * bx + nx * bz
    h = nx * ax + nz * az
    if ta > tb:
        ta, tb = tb, ta
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
    found = turn_sides(outline, i, 0, ax, az, 0.0, 0, touch, turn, side, pair)
    turn = turn_sides(outline, i, 1, bx, bz, 0.0, 0, touch, found, side, pair)
    return sooner(turn / rate, best) if turn < limit else best


@kernel
def turn_sides(
    outline: Outline,
    i: int,
    end: int,
    qx: float,
    qz: float,
    radius: float,
    disk: int,
    touch: float,
    turn: float,
    side: Floats,
    pair: Ints,
) -> float:
    """Return the first turn at which a side of the outline meets an object vertex of some radius."""
    w = outline.radius + radius
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
    outline: Outline,
    i: int,
    qx: float,
    qz: float,
    radius: float,
    touch: float,
    rate: float,
    best: float,
    vertex: Floats,
    side: Floats,
    pair: Ints,
) -> float:
    """Return the first contact of a turning outline with a disk of the object, in units of travel, before `best`."""
    w = outline.radius
    limit = best * rate
    turn = limit
    r = math.sqrt(qx * qx + qz * qz)
    for v in range(outline.v0, outline.v1):
        vx, vz, rho = vertex[v, 0], vertex[v, 1], vertex[v, 2]
        found = disk_on_vertex(vx, vz, rho, qx, qz, r, w + radius, touch, turn)
        if found < turn:
            turn = found
            note(pair, outline.tip, outline.number, v, i, 0, 1)
    turn = turn_sides(outline, i, 0, qx, qz, radius, 1, touch, turn, side, pair)
    return sooner(turn / rate, best) if turn < limit else best
