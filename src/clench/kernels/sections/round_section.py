"""Exact sections of round primitives: circles, ellipses and straight edges (docs/method.md section 2)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Flat, Floats, SectionArrays
from clench.kernels.runtime.compiling import kernel

SPHERE, CAPSULE, CYLINDER, ELLIPSOID = 0, 1, 2, 3

#: Axes closer than this to the plane, or to its normal, count as in it, or normal to it [rad].
ALIGNED = 1e-9
#: A curve that bends by less than this fraction of the radius is straight [-].
STRAIGHT = 1e-10


@kernel
def add_segment(
    ax: float, az: float, bx: float, bz: float, nx: float, nz: float, source: int, row: int, sections: SectionArrays
) -> None:
    """Append a segment with outward normal."""
    i = sections.counts[row, 0]
    segment = sections.segments[row, i]
    segment[0], segment[1], segment[2], segment[3], segment[4], segment[5] = ax, az, bx, bz, nx, nz
    sections.sources[row, i] = -1 - source
    sections.counts[row, 0] = i + 1


@kernel
def add_disk(x: float, z: float, radius: float, source: int, row: int, sections: SectionArrays) -> None:
    """Append a disk."""
    i = sections.counts[row, 1]
    sections.disks[row, i, 0], sections.disks[row, i, 1], sections.disks[row, i, 2] = x, z, radius
    sections.disk_sources[row, i] = -1 - source
    sections.counts[row, 1] = i + 1


@kernel
def add_ellipse(
    center: Flat,
    u: Flat,
    a: float,
    b: float,
    low: float,
    high: float,
    source: int,
    row: int,
    sections: SectionArrays,
) -> None:
    """Append the part of an ellipse between two coordinates along its major axis `u`."""
    (x, z), (ux, uz) = center, u
    i = sections.counts[row, 2]
    e = sections.ellipses[row, i]
    e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7] = x, z, ux, uz, a, b, max(low, -a), min(high, a)
    sections.ellipse_sources[row, i] = -1 - source
    sections.counts[row, 2] = i + 1


@kernel
def cut_sphere(
    x: float, y: float, z: float, radius: float, offset: float, source: int, row: int, sections: SectionArrays
) -> None:
    """Append the circle of a sphere around (x, y, z)."""
    square = radius * radius - (offset - y) * (offset - y)
    if square > 0.0:
        add_disk(x, z, math.sqrt(square), source, row, sections)


@kernel
def cut_capsule(
    pose: Floats, radius: float, half: float, offset: float, source: int, row: int, sections: SectionArrays
) -> None:
    """Append the section of a capsule: that of a cylinder without its caps, and of two spheres."""
    for end in (-half, half):
        cut_sphere(
            pose[0, 3] + end * pose[0, 2],
            pose[1, 3] + end * pose[1, 2],
            pose[2, 3] + end * pose[2, 2],
            radius,
            offset,
            source,
            row,
            sections,
        )
    cut_cylinder(pose, radius, half, offset, False, source, row, sections)


@kernel
def cut_cylinder(
    pose: Floats,
    radius: float,
    half: float,
    offset: float,
    caps: bool,
    source: int,
    row: int,
    sections: SectionArrays,
) -> None:
    """Append the section of a cylinder along z: a circle, a rectangle, or an ellipse between its caps."""
    ax, ay, az = pose[0, 2], pose[1, 2], pose[2, 2]
    x, y, z = pose[0, 3], pose[1, 3], pose[2, 3]
    flat = math.hypot(ax, az)
    if flat <= ALIGNED:
        if abs(offset - y) <= half:
            add_disk(x, z, radius, source, row, sections)
        return
    ux, uz = ax / flat, az / flat
    if add_band(pose, radius, half, offset, caps, source, row, sections) or abs(ay) <= ALIGNED:
        return
    along = (offset - y) / ay
    a = radius / abs(ay)
    low, high = (-half - along) / flat, (half - along) / flat
    if low >= a or high <= -a:
        return
    cx, cz = x + along * ax, z + along * az
    add_ellipse((cx, cz), (ux, uz), a, radius, low, high, source, row, sections)
    if caps:
        if low > -a:
            add_chord((cx, cz), (ux, uz), radius * math.sqrt(1.0 - (low / a) ** 2), low, -1.0, source, row, sections)
        if high < a:
            add_chord((cx, cz), (ux, uz), radius * math.sqrt(1.0 - (high / a) ** 2), high, 1.0, source, row, sections)


@kernel
def add_band(
    pose: Floats, radius: float, half: float, offset: float, caps: bool, source: int, row: int, sections: SectionArrays
) -> bool:
    """Append the section of a cylinder by straight edges where it is straight between its caps; say whether it is.

    Of an axis that hardly leans out of the plane the section is a short part of a long ellipse, whose centre may be
    kilometres away.
    """
    ax, ay, az = pose[0, 2], pose[1, 2], pose[2, 2]
    away, square = offset - pose[1, 3], ax * ax + az * az
    low = radius * radius - (away + half * ay) ** 2 / square
    high = radius * radius - (away - half * ay) ** 2 / square
    if low <= 0.0 or high <= 0.0:
        return False
    low, high = math.sqrt(low), math.sqrt(high)
    if math.sqrt(radius * radius - away * away / square) - 0.5 * (low + high) > STRAIGHT * radius:
        return False
    flat = math.sqrt(square)
    ux, uz = ax / flat, az / flat
    # Where the axis' ends are along it, in the plane; and which way the edges run, along u and across it.
    start, end = (-half - away * ay) / square, (half - away * ay) / square
    lx, lz = pose[0, 3] + start * ax, pose[2, 3] + start * az
    hx, hz = pose[0, 3] + end * ax, pose[2, 3] + end * az
    run, rise = 2.0 * half / flat, high - low
    size = math.hypot(run, rise)
    c, s = run / size, rise / size
    for side in (1.0, -1.0):
        vx, vz = -side * uz, side * ux
        nx, nz = c * vx - s * ux, c * vz - s * uz
        add_segment(lx + low * vx, lz + low * vz, hx + high * vx, hz + high * vz, nx, nz, source, row, sections)
    if caps:
        add_segment(lx - low * uz, lz + low * ux, lx + low * uz, lz - low * ux, -ux, -uz, source, row, sections)
        add_segment(hx - high * uz, hz + high * ux, hx + high * uz, hz - high * ux, ux, uz, source, row, sections)
    return True


@kernel
def add_chord(
    center: Flat,
    u: Flat,
    half: float,
    t: float,
    sign: float,
    source: int,
    row: int,
    sections: SectionArrays,
) -> None:
    """Append the straight edge that a cap leaves at coordinate `t` of an ellipse."""
    (cx, cz), (ux, uz) = center, u
    x, z = cx + t * ux, cz + t * uz
    add_segment(x - half * uz, z + half * ux, x + half * uz, z - half * ux, sign * ux, sign * uz, source, row, sections)


@kernel
def cut_ellipsoid(pose: Floats, size: Floats, offset: float, source: int, row: int, sections: SectionArrays) -> None:
    """Append the ellipse of an ellipsoid, the image of the unit sphere under `pose · diag(size)`."""
    mx, my, mz = pose[1, 0] * size[0], pose[1, 1] * size[1], pose[1, 2] * size[2]
    m = math.sqrt(mx * mx + my * my + mz * mz)
    d = (offset - pose[1, 3]) / m
    if abs(d) >= 1.0:
        return
    mx, my, mz = mx / m, my / m, mz / m
    # Two directions normal to m: from the axis least like it.
    if abs(mx) <= abs(my) and abs(mx) <= abs(mz):
        px, py, pz = 0.0, mz, -my
    elif abs(my) <= abs(mz):
        px, py, pz = -mz, 0.0, mx
    else:
        px, py, pz = my, -mx, 0.0
    size_p = math.sqrt(px * px + py * py + pz * pz)
    px, py, pz = px / size_p, py / size_p, pz / size_p
    qx, qy, qz = my * pz - mz * py, mz * px - mx * pz, mx * py - my * px
    rho = math.sqrt(1.0 - d * d)
    cx, cz = project(pose, size, mx, my, mz)
    ax, az = project(pose, size, px, py, pz)
    bx, bz = project(pose, size, qx, qy, qz)
    turn = 0.5 * math.atan2(2.0 * (ax * bx + az * bz), ax * ax + az * az - bx * bx - bz * bz)
    c, s = math.cos(turn), math.sin(turn)
    ax, az, bx, bz = c * ax + s * bx, c * az + s * bz, c * bx - s * ax, c * bz - s * az
    a, b = rho * math.hypot(ax, az), rho * math.hypot(bx, bz)
    x, z = pose[0, 3] + d * cx, pose[2, 3] + d * cz
    if a - b <= 1e-12 * a:
        add_disk(x, z, a, source, row, sections)
    else:
        add_ellipse((x, z), (rho * ax / a, rho * az / a), a, b, -a, a, source, row, sections)


@kernel
def project(pose: Floats, size: Floats, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the in-plane image of a direction of the unit sphere."""
    x, y, z = x * size[0], y * size[1], z * size[2]
    return pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z, pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z
