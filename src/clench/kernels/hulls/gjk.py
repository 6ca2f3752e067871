"""The direction along which two convex hulls are farthest apart, by Gilbert, Johnson and Keerthi."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector, cross, dot
from clench.kernels.runtime.compiling import kernel

from .enclosing_hulls import HullArrays, lowest_corner, lowest_point

#: Steps at most; a direction that is found by then serves as well as it does.
STEPS = 20
#: Three corners make a face if the sine of the angle between two edges is above this [-].
WIDE = 1e-6


@kernel
def nearest_on_segment(s: Floats, i: int, k: int, out: Floats) -> float:
    """Write the weights of two corners in the point of their segment nearest to the origin; return its square."""
    dx, dy, dz = s[k, 0] - s[i, 0], s[k, 1] - s[i, 1], s[k, 2] - s[i, 2]
    dd = dx * dx + dy * dy + dz * dz
    t = 0.0
    if dd > 0.0:
        t = min(max(-(s[i, 0] * dx + s[i, 1] * dy + s[i, 2] * dz) / dd, 0.0), 1.0)
    out[i], out[k] = 1.0 - t, t
    x, y, z = s[i, 0] + t * dx, s[i, 1] + t * dy, s[i, 2] + t * dz
    return float(x * x + y * y + z * z)


@kernel
def nearest_on_triangle(s: Floats, i: int, j: int, k: int, out: Floats) -> float:
    """Write the weights of three corners in the point of their triangle nearest to the origin; return its square."""
    ux, uy, uz = s[j, 0] - s[i, 0], s[j, 1] - s[i, 1], s[j, 2] - s[i, 2]
    vx, vy, vz = s[k, 0] - s[i, 0], s[k, 1] - s[i, 1], s[k, 2] - s[i, 2]
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    pu = -(s[i, 0] * ux + s[i, 1] * uy + s[i, 2] * uz)
    pv = -(s[i, 0] * vx + s[i, 1] * vy + s[i, 2] * vz)
    det = uu * vv - uv * uv
    a, b = vv * pu - uv * pv, uu * pv - uv * pu
    if det > 0.0 and a >= 0.0 and b >= 0.0 and a + b <= det:
        a, b = a / det, b / det
        out[i], out[j], out[k] = 1.0 - a - b, a, b
        x, y, z = s[i, 0] + a * ux + b * vx, s[i, 1] + a * uy + b * vy, s[i, 2] + a * uz + b * vz
        return float(x * x + y * y + z * z)
    one = nearest_on_segment(s, i, j, out)
    wi, wj, wk = out[i], out[j], 0.0
    other = nearest_on_segment(s, i, k, out)
    if other < one:
        one, wi, wj, wk = other, out[i], 0.0, out[k]
    other = nearest_on_segment(s, j, k, out)
    if other < one:
        one, wi, wj, wk = other, 0.0, out[j], out[k]
    out[i], out[j], out[k] = wi, wj, wk
    return one


@kernel
def nearest_of_simplex(s: Floats, size: int, w: Floats) -> float:
    """Write the weights of 2 to 4 corners in a point of the simplex nearest to the origin; return its square.

    Of four corners the last one is new: the point lies on a face at it. An origin inside is not noticed.
    """
    if size == 2:
        return nearest_on_segment(s, 0, 1, w)
    if size == 3:
        return nearest_on_triangle(s, 0, 1, 2, w)
    best, square, a, b, c = 0, math.inf, 0.0, 0.0, 0.0
    for n in range(3):
        found = nearest_on_triangle(s, (n + 1) % 3, (n + 2) % 3, 3, w)
        if found < square:
            best, square, a, b, c = n, found, w[(n + 1) % 3], w[(n + 2) % 3], w[3]
    w[best], w[(best + 1) % 3], w[(best + 2) % 3], w[3] = 0.0, a, b, c
    return square


@kernel
def keep_corners(s: Floats, size: int, w: Floats) -> tuple[int, float, float, float]:
    """Drop the corners of a simplex that have no weight; return how many are left, and the weighted point."""
    kept, x, y, z = 0, 0.0, 0.0, 0.0
    for k in range(size):
        if w[k] > 0.0:
            x, y, z = x + w[k] * s[k, 0], y + w[k] * s[k, 1], z + w[k] * s[k, 2]
            for c in range(5):
                s[kept, c] = s[k, c]
            s[kept, 5] = w[k]
            kept += 1
    return kept, x, y, z


@kernel
def foot_on_face(s: Floats, x: float, y: float, z: float) -> Vector:
    """Return the point of a triangle's plane nearest to the origin, from the edges; of a thin one the point (x, y, z).

    Near the origin the rounding of the point itself would tilt the direction to it.
    """
    u = (s[1, 0] - s[0, 0], s[1, 1] - s[0, 1], s[1, 2] - s[0, 2])
    v = (s[2, 0] - s[0, 0], s[2, 1] - s[0, 1], s[2, 2] - s[0, 2])
    n = cross(u, v)
    square = dot(n, n)
    if square <= WIDE * WIDE * dot(u, u) * dot(v, v):
        return x, y, z
    share = (n[0] * s[0, 0] + n[1] * s[0, 1] + n[2] * s[0, 2]) / square
    return share * n[0], share * n[1], share * n[2]


@kernel
def lowest_of(others: HullArrays, other: int, corners: Floats, x: float, y: float, z: float) -> tuple[float, int]:
    """Return the smallest coordinate of a hull along a vector, and the corner; of `corners` if its number is -1."""
    if other < 0:
        return lowest_point(corners, 0, corners.shape[0], x, y, z)
    return lowest_corner(others, other, x, y, z)


@kernel
def separating_direction(
    hulls: HullArrays,
    hull: int,
    T: Floats,
    others: HullArrays,
    other: int,
    corners: Floats,
    good: tuple[float, float],
    work: Floats,
    n: Floats,
) -> bool:
    """Improve a direction from one hull to another; say whether a plane across it parts the two.

    Args:
        n: where the search begins; written. The rest as in `widest_gap`.
    """
    work[4, 5] = 0.0
    return bool(widest_gap(hulls, hull, T, others, other, corners, good, work, n) > 0.0)


@kernel
def widest_gap(
    hulls: HullArrays,
    hull: int,
    T: Floats,
    others: HullArrays,
    other: int,
    corners: Floats,
    good: tuple[float, float],
    work: Floats,
    n: Floats,
) -> float:
    """Improve a direction from one hull to another; return how far they are apart along it, below 0 if they overlap.

    Args:
        hulls, hull: the hull that the direction leads to. T: its pose in the frame of the other one, (3, 4).
        others, other: the other one; if its number is -1, the hull of `corners`, (K, 3).
        good: the search ends if no direction has a gap that is larger by more than this fraction [-], where both hulls
            are grown by this together [m].
        work: (5, 6). Rows 0 to 3: corners of the difference of both hulls, each with the numbers of its two corners and
            its weight in the point nearest to the origin. The search begins with the corners that are there, and leaves
            the last ones. The last number of row 4 says how many there are; the rest of it is scratch space.
        n: written, a unit vector in the frame of the other one; where the search begins if there are no corners, (3,).
    """
    x, y, z = n[0], n[1], n[2]
    square, bound, (share, grown) = math.inf, -math.inf, good
    s, w, size = work, work[4], int(work[4, 5])
    if size > 0:
        for k in range(size):
            put_difference(hulls, T, others, other, corners, s[k])
        square, size, x, y, z = go_nearer(s, size, w)
    for _ in range(STEPS):
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            x, length = 1.0, 1.0
        x, y, z = x / length, y / length, z / length
        u = T[0, 0] * x + T[1, 0] * y + T[2, 0] * z
        v = T[0, 1] * x + T[1, 1] * y + T[2, 1] * z
        t = T[0, 2] * x + T[1, 2] * y + T[2, 2] * z
        low, i = lowest_corner(hulls, hull, u, v, t)
        top, k = lowest_of(others, other, corners, -x, -y, -z)
        low += x * T[0, 3] + y * T[1, 3] + z * T[2, 3]
        if low + top > bound:
            bound, n[0], n[1], n[2] = low + top, x, y, z
        if size > 0 and length - bound <= share * (length - grown):
            break
        s[size, 3], s[size, 4] = i, k
        put_difference(hulls, T, others, other, corners, s[size])
        found, size, x, y, z = go_nearer(s, size + 1, w)
        if not found < square or found == 0.0:
            break
        square = found
    work[4, 5] = size
    return bound


@kernel
def put_difference(hulls: HullArrays, T: Floats, others: HullArrays, other: int, corners: Floats, p: Floats) -> None:
    """Write a corner of the difference of two hulls, of which `p` has the numbers of both corners; see `widest_gap`."""
    a, k = hulls.points[int(p[3])], int(p[4])
    b = others.points[k] if other >= 0 else corners[k]
    for r in range(3):
        p[r] = T[r, 0] * a[0] + T[r, 1] * a[1] + T[r, 2] * a[2] + T[r, 3] - b[r]


@kernel
def go_nearer(s: Floats, size: int, w: Floats) -> tuple[float, int, float, float, float]:
    """Drop the corners of a simplex that are of no use; return the square of the distance from the origin of the point
    nearest to it, how many corners are left, and the point.
    """
    if size == 1:
        s[0, 5] = 1.0
        return s[0, 0] * s[0, 0] + s[0, 1] * s[0, 1] + s[0, 2] * s[0, 2], 1, s[0, 0], s[0, 1], s[0, 2]
    found = nearest_of_simplex(s, size, w)
    size, x, y, z = keep_corners(s, size, w)
    if size == 3:
        x, y, z = foot_on_face(s, x, y, z)
    return found, size, x, y, z
