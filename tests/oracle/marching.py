"""Conservative advancement: walk along a path in steps that provably cannot skip a gap below ``-tolerance``.

Between two evaluations one of two bounds holds. *Lipschitz*: the distance of a link vertex to the curve, or of a curve
point to the link, changes no faster than that point moves. *Semiconcave* (outlines with a radius): the gap is a minimum
of distances between points, each with second derivative at most ``M = 2 V^2/w + A`` (distances below ``w/2`` are bent
into a parabola, which leaves the question untouched), so it lies above its chord less ``M/2 (x - a)(b - x)``. The
second makes sliding and shallow contacts cheap; the first holds for sharp outlines too.
"""

import numpy as np

from .compiled import Floats, compiled
from .distances import core_depth, edge_table, place, point_segment, to_curve, to_edges
from .scene import Body, Edges

REACHED, VIOLATED, BUDGET = 0, 1, 2
NEAR = 1e4


@compiled
def velocity_at(x: float, z: float, centers: Floats, rate: Floats) -> tuple[float, float]:
    """Return the velocity, per unit of the path, of the link's material at a place in the plane."""
    u, v = 0.0, 0.0
    for j in range(len(centers)):
        u -= rate[j] * (z - centers[j, 1])
        v += rate[j] * (x - centers[j, 0])
    return u, v


@compiled
def safe_step(margin: float, speed: float, growth: float) -> float:
    """Return the step over which a point of this speed, growing by ``growth`` per unit, travels ``margin``."""
    if margin <= 0.0:
        return 0.0
    bottom = speed + np.sqrt(speed * speed + 2.0 * growth * margin)
    return 2.0 * margin / bottom if bottom > 0.0 else np.inf


@compiled
def margin_of(clear: float, lost: float, tolerance: float) -> float:
    """Return what a pair may lose until deeper than the tolerance; given an overlap ``lost``, any near one is it."""
    return tolerance + (min(clear, -lost) if lost > 0.0 and clear < 2.0 * tolerance else clear)


@compiled
def near_step(
    place: tuple[float, float],
    velocity: tuple[float, float],
    table: Floats,
    swell: float,
    lost: float,
    tolerance: float,
    bounds: Floats,
) -> float:
    """Return a safe step for a point among segments that it may slide along.

    As long as the point has not crossed a segment's *line* by more than the tolerance, it has not crossed the segment:
    along the line it may go as fast as it likes, and towards it only with its speed across, which the swing can change.
    """
    x, z = place
    u, v = velocity
    best = np.inf
    for m in range(len(table)):
        s = table[m]
        clear = np.sqrt(point_segment(x, z, s[0], s[1], s[2], s[3], s[4])) - swell
        step = safe_step(margin_of(clear, lost, tolerance), np.hypot(u, v), bounds[1])
        scale = np.sqrt(s[4])
        across = abs(s[2] * (z - s[1]) - s[3] * (x - s[0])) * scale - swell
        towards = abs(s[2] * v - s[3] * u) * scale
        if scale > 0.0:
            step = max(step, safe_step(margin_of(across, lost, tolerance), towards, bounds[3]))
        best = min(best, step)
    return best


@compiled
def disk_step(
    place: tuple[float, float],
    velocity: tuple[float, float],
    edges: Floats,
    swell: float,
    tolerance: float,
    swing: float,
) -> float:
    """Return a safe step for a disk near the edges of an outline: only what closes along the line between them counts.

    An edge is convex, so it stays behind its own tangent line at the nearest point, wherever along it the touch goes.
    """
    x, z = place
    best = np.inf
    for e in range(len(edges)):
        s = edges[e]
        t = min(1.0, max(0.0, ((x - s[0]) * s[2] + (z - s[1]) * s[3]) * s[4]))
        dx, dz = x - s[0] - t * s[2], z - s[1] - t * s[3]
        away = np.hypot(dx, dz)
        along = (dx * velocity[0] + dz * velocity[1]) / away if away > 0.0 else np.hypot(velocity[0], velocity[1])
        closing = max(0.0, along)
        best = min(best, safe_step(away - swell + tolerance, closing, swing))
    return best


@compiled
def overlap_of_sharp(
    body: Body, o: int, placed: Floats, edges: Floats, curve: Edges, near: float, tolerance: float
) -> float:
    """Return how deep a sharp outline is in the curve, 0 where it is clear; looked at only where something is near."""
    w = body.radius[o]
    for q in range(len(curve.points)):
        near = min(near, to_edges(curve.points[q, 0], curve.points[q, 1], edges) - w)
    depth = core_depth(body, o, placed, edges, curve) if near < 20.0 * tolerance else -1.0
    return w + depth if depth >= 0.0 else 0.0


@compiled
def look(
    body: Body, o: int, curve: Edges, angles: Floats, rate: Floats, bounds: Floats, tolerance: float
) -> tuple[float, float]:
    """Return the gap of an outline in one posture, and a step that is safe from there.

    The gap is unsigned for outlines rounder than the tolerance: nothing can cross their core without being seen before.
    ``bounds``: see ``bounds_of``.
    """
    centers, placed = place(body, o, angles)
    edges = edge_table(body, o, placed)
    w = body.radius[o]
    away = np.empty(len(placed))
    for i in range(len(placed)):
        away[i] = to_curve(placed[i, 0], placed[i, 1], curve) - w
    gap = away.min()
    sharp = w <= 2.0 * tolerance
    lost = overlap_of_sharp(body, o, placed, edges, curve, gap, tolerance) if sharp else 0.0
    step = np.inf
    for i in range(len(placed)):
        x, z = placed[i, 0], placed[i, 1]
        u, v = velocity_at(x, z, centers, rate)
        own = safe_step(margin_of(away[i], lost, tolerance), np.hypot(u, v), bounds[1])
        if own < step and sharp and away[i] < NEAR * tolerance:
            own = near_step((x, z), (u, v), curve.segments, w, lost, tolerance, bounds)
        step = min(step, own)
    mx, mz = placed[:, 0].mean(), placed[:, 1].mean()
    size = 0.0
    for i in range(len(placed)):
        size = max(size, np.hypot(placed[i, 0] - mx, placed[i, 1] - mz))
    for q in range(len(curve.points) + len(curve.disks)):
        if q < len(curve.points):
            x, z, swell = curve.points[q, 0], curve.points[q, 1], w
        else:
            disk = curve.disks[q - len(curve.points)]
            x, z, swell = disk[0], disk[1], w + disk[2]
        u, v = velocity_at(x, z, centers, rate)
        speed = np.hypot(u, v)
        least = np.hypot(x - mx, z - mz) - size - swell
        if least >= gap and safe_step(margin_of(least, lost, tolerance), speed, bounds[1]) >= step:
            continue
        clear = to_edges(x, z, edges) - swell
        gap = min(gap, clear)
        own = safe_step(margin_of(clear, lost, tolerance), speed, bounds[1])
        if own < step and sharp and clear < NEAR * tolerance:
            if q < len(curve.points):
                own = near_step((x, z), (u, v), edges, w, lost, tolerance, bounds)
            else:
                own = disk_step((x, z), (u, v), edges, swell, tolerance, bounds[3] + bounds[4] * swell)
        step = min(step, own)
    if lost > 0.0:
        gap = min(gap, -lost)
    return gap, step


@compiled
def chord_holds(a: float, b: float, h: float, curvature: float, floor: float) -> bool:
    """Tell whether a function from ``a`` to ``b`` over ``h``, second derivative at most ``curvature``, stays above."""
    if min(a, b) < floor:
        return False
    x = min(h, max(0.0, 0.5 * h - (b - a) / (h * curvature)))
    return a + (b - a) * x / h - 0.5 * curvature * x * (h - x) >= floor


@compiled
def bounds_of(body: Body, o: int, rate: Floats) -> Floats:
    """Return bounds: speed, its growth, second derivative of the gap, acceleration of a point, squared turning."""
    total, speed, reach, active = 0.0, 0.0, 0.0, 0
    for j in range(body.joint[o] + 1):
        if rate[j] != 0.0:
            total += abs(rate[j])
            speed += abs(rate[j]) * body.reach[o, j]
            reach = max(reach, body.reach[o, j])
            active += 1
    swing = total * total * reach
    w = body.radius[o]
    bend = 2.0 * speed * speed / w + swing if w > 0.0 else np.inf
    return np.array([speed, swing if active > 1 else 0.0, bend, 1.01 * swing, total * total])


@compiled
def march(
    body: Body,
    o: int,
    curve: Edges,
    base: Floats,
    rate: Floats,
    start: float,
    end: float,
    tolerance: float,
    budget: int,
) -> tuple[int, float, float, float, int]:
    """Walk one outline from ``start`` to ``end``: joint angles are ``base + rate * s``.

    Returns what ended the walk, where, the last place seen with a gap not below 0 (NaN if none), the least gap seen,
    and the number of evaluations. ``VIOLATED``: the gap there is ``-tolerance`` or less, and nowhere before.
    """
    bounds = bounds_of(body, o, rate)
    w = body.radius[o]
    s, trial, looks = start, end - start, 1
    gap, step = look(body, o, curve, base + rate * s, rate, bounds, tolerance)
    least, open_at = gap, np.nan
    while True:
        least = min(least, gap)
        if gap >= 0.0:
            open_at = s
        if gap + tolerance < 1e-3 * tolerance:
            return VIOLATED, s, open_at, least, looks
        if s + step >= end:
            return REACHED, end, open_at, least, looks
        if looks > budget:
            return BUDGET, s, open_at, least, looks
        h = min(end - s, trial)
        jumped = False
        while w > 2.0 * tolerance and gap < 4.0 * w and h > 1.5 * step:
            ahead, ahead_step = look(body, o, curve, base + rate * (s + h), rate, bounds, tolerance)
            looks += 1
            if chord_holds(gap, ahead, h, bounds[2], -tolerance):
                gap, step, jumped = ahead, ahead_step, True
                s, trial = s + h, 2.0 * h
                break
            h *= 0.4
        if jumped and s >= end:
            return REACHED, end, (s if gap >= 0.0 else open_at), min(least, gap), looks
        if not jumped:
            s, trial = s + step, max(4.0 * step, h)
            gap, step = look(body, o, curve, base + rate * s, rate, bounds, tolerance)
            looks += 1


@compiled
def march_all(
    body: Body, curve: Edges, base: Floats, rate: Floats, span: Floats, first: int, tolerance: float, budget: int
) -> tuple[int, float, float, float, int, int]:
    """Walk every outline from joint ``first`` outwards over ``span`` (start, end); the earliest violation ends it.

    Returns as ``march``, and the outline that ended the walk (-1: none).
    """
    status, end, open_at, least, at, looks = REACHED, span[1], np.nan, np.inf, -1, 0
    for o in range(len(body.radius)):
        if body.joint[o] >= first:
            kind, s, last, low, count = march(body, o, curve, base, rate, span[0], end, tolerance, budget)
            least, looks = min(least, low), looks + count
            if kind != REACHED:
                status, end, open_at, at = kind, s, last, o
    return status, end, open_at, least, at, looks
