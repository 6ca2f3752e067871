"""Exact distances between one rounded outline and a curve, in one posture."""

import numpy as np

from .compiled import Floats, compiled
from .scene import Body, Edges


@compiled
def point_segment(px: float, pz: float, ax: float, az: float, dx: float, dz: float, inverse: float) -> float:
    """Return the squared distance of a point to the segment from ``a`` along ``d``; ``inverse``: 1/|d|^2, or 0."""
    ex = px - ax
    ez = pz - az
    t = min(1.0, max(0.0, (ex * dx + ez * dz) * inverse))
    ex -= t * dx
    ez -= t * dz
    return ex * ex + ez * ez


@compiled
def place(body: Body, outline: int, angles: Floats) -> tuple[Floats, Floats]:
    """Return the pivots (k+1, 2) up to the outline's joint and its vertices (n, 2), in the plane."""
    last = body.joint[outline]
    centers = np.empty((last + 1, 2))
    x, z, turn = 0.0, 0.0, 0.0
    for j in range(last + 1):
        c, s = np.cos(turn), np.sin(turn)
        x += c * body.pivots[j, 0] - s * body.pivots[j, 1]
        z += s * body.pivots[j, 0] + c * body.pivots[j, 1]
        centers[j, 0] = x
        centers[j, 1] = z
        turn += angles[j]
    c, s = np.cos(turn), np.sin(turn)
    first = body.vertex_start[outline]
    placed = np.empty((body.vertex_start[outline + 1] - first, 2))
    for i in range(len(placed)):
        u, v = body.vertices[first + i, 0], body.vertices[first + i, 1]
        placed[i, 0] = x + c * u - s * v
        placed[i, 1] = z + s * u + c * v
    return centers, placed


@compiled
def to_curve(px: float, pz: float, curve: Edges) -> float:
    """Return the distance of a point to the nearest segment."""
    best = np.inf
    for m in range(len(curve.segments)):
        s = curve.segments[m]
        best = min(best, point_segment(px, pz, s[0], s[1], s[2], s[3], s[4]))
    return float(np.sqrt(best))


@compiled
def edge_table(body: Body, outline: int, placed: Floats) -> Floats:
    """Return the outline's placed edges (e, 5): start, run, inverse squared length."""
    first = body.edge_start[outline]
    base = body.vertex_start[outline]
    table = np.empty((body.edge_start[outline + 1] - first, 5))
    for e in range(len(table)):
        a, b = body.edges[first + e, 0] - base, body.edges[first + e, 1] - base
        dx, dz = placed[b, 0] - placed[a, 0], placed[b, 1] - placed[a, 1]
        square = dx * dx + dz * dz
        table[e, 0], table[e, 1], table[e, 2], table[e, 3] = placed[a, 0], placed[a, 1], dx, dz
        table[e, 4] = 1.0 / square if square > 0.0 else 0.0
    return table


@compiled
def to_edges(px: float, pz: float, edges: Floats) -> float:
    """Return the distance of a point to the nearest edge of a table."""
    best = np.inf
    for e in range(len(edges)):
        s = edges[e]
        best = min(best, point_segment(px, pz, s[0], s[1], s[2], s[3], s[4]))
    return float(np.sqrt(best))


@compiled
def winding(px: float, pz: float, ax: float, az: float, bx: float, bz: float) -> int:
    """Return what the directed segment a-b adds to a point's winding number: a ray to the right, half-open in z."""
    if az <= pz:
        if bz > pz and (bx - ax) * (pz - az) - (px - ax) * (bz - az) > 0.0:
            return 1
    elif bz <= pz and (bx - ax) * (pz - az) - (px - ax) * (bz - az) < 0.0:
        return -1
    return 0


@compiled
def inside_curve(px: float, pz: float, curve: Edges) -> bool:
    """Tell whether a point is inside the loops of a solid curve."""
    if not curve.solid:
        return False
    turns = 0
    for m in range(len(curve.segments)):
        s = curve.segments[m]
        turns += winding(px, pz, s[0], s[1], s[0] + s[2], s[1] + s[3])
    return turns > 0


@compiled
def inside_core(px: float, pz: float, body: Body, outline: int, placed: Floats) -> bool:
    """Tell whether a point is inside the polygon of an outline."""
    turns = 0
    base = body.vertex_start[outline]
    for k in range(body.side_start[outline], body.side_start[outline + 1]):
        a, b = body.sides[k, 0] - base, body.sides[k, 1] - base
        turns += winding(px, pz, placed[a, 0], placed[a, 1], placed[b, 0], placed[b, 1])
    return turns > 0


@compiled
def crossing_depth(e: Floats, s: Floats) -> float:
    """Return how far two crossing segments must move to part: the least distance of an end to the other; else -1."""
    ex, ez, sx, sz = e[0] + e[2], e[1] + e[3], s[0] + s[2], s[1] + s[3]
    # On one line, signs of areas are rounding; segments that cross have boxes that overlap.
    if max(e[0], ex) < min(s[0], sx) or max(s[0], sx) < min(e[0], ex):
        return -1.0
    if max(e[1], ez) < min(s[1], sz) or max(s[1], sz) < min(e[1], ez):
        return -1.0
    a = e[2] * (s[1] - e[1]) - e[3] * (s[0] - e[0])
    b = e[2] * (sz - e[1]) - e[3] * (sx - e[0])
    c = s[2] * (e[1] - s[1]) - s[3] * (e[0] - s[0])
    d = s[2] * (ez - s[1]) - s[3] * (ex - s[0])
    if not ((a > 0.0 > b or a < 0.0 < b) and (c > 0.0 > d or c < 0.0 < d)):
        return -1.0
    depth = min(
        point_segment(e[0], e[1], s[0], s[1], s[2], s[3], s[4]), point_segment(ex, ez, s[0], s[1], s[2], s[3], s[4])
    )
    depth = min(depth, point_segment(s[0], s[1], e[0], e[1], e[2], e[3], e[4]))
    return float(np.sqrt(min(depth, point_segment(sx, sz, e[0], e[1], e[2], e[3], e[4]))))


@compiled
def core_depth(body: Body, outline: int, placed: Floats, edges: Floats, curve: Edges) -> float:
    """Return a lower bound of how deep core and loops overlap, exact while shallow; -1 where they do not.

    Three witnesses: a vertex of the link in the object, a vertex of the object in the link, two segments that cross.
    Each alone says that they cannot be parted by less, so the deepest is taken.
    """
    depth = -1.0
    for i in range(len(placed)):
        if inside_curve(placed[i, 0], placed[i, 1], curve):
            depth = max(depth, to_curve(placed[i, 0], placed[i, 1], curve))
    for q in range(len(curve.points)):
        x, z = curve.points[q, 0], curve.points[q, 1]
        if inside_core(x, z, body, outline, placed):
            depth = max(depth, to_edges(x, z, edges))
    for e in range(len(edges)):
        for m in range(len(curve.segments)):
            depth = max(depth, crossing_depth(edges[e], curve.segments[m]))
    return depth


@compiled
def signed_gap(body: Body, outline: int, placed: Floats, curve: Edges) -> float:
    """Return the gap [m] of a placed outline; negative: a lower bound of the overlap, exact while shallow."""
    edges = edge_table(body, outline, placed)
    radius = body.radius[outline]
    gap = np.inf
    for i in range(len(placed)):
        gap = min(gap, to_curve(placed[i, 0], placed[i, 1], curve) - radius)
    for q in range(len(curve.points)):
        gap = min(gap, to_edges(curve.points[q, 0], curve.points[q, 1], edges) - radius)
    depth = core_depth(body, outline, placed, edges, curve)
    if depth >= 0.0:
        gap = -radius - depth
    for k in range(len(curve.disks)):
        x, z = curve.disks[k, 0], curve.disks[k, 1]
        away = to_edges(x, z, edges)
        if inside_core(x, z, body, outline, placed):
            away = -away
        gap = min(gap, away - curve.disks[k, 2] - radius)
    return float(gap)


@compiled
def finger_gap(body: Body, curve: Edges, angles: Floats, first_joint: int) -> tuple[float, int]:
    """Return the least signed gap over the outlines from a joint outwards, and the outline that has it."""
    best, at = np.inf, -1
    for o in range(len(body.radius)):
        if body.joint[o] >= first_joint:
            gap = signed_gap(body, o, place(body, o, angles)[1], curve)
            if gap < best:
                best, at = gap, o
    return best, at
