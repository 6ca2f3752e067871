"""Sharp features that touch at the start, and whether they block (docs/method.md section 3).

The gap of one vertex and one line decides alone where the touch lies inside the line's segment. If two corners meet,
the line of either side is only one of several that separate them. The motion is blocked when it closes the gap of every
separating line. In a notch no line separates them: there no side of the notch may close in. And where a surface counts
from both sides, a touching vertex lies on the side of its body.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats, Outline
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
def object_below(
    segments: Floats,
    count: int,
    px: float,
    pz: float,
    mirror: float,
    x: float,
    z: float,
    nx: float,
    nz: float,
    near: float,
) -> bool:
    """Say whether the object's segments that end at (x, z) lie on the inner side of a line with normal `n`."""
    for i in range(count):
        ax, az = segments[i, 0] - px, (segments[i, 1] - pz) * mirror
        bx, bz = segments[i, 2] - px, (segments[i, 3] - pz) * mirror
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
    outline: Outline,
    segments: Floats,
    count: int,
    px: float,
    pz: float,
    mirror: float,
    closed: bool,
    vx: float,
    vz: float,
    x: float,
    z: float,
    chain: Floats,
    terms: Floats,
    joints: int,
    touch: float,
    side: Floats,
) -> bool:
    """Say whether no separating line of two touching corners lets the motion pass, nor all sides of a notch.

    Args:
        outline, side: the link, relative to its last pivot.
        segments, count, px, pz, mirror: the object's segments and how they become relative to the first pivot.
        vx, vz: the link's corner from the last pivot. x, z: the object's from the first.
        chain, joints: what moves the link.
    """
    near, sides, left = NEAR * touch, 0, 0
    for i in range(count):
        ax, az = segments[i, 0] - px, (segments[i, 1] - pz) * mirror
        bx, bz = segments[i, 2] - px, (segments[i, 3] - pz) * mirror
        if math.hypot(ax - x, az - z) <= near or math.hypot(bx - x, bz - z) <= near:
            nx, nz, leaves = segments[i, 4], segments[i, 5] * mirror, False
            for flip in range(1 if closed else 2):
                if flip:
                    nx, nz = -nx, -nz
                if body_above(outline, side, vx, vz, nx, nz, near) and line_permits(
                    chain, terms, joints, vx, vz, nx, nz, touch
                ):
                    if object_below(segments, count, px, pz, mirror, x, z, nx, nz, near):
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
                    if object_below(segments, count, px, pz, mirror, x, z, nx, nz, near) and side_permits(
                        chain, terms, joints, -nx, -nz, x, z, touch
                    ):
                        if body_above(outline, side, vx, vz, nx, nz, near):
                            return False
                        leaves = True
                sides, left = sides + 1, left + (1 if leaves else 0)
    return not (sides > 1 and left == sides)


@kernel
def vertex_blocks(
    outline: Outline,
    segments: Floats,
    count: int,
    px: float,
    pz: float,
    mirror: float,
    closed: bool,
    vx: float,
    vz: float,
    i: int,
    chain: Floats,
    terms: Floats,
    joints: int,
    touch: float,
    side: Floats,
    dx: float,
    dz: float,
) -> bool:
    """Say whether a link vertex that touches segment `i` is blocked there."""
    near = NEAR * touch
    x, z = vx + dx, vz + dz
    ax, az = segments[i, 0] - px, (segments[i, 1] - pz) * mirror
    bx, bz = segments[i, 2] - px, (segments[i, 3] - pz) * mirror
    for end in range(2):
        qx, qz = (bx, bz) if end else (ax, az)
        if math.hypot(x - qx, z - qz) <= near:
            return corner_blocks(
                outline, segments, count, px, pz, mirror, closed, vx, vz, qx, qz, chain, terms, joints, touch, side
            )
    nx, nz = segments[i, 4], segments[i, 5] * mirror
    if body_above(outline, side, vx, vz, nx, nz, near):
        return not line_permits(chain, terms, joints, vx, vz, nx, nz, touch)
    return (
        not closed
        and body_above(outline, side, vx, vz, -nx, -nz, near)
        and not line_permits(chain, terms, joints, vx, vz, -nx, -nz, touch)
    )


@kernel
def sharp_blocks(
    outline: Outline,
    segments: Floats,
    count: int,
    px: float,
    pz: float,
    mirror: float,
    closed: bool,
    touch: float,
    vertex: Floats,
    side: Floats,
    chain: Floats,
    terms: Floats,
    joints: int,
) -> bool:
    """Say whether a sharp outline is blocked where it touches the object's section at the start.

    Args:
        outline, vertex, side: the link, relative to its last pivot. chain, joints: what moves it.
        segments, count: of the section. px, pz, mirror: how they become relative to the first pivot.
        closed: the object's winding is known.
    """
    near = NEAR * touch
    dx, dz = 0.0, 0.0
    for k in range(joints - 1):
        dx += chain[k, 1]
        dz += chain[k, 2]
    for i in range(count):
        ax, az = segments[i, 0] - px, (segments[i, 1] - pz) * mirror
        bx, bz = segments[i, 2] - px, (segments[i, 3] - pz) * mirror
        nx, nz = segments[i, 4], segments[i, 5] * mirror
        ta, tb = nx * az - nz * ax, nx * bz - nz * bx
        low, high = min(ta, tb) - near, max(ta, tb) + near
        for v in range(outline.v0, outline.v1):
            x, z = vertex[v, 0] + dx, vertex[v, 1] + dz
            touching = abs(nx * (x - ax) + nz * (z - az)) <= touch and low <= nx * z - nz * x <= high
            if touching and vertex_blocks(
                outline,
                segments,
                count,
                px,
                pz,
                mirror,
                closed,
                vertex[v, 0],
                vertex[v, 1],
                i,
                chain,
                terms,
                joints,
                touch,
                side,
                dx,
                dz,
            ):
                return True
        for k in range(outline.s0, outline.s1):
            mx, mz, g = side[k, 0], side[k, 1], side[k, 2]
            for end in range(2):
                x, z = (bx - dx, bz - dz) if end else (ax - dx, az - dz)
                t = mx * z - mz * x
                # Ends of sides are vertices, which the loop above has seen.
                if abs(mx * x + mz * z - g) <= touch and side[k, 3] + near < t < side[k, 4] - near:
                    if object_below(segments, count, px, pz, mirror, x + dx, z + dz, -mx, -mz, near):
                        if not side_permits(chain, terms, joints, mx, mz, x + dx, z + dz, touch):
                            return True
                    elif (
                        outline.both
                        and object_below(segments, count, px, pz, mirror, x + dx, z + dz, mx, mz, near)
                        and not side_permits(chain, terms, joints, -mx, -mz, x + dx, z + dz, touch)
                    ):
                        return True
    return False
