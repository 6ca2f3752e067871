"""Whether a mesh that may be open winds around a point: exact, by bounds where they decide."""

from __future__ import annotations

import math
from typing import Any, Final

from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import Floats, Ints, MeshTree
from clench.kernels.trees.node_moments import AREA, RADIUS, SECOND, SPREAD, VECTOR

#: At first, a far node may add this much to the error of a winding number; in every next round `_FINER` times as much.
COARSE: Final = 0.02
_FINER: Final = 0.05
_ROUNDS: Final = 3
#: For every triangle, rounding may change a sum by this fraction of the magnitudes of all terms.
_ROUNDING: Final = 1e-14
#: A node that is nearer than the root of this [m] is never far, so that no power of the distance is 0.
_TOO_NEAR: Final = 1e-100


@entry_kernel
def winds_around(tree: MeshTree, p: Any) -> bool:
    """Say whether the winding number around a point is more than one half in magnitude, as `winding_number` has it."""
    q, allowed = (p[0], p[1], p[2]), COARSE
    if tree.moments.shape[0] > 0:
        for _ in range(_ROUNDS):
            number, error = rough_winding_number(tree, q, allowed)
            if abs(number) - error > 0.5:
                return True
            if abs(number) + error < 0.5:
                return False
            allowed *= _FINER
    return bool(abs(winding_number(tree, q)) > 0.5)


@entry_kernel
def winding_number(tree: MeshTree, p: Any) -> float:
    """Return the winding number around a point: the exact solid angle over 4π (van Oosterom and Strackee)."""
    vertices, triangles = tree.vertices, tree.triangles
    total = 0.0
    for t in range(triangles.shape[0]):
        total += half_angle(vertices, triangles, t, p)
    return total / (2.0 * math.pi)


@kernel
def half_angle(vertices: Floats, triangles: Ints, t: int, p: Any) -> float:
    """Return half of the solid angle under which a point sees a triangle."""
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    ax, ay, az = vertices[i, 0] - p[0], vertices[i, 1] - p[1], vertices[i, 2] - p[2]
    bx, by, bz = vertices[j, 0] - p[0], vertices[j, 1] - p[1], vertices[j, 2] - p[2]
    cx, cy, cz = vertices[k, 0] - p[0], vertices[k, 1] - p[1], vertices[k, 2] - p[2]
    la = math.sqrt(ax * ax + ay * ay + az * az)
    lb = math.sqrt(bx * bx + by * by + bz * bz)
    lc = math.sqrt(cx * cx + cy * cy + cz * cz)
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = la * lb * lc + (ax * bx + ay * by + az * bz) * lc
    below += (bx * cx + by * cy + bz * cz) * la + (cx * ax + cy * ay + cz * az) * lb
    return math.atan2(volume, below)


@entry_kernel
def rough_winding_number(tree: MeshTree, p: Any, allowed: float) -> tuple[float, float]:
    """Return the winding number around a point roughly, and at most how far off `winding_number` may be.

    The vector q leads from the point to a node's centre, and h from there to the surface; d = |q|, and |h| ≤ r d. The
    solid angle of the node is the integral of n·y/|y|³ with y = q + h, and this is the derivative of -1/|y| along n.
    Term k of its Taylor series in h is the derivative of -1/|y| at q along n once and along h k times, over k!. Along
    one unit vector k + 1 times, the derivative has magnitude (k + 1)! |P| / d^(k + 2), where P is a value of a Legendre
    polynomial. |P| is at most 1, and a symmetric form is nowhere larger than on one vector (Banach). So term k is at
    most (k + 1) |h|^k / d^(k + 2). From k = 2 on, the terms sum to |h|² (3 - 2 r) / (1 - r)² / d⁴ at most. The moments
    hold the terms 0 and 1, and the integral of |h|².

    Args:
        tree: the mesh, with moments. p: the point [m].
        allowed: a node that may be wrong by more counts triangle by triangle.
    """
    vertices, triangles, moments = tree.vertices, tree.triangles, tree.moments
    first, count, skip = tree.first, tree.count, tree.skip
    q = (p[0], p[1], p[2])
    number, error, gross, node = 0.0, 0.0, 0.0, 0
    while node < moments.shape[0]:
        x, y, z = moments[node, 0] - q[0], moments[node, 1] - q[1], moments[node, 2] - q[2]
        square = x * x + y * y + z * z
        radius = moments[node, RADIUS]
        if square > _TOO_NEAR and square >= 4.0 * radius * radius:
            d = math.sqrt(square)
            r = radius / d
            off = moments[node, SPREAD] * (3.0 - 2.0 * r) / ((1.0 - r) * (1.0 - r) * square * square)
            off /= 4.0 * math.pi
            if off <= allowed:
                number += _far_angle(moments, node, x, y, z, square) / (square * d) / (4.0 * math.pi)
                error += off
                gross += moments[node, AREA] / square
                node = skip[node]
                continue
        for t in range(first[node], first[node] + count[node]):
            part = half_angle(vertices, triangles, t, q) / (2.0 * math.pi)
            number += part
            gross += abs(part)
        node += 1
    return number, error * (1.0 + 1e-9) + _ROUNDING * (triangles.shape[0] + 1000) * (1.0 + gross)


@kernel
def _far_angle(moments: Floats, node: int, x: float, y: float, z: float, square: float) -> float:
    """Return the solid angle of a node times the cube of the distance, by its first two moments."""
    second = moments[node, SECOND] * x * x + moments[node, SECOND + 1] * y * y + moments[node, SECOND + 2] * z * z
    second += 2.0 * moments[node, SECOND + 3] * x * y
    second += 2.0 * (moments[node, SECOND + 4] * x + moments[node, SECOND + 5] * y) * z
    first = moments[node, VECTOR] * x + moments[node, VECTOR + 1] * y + moments[node, VECTOR + 2] * z
    return float(first - 3.0 * second / square)
