"""Sharp features that touch at the start, and whether they block (docs/method.md section 3).

The gap of one vertex and one line decides alone where the touch lies inside the line's segment. If two corners meet,
the line of either side is only one of several that separate them. The motion is blocked when it closes the gap of every
separating line. In a notch no line separates them: there no side of the notch may close in. And where a surface counts
from both sides, a touching vertex lies on the side of its body.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Flat, Floats, Origin, Outline, PlaneSection, Segment, Work
from clench.kernels.runtime.compiling import kernel

from .coupled import bounds, evaluate, line_on_point, point_on_line
from .turning import is_blocking

#: Directions that lean over a line by less than this count as on it [-]; so do sides whose far end is near it: a corner
#: there touches the line itself.
LEAN = 1e-9
#: Corners meet when they are closer than this many touch tolerances [-].
NEAR = 4.0


@kernel
def line_permits(
    chain: Floats, terms: Floats, joints: int, vx: float, vz: float, nx: float, nz: float, touch: float
) -> bool:
    """Say whether a moving link point, given from the last pivot, does not close in on a fixed line below it."""
    chain[joints - 1, 1], chain[joints - 1, 2] = vx, vz
    n, constant = point_on_line(chain, joints, nx, nz, 0.0, terms)
    _, slope, curvature = evaluate(terms, n, constant, 0.0)
    lever, _ = bounds(terms, n)
    return not is_blocking(slope, curvature, lever, touch)


@kernel
def side_permits(
    chain: Floats, terms: Floats, joints: int, mx: float, mz: float, qx: float, qz: float, touch: float
) -> bool:
    """Say whether a moving side with outward normal `m` does not close in on a point `q` from the first pivot."""
    n, constant = line_on_point(chain, joints, mx, mz, 0.0, qx, qz, 0.0, terms)
    _, slope, curvature = evaluate(terms, n, constant, 0.0)
    lever, _ = bounds(terms, n)
    return not is_blocking(slope, curvature, lever, touch)


@kernel
def body_above(outline: Outline, side: Floats, x: float, z: float, nx: float, nz: float, near: float) -> bool:
    """Say whether the link's sides that end at (x, z) lie on the outer side of a line with normal `n`."""
    for k in range(outline.s0, outline.s1):
        mx, mz, g = side[k, 0], side[k, 1], side[k, 2]
        for end in range(2):
            t = side[k, 3 + end]
            if abs(g * mx - t * mz - x) <= near and abs(g * mz + t * mx - z) <= near:
                length = side[k, 4] - side[k, 3]
                far = length * (-mz * nx + mx * nz)
                if (far if end == 1 else -far) > max(LEAN * length, near):
                    return False
    return True


@kernel
def segment_from(section: PlaneSection, i: int, origin: Origin) -> Segment:
    """Return a segment of a section relative to a pivot."""
    s, row, (px, pz, mirror) = section.sections.segments, section.row, origin
    ax, az, bx, bz = s[row, i, 0] - px, (s[row, i, 1] - pz) * mirror, s[row, i, 2] - px, (s[row, i, 3] - pz) * mirror
    return ax, az, bx, bz, s[row, i, 4], s[row, i, 5] * mirror


@kernel
def object_below(section: PlaneSection, origin: Origin, x: float, z: float, nx: float, nz: float) -> bool:
    """Say whether the object's segments that end at (x, z) lie on the inner side of a line with normal `n`."""
    near = NEAR * section.touch
    for i in range(section.sections.counts[section.row, 0]):
        ax, az, bx, bz, _, _ = segment_from(section, i, origin)
        size = math.hypot(bx - ax, bz - az)
        if size > near:
            far, slack = (bx - ax) * nx + (bz - az) * nz, max(LEAN * size, near)
            if math.hypot(ax - x, az - z) <= near and far > slack:
                return False
            if math.hypot(bx - x, bz - z) <= near and -far > slack:
                return False
    return True


@kernel
def corner_blocks(
    outline: Outline, section: PlaneSection, origin: Origin, v: Flat, q: Flat, joints: int, work: Work
) -> bool:
    """Say whether no separating line of two touching corners lets the motion pass, nor all sides of a notch.

    Args:
        outline, work: the link, relative to its last pivot. section, origin: the object, relative to the first one.
        v: the link's corner from the last pivot. q: the object's from the first. joints: how many move the link.
    """
    touch, closed, side, chain, terms = section.touch, section.closed, work.side, work.chain, work.terms
    near, sides, left, (vx, vz), (x, z) = NEAR * touch, 0, 0, v, q
    for i in range(section.sections.counts[section.row, 0]):
        ax, az, bx, bz, mx, mz = segment_from(section, i, origin)
        if math.hypot(ax - x, az - z) <= near or math.hypot(bx - x, bz - z) <= near:
            nx, nz, leaves = mx, mz, False
            for flip in range(1 if closed else 2):
                if flip:
                    nx, nz = -nx, -nz
                if body_above(outline, side, vx, vz, nx, nz, near) and line_permits(
                    chain, terms, joints, vx, vz, nx, nz, touch
                ):
                    if object_below(section, origin, x, z, nx, nz):
                        return False
                    leaves = True
            sides, left = sides + 1, left + (1 if leaves else 0)
    if sides > 1 and left == sides:
        return False
    sides, left = 0, 0
    for k in range(outline.s0, outline.s1):
        mx, mz, g = side[k, 0], side[k, 1], side[k, 2]
        for end in range(2):
            t = side[k, 3 + end]
            if abs(g * mx - t * mz - vx) <= near and abs(g * mz + t * mx - vz) <= near:
                leaves = False
                for flip in range(2 if outline.both else 1):
                    nx, nz = (mx, mz) if flip else (-mx, -mz)
                    if object_below(section, origin, x, z, nx, nz) and side_permits(
                        chain, terms, joints, -nx, -nz, x, z, touch
                    ):
                        if body_above(outline, side, vx, vz, nx, nz, near):
                            return False
                        leaves = True
                sides, left = sides + 1, left + (1 if leaves else 0)
    return not (sides > 1 and left == sides)


@kernel
def vertex_blocks(
    outline: Outline, section: PlaneSection, origin: Origin, v: Flat, i: int, d: Flat, joints: int, work: Work
) -> bool:
    """Say whether a link vertex that touches segment `i` is blocked there."""
    touch, side, chain, terms = section.touch, work.side, work.chain, work.terms
    near, (vx, vz) = NEAR * touch, v
    x, z = vx + d[0], vz + d[1]
    ax, az, bx, bz, nx, nz = segment_from(section, i, origin)
    for end in range(2):
        qx, qz = (bx, bz) if end else (ax, az)
        if math.hypot(x - qx, z - qz) <= near:
            return corner_blocks(outline, section, origin, v, (qx, qz), joints, work)
    if body_above(outline, side, vx, vz, nx, nz, near):
        return not line_permits(chain, terms, joints, vx, vz, nx, nz, touch)
    return (
        not section.closed
        and body_above(outline, side, vx, vz, -nx, -nz, near)
        and not line_permits(chain, terms, joints, vx, vz, -nx, -nz, touch)
    )


@kernel
def sharp_blocks(outline: Outline, section: PlaneSection, origin: Origin, joints: int, work: Work) -> bool:
    """Say whether a sharp outline is blocked where it touches the object's section at the start.

    Args:
        outline, work: the link, relative to its last pivot. joints: how many move it.
        section, origin: the object, relative to the first pivot.
    """
    touch, vertex, side, chain, terms = section.touch, work.vertex, work.side, work.chain, work.terms
    near = NEAR * touch
    dx, dz = 0.0, 0.0
    for k in range(joints - 1):
        dx += chain[k, 1]
        dz += chain[k, 2]
    for i in range(section.sections.counts[section.row, 0]):
        ax, az, bx, bz, nx, nz = segment_from(section, i, origin)
        ta, tb = nx * az - nz * ax, nx * bz - nz * bx
        low, high = min(ta, tb) - near, max(ta, tb) + near
        for v in range(outline.v0, outline.v1):
            x, z = vertex[v, 0] + dx, vertex[v, 1] + dz
            touching = abs(nx * (x - ax) + nz * (z - az)) <= touch and low <= nx * z - nz * x <= high
            p = (vertex[v, 0], vertex[v, 1])
            if touching and vertex_blocks(outline, section, origin, p, i, (dx, dz), joints, work):
                return True
        for k in range(outline.s0, outline.s1):
            mx, mz, g = side[k, 0], side[k, 1], side[k, 2]
            for end in range(2):
                x, z = (bx - dx, bz - dz) if end else (ax - dx, az - dz)
                t = mx * z - mz * x
                # Ends of sides are vertices, which the loop above has seen.
                if abs(mx * x + mz * z - g) <= touch and side[k, 3] + near < t < side[k, 4] - near:
                    if object_below(section, origin, x + dx, z + dz, -mx, -mz):
                        if not side_permits(chain, terms, joints, mx, mz, x + dx, z + dz, touch):
                            return True
                    elif (
                        outline.both
                        and object_below(section, origin, x + dx, z + dz, mx, mz)
                        and not side_permits(chain, terms, joints, -mx, -mz, x + dx, z + dz, touch)
                    ):
                        return True
    return False
