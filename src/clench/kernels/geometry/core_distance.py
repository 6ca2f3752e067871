"""Distance between two triangles, segments or points, with the direction that separates them best."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import entry_kernel, kernel

#: Edges whose directions are closer than this are parallel [-]; the difference of their points gives the direction.
PARALLEL = 1e-8
#: Feature of the first core and of the second that are closest: its corner, its edge or its face.
AT_CORNER, AT_EDGE, AT_FACE = 0, 1, 2

#: Distance, unit direction from the second core to the first, feature of each, closest point of the second.
Separation = tuple[float, float, float, float, int, int, float, float, float]


@kernel
def face_normal(t: Floats) -> tuple[float, float, float, float]:
    """Return the unit normal of a triangle and twice its area; zeros for one without area."""
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    if size <= 1e-14 * longest:
        return 0.0, 0.0, 0.0, 0.0
    return nx / size, ny / size, nz / size, size


@kernel
def above_face(t: Floats, nx: float, ny: float, nz: float, px: float, py: float, pz: float) -> bool:
    """Say whether a point lies straight above or below a triangle with unit normal n."""
    for k in range(3):
        j = (k + 1) % 3
        ex, ey, ez = t[j, 0] - t[k, 0], t[j, 1] - t[k, 1], t[j, 2] - t[k, 2]
        dx, dy, dz = px - t[k, 0], py - t[k, 1], pz - t[k, 2]
        side = nx * (ey * dz - ez * dy) + ny * (ez * dx - ex * dz) + nz * (ex * dy - ey * dx)
        if side < 0.0:
            return False
    return True


@kernel
def edge_pair(a: Floats, i: int, j: int, b: Floats, k: int, m: int) -> tuple[float, float, float, float, float, float]:
    """Return where two edges are closest: parameters from 0 to 1 on each, difference there, and its square."""
    ux, uy, uz = a[j, 0] - a[i, 0], a[j, 1] - a[i, 1], a[j, 2] - a[i, 2]
    vx, vy, vz = b[m, 0] - b[k, 0], b[m, 1] - b[k, 1], b[m, 2] - b[k, 2]
    rx, ry, rz = a[i, 0] - b[k, 0], a[i, 1] - b[k, 1], a[i, 2] - b[k, 2]
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    ur, vr = ux * rx + uy * ry + uz * rz, vx * rx + vy * ry + vz * rz
    s, t = 0.0, 0.0
    if uu > 0.0 and vv > 0.0:
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        sine = cx * cx + cy * cy + cz * cz
        if sine > PARALLEL * PARALLEL * uu * vv:
            s = min(max((uv * vr - ur * vv) / sine, 0.0), 1.0)
        t = (uv * s + vr) / vv
        if t < 0.0:
            t, s = 0.0, min(max(-ur / uu, 0.0), 1.0)
        elif t > 1.0:
            t, s = 1.0, min(max((uv - ur) / uu, 0.0), 1.0)
    elif uu > 0.0:
        s = min(max(-ur / uu, 0.0), 1.0)
    elif vv > 0.0:
        t = min(max(vr / vv, 0.0), 1.0)
    dx, dy, dz = rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz
    return s, t, dx, dy, dz, dx * dx + dy * dy + dz * dz


@kernel
def edge_count(corners: int) -> int:
    """Return how many edges a core has; a point counts as one of no length."""
    return 3 if corners == 3 else 1


@kernel
def corner_over_face(a: Floats, ka: int, b: Floats, kb: int, best: float) -> tuple[float, float, float, float, int]:
    """Return the closest corner of `a` over the face of `b` nearer than `best`: distance, direction, number."""
    d, mx, my, mz, corner = best, 0.0, 0.0, 0.0, -1
    if kb == 3:
        nx, ny, nz, size = face_normal(b)
        if size > 0.0:
            for i in range(ka):
                h = nx * (a[i, 0] - b[0, 0]) + ny * (a[i, 1] - b[0, 1]) + nz * (a[i, 2] - b[0, 2])
                if abs(h) < d and above_face(b, nx, ny, nz, a[i, 0], a[i, 1], a[i, 2]):
                    sign = 1.0 if h >= 0.0 else -1.0
                    d, mx, my, mz, corner = abs(h), sign * nx, sign * ny, sign * nz, i
    return d, mx, my, mz, corner


@entry_kernel
def separation(a: Floats, ka: int, b: Floats, kb: int) -> Separation:
    """Return how far two cores are apart, and along which direction.

    Cores that cross each other are not noticed here: the distance is then that of the nearest corners and edges.

    Args:
        a, b: their corners [m], (3, 3). ka, kb: how many of them count, 1 to 3.
    """
    d, nx, ny, nz, i = corner_over_face(a, ka, b, kb, math.inf)
    fa, fb, qx, qy, qz = AT_CORNER, AT_FACE, 0.0, 0.0, 0.0
    if i >= 0:
        qx, qy, qz = a[i, 0] - d * nx, a[i, 1] - d * ny, a[i, 2] - d * nz
    e, mx, my, mz, k = corner_over_face(b, kb, a, ka, d)
    if k >= 0:
        d, nx, ny, nz, fa, fb = e, -mx, -my, -mz, AT_FACE, AT_CORNER
        qx, qy, qz = b[k, 0], b[k, 1], b[k, 2]
    square, s, t, dx, dy, dz, edge, other = d * d, 0.0, 0.0, 0.0, 0.0, 0.0, -1, -1
    for i in range(edge_count(ka)):
        for k in range(edge_count(kb)):
            at, there, x, y, z, apart = edge_pair(a, i, (i + 1) % ka, b, k, (k + 1) % kb)
            if apart < square:
                square, s, t, dx, dy, dz, edge, other = apart, at, there, x, y, z, i, k
    if edge >= 0:
        d, i, k, m = math.sqrt(square), (edge + 1) % ka, other, (other + 1) % kb
        fa = AT_EDGE if 0.0 < s < 1.0 else AT_CORNER
        fb = AT_EDGE if 0.0 < t < 1.0 else AT_CORNER
        nx, ny, nz = edge_direction(a, edge, i, b, k, m, dx, dy, dz, fa == AT_EDGE and fb == AT_EDGE)
        qx = b[k, 0] + t * (b[m, 0] - b[k, 0])
        qy = b[k, 1] + t * (b[m, 1] - b[k, 1])
        qz = b[k, 2] + t * (b[m, 2] - b[k, 2])
    return d, nx, ny, nz, fa, fb, qx, qy, qz


@kernel
def edge_direction(
    a: Floats, i: int, j: int, b: Floats, k: int, m: int, dx: float, dy: float, dz: float, inside: bool
) -> tuple[float, float, float]:
    """Return the unit direction between the closest points of two edges, from their cross product where they cross."""
    if inside:
        ux, uy, uz = a[j, 0] - a[i, 0], a[j, 1] - a[i, 1], a[j, 2] - a[i, 2]
        vx, vy, vz = b[m, 0] - b[k, 0], b[m, 1] - b[k, 1], b[m, 2] - b[k, 2]
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = math.sqrt(cx * cx + cy * cy + cz * cz)
        scale = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
        if size * size > PARALLEL * PARALLEL * scale:
            if cx * dx + cy * dy + cz * dz < 0.0:
                size = -size
            return cx / size, cy / size, cz / size
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    if size == 0.0:
        return 0.0, 0.0, 1.0
    return dx / size, dy / size, dz / size


@kernel
def edge_pierces(a: Floats, i: int, j: int, b: Floats, nx: float, ny: float, nz: float) -> bool:
    """Say whether an edge goes through the inside of a triangle with unit normal n."""
    hi = nx * (a[i, 0] - b[0, 0]) + ny * (a[i, 1] - b[0, 1]) + nz * (a[i, 2] - b[0, 2])
    hj = nx * (a[j, 0] - b[0, 0]) + ny * (a[j, 1] - b[0, 1]) + nz * (a[j, 2] - b[0, 2])
    if hi * hj > 0.0 or hi == hj:
        return False
    t = hi / (hi - hj)
    x, y, z = a[i, 0] + t * (a[j, 0] - a[i, 0]), a[i, 1] + t * (a[j, 1] - a[i, 1]), a[i, 2] + t * (a[j, 2] - a[i, 2])
    return bool(above_face(b, nx, ny, nz, x, y, z))


@kernel
def crosses(a: Floats, ka: int, b: Floats, kb: int) -> bool:
    """Say whether an edge of one core goes through the face of the other."""
    if kb == 3:
        nx, ny, nz, size = face_normal(b)
        if size > 0.0:
            for i in range(edge_count(ka)):
                if edge_pierces(a, i, (i + 1) % ka, b, nx, ny, nz):
                    return True
    if ka == 3:
        nx, ny, nz, size = face_normal(a)
        if size > 0.0:
            for k in range(edge_count(kb)):
                if edge_pierces(b, k, (k + 1) % kb, a, nx, ny, nz):
                    return True
    return False
