"""First contact under one rotation, in closed form (docs/method.md section 3).

Everything lives in the plane of the joint: the pivot is the origin, the link turns counter-clockwise. A point that
turns through a root of the table is found without trigonometry (`p*` below); only events whose foot is inside their
segment pay for the angle. All functions return the smallest turn >= 0 [rad] before `best`, else `best`.
"""

from __future__ import annotations

import math

from clench.core.tolerances import FOOT_FRACTION
from clench.kernels.runtime.compiling import entry_kernel

TWO_PI = 2.0 * math.pi
#: Gap rates below this fraction of the lever arm count as zero: over any closing they stay under the touch tolerance.
STILL = 1e-9


@entry_kernel
def turn_to(fx: float, fz: float, tx: float, tz: float) -> float:
    """Return the counter-clockwise turn in [0, 2π) that takes direction `f` to direction `t`."""
    angle = math.atan2(fx * tz - fz * tx, fx * tx + fz * tz)
    if angle < 0.0:
        angle += TWO_PI
        if angle >= TWO_PI:
            angle = 0.0
    return angle


@entry_kernel
def is_blocking(slope: float, curvature: float, lever: float, touch: float) -> bool:
    """Say whether a touching pair blocks: its gap shrinks, or stands still and bends down.

    A lever arm within the touch tolerance blocks nothing: the gap cannot change by more than that.
    """
    if lever <= touch:
        return False
    still = STILL * lever
    return slope < -still or (slope <= still and curvature < -still)


@entry_kernel
def grazing_band(u: float, touch: float) -> float:
    """Return how far `ρ² - u²` may be off zero while a pass at offset `u` stays within the touch tolerance.

    There the foot is known only to the root of it, and rounding must not lose a rolling link that begins to press:
    beyond the end of a feature with radius `w` the gap is off by the tolerance at most over `√grazing_band(w)`.
    """
    return touch * (2.0 * abs(u) + touch)


@entry_kernel
def disk_on_segment(
    vx: float, vz: float, w: float, nx: float, nz: float, h: float, ta: float, tb: float, touch: float, best: float
) -> float:
    """First turn at which a link vertex `v` with radius `w` meets an object segment from outside.

    Args:
        vx, vz: the link vertex [m]. w: radius [m].
        nx, nz, h: outward unit normal and offset of the segment [m].
        ta, tb: its ends along (-nz, nx) [m], ta <= tb.
        touch: gaps up to this are touching [m].
        best: turns from here on are of no interest [rad].
    """
    u = h + w
    along = nx * vz - nz * vx
    gap = nx * vx + nz * vz - u
    slack = FOOT_FRACTION * (tb - ta)
    if abs(gap) <= touch and ta - slack <= along <= tb + slack:
        if is_blocking(-along, -(gap + u), math.hypot(vx, vz), touch):
            return 0.0
        if along >= 0.0:
            return best  # the entering root itself, but not blocking: it is being left
    square = vx * vx + vz * vz - u * u
    band = grazing_band(u, touch)
    if square < -band:
        return best
    if square <= band:
        slack += math.sqrt(grazing_band(w, touch))
    t = math.sqrt(max(square, 0.0))
    if t < ta - slack or t > tb + slack:
        return best
    return min(best, turn_to(vx, vz, u * nx - t * nz, u * nz + t * nx))


@entry_kernel
def side_on_vertex(
    nx: float, nz: float, g: float, ta: float, tb: float, qx: float, qz: float, w: float, touch: float, best: float
) -> float:
    """First turn at which a link side meets an object vertex `q` (the tangent case of the patent).

    Args:
        nx, nz, g: outward unit normal and offset of the link side's core [m].
        ta, tb: its ends along (-nz, nx) [m], ta <= tb.
        qx, qz: the object vertex [m]. w: radius of the outline plus that of the object [m].
        touch, best: as in `disk_on_segment`.
    """
    u = g + w
    across = nx * qx + nz * qz
    along = nx * qz - nz * qx
    slack = FOOT_FRACTION * (tb - ta)
    if abs(across - u) <= touch and ta - slack <= along <= tb + slack:
        if is_blocking(along, -across, math.hypot(qx, qz), touch):
            return 0.0
        if along <= 0.0:
            return best  # the entering root itself, but not blocking: it is being left
    square = qx * qx + qz * qz - u * u
    band = grazing_band(u, touch)
    if square < -band:
        return best
    if square <= band:
        slack += math.sqrt(grazing_band(w, touch))
    t = -math.sqrt(max(square, 0.0))
    if t < ta - slack or t > tb + slack:
        return best
    # Seen from the link the object turns clockwise, from q to the touch.
    return min(best, turn_to(u * nx - t * nz, u * nz + t * nx, qx, qz))


@entry_kernel
def disk_on_vertex(
    vx: float, vz: float, rho: float, qx: float, qz: float, r: float, w: float, touch: float, best: float
) -> float:
    """First turn at which a link vertex `v` comes within `w` > 0 of an object vertex `q`.

    Args:
        vx, vz, qx, qz: the two vertices, rho and r their distances from the pivot [m].
        w: radius of the outline plus that of the object [m]. touch, best: as in `disk_on_segment`.
    """
    if abs(rho - r) > w + touch or rho + r < w - touch or rho == 0.0 or r == 0.0:
        return best
    cross = vx * qz - vz * qx
    distance = math.sqrt((qx - vx) ** 2 + (qz - vz) ** 2)
    if abs(distance - w) <= touch:
        # d = |v - q|: d' = -cross / d, d'' = (v·q - d'²) / d
        slope = -cross / w
        if is_blocking(slope, (vx * qx + vz * qz - slope * slope) / w, min(rho, r), touch):
            return 0.0
        if cross >= 0.0:
            return best  # the entering root itself, but not blocking: it is being left
    half = math.sqrt(max((w - (rho - r)) * (w + (rho - r)), 0.0) / (4.0 * rho * r))
    turn = turn_to(vx, vz, qx, qz) - 2.0 * math.asin(min(half, 1.0))
    return min(best, turn if turn >= 0.0 else turn + TWO_PI)
