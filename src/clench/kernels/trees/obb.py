"""Read boxes of any direction around the nodes of a tree, and capsules: as thin as the surface is there.

A box is a row of numbers, see `SLAB` in `clench.kernels.trees.node_boxes`.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point

from .node_boxes import ALMOST

#: Corners of a core that is a rectangle, in order.
RECTANGLE: Final = 4
#: A capsule is that thin at most, as a fraction of the ball around the box; else the ball takes its place [-].
THIN: Final = 0.75
#: A box that is no thinner than this fraction of the width across its longest edge does not count as flat [-].
FLAT: Final = 0.5
#: How much of a box's width counts as slack beside its thickness [-].
SOME: Final = 0.1


@kernel
def slab_half(slab: Any, nx: float, ny: float, nz: float) -> float:
    """Return half the extent of a box along a vector n, times the vector's length, without its margin."""
    half = 0.0
    for k in range(3, 12, 3):
        half += abs(nx * slab[k] + ny * slab[k + 1] + nz * slab[k + 2])
    return half


@kernel
def slab_top(slab: Any, nx: float, ny: float, nz: float) -> float:
    """Return the largest coordinate of a box along the unit vector n, in the box's frame."""
    top: float = nx * slab[0] + ny * slab[1] + nz * slab[2] + slab[12] + slab_half(slab, nx, ny, nz)
    return top


@kernel
def edge_square(slab: Any, k: int) -> float:
    """Return the square of the half edge of a box that begins in column `k`: 3 the longest, 6, or 9 the shortest."""
    x, y, z = np.float64(slab[k]), np.float64(slab[k + 1]), np.float64(slab[k + 2])
    return float(x * x + y * y + z * z)


@kernel
def slab_slack(slab: Any) -> float:
    """Return about how far a box reaches beyond its content: its thickness, and some of its width [m]."""
    return math.sqrt(edge_square(slab, 9)) + SOME * math.sqrt(edge_square(slab, 6))


@kernel
def slab_misses(slab: Any, T: Floats, core: Floats, corners: int, w: float) -> bool:
    """Say whether a core lies farther than `w` beyond a face of a box, where a pose puts that; else nothing is known.

    A box without height is flat: the direction across its other edges takes the place of the third.
    """
    # In double precision, which what is made of the numbers of a box alone would not be.
    ux, uy, uz = np.float64(slab[3]), np.float64(slab[4]), np.float64(slab[5])
    vx, vy, vz = np.float64(slab[6]), np.float64(slab[7]), np.float64(slab[8])
    for axis in range(3):
        x, y, z = ux, uy, uz
        if axis == 1:
            x, y, z = vx, vy, vz
        elif axis == 2:
            x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = math.sqrt(x * x + y * y + z * z)
        nx = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z
        ny = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z
        nz = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z
        middle = x * slab[0] + y * slab[1] + z * slab[2]
        half = slab_half(slab, x, y, z)
        middle += nx * T[0, 3] + ny * T[1, 3] + nz * T[2, 3]
        low, high = math.inf, -math.inf
        for k in range(corners):
            at = nx * core[k, 0] + ny * core[k, 1] + nz * core[k, 2] - middle
            low, high = min(low, at), max(high, at)
        if max(low, -high) > half + size * (w + slab[12]):
            return True
    return False


@kernel
def put_slab_core(slab: Any, T: Floats, out: Floats) -> tuple[int, float]:
    """Write the core of the capsule around a box, in a pose: its axis, or its middle where a ball is as good.

    Returns:
        how many corners the core has, and the capsule's radius [m].
    """
    put_point(T, slab, out[0])
    long, wide = edge_square(slab, 3), edge_square(slab, 6) + edge_square(slab, 9)
    if wide >= THIN * THIN * (long + wide):
        return 1, math.sqrt(long + wide) * ALMOST + slab[12]
    for r in range(3):
        step = T[r, 0] * slab[3] + T[r, 1] * slab[4] + T[r, 2] * slab[5]
        out[0, r], out[1, r] = out[0, r] - step, out[0, r] + step
    return 2, math.sqrt(wide) * ALMOST + slab[12]


@kernel
def put_slab_face(slab: Any, T: Floats, out: Floats) -> tuple[int, float]:
    """Write a core of a box, in a pose: the rectangle through its middle along its longer edges, or `put_slab_core`'s.

    Returns:
        number of corners of the core, and the margin by which it holds the box [m].
    """
    wide, thin = edge_square(slab, 6), edge_square(slab, 9)
    if thin >= FLAT * FLAT * (wide + thin):
        return put_slab_core(slab, T, out)
    put_point(T, slab, out[0])
    for r in range(3):
        middle = out[0, r]
        u = T[r, 0] * slab[3] + T[r, 1] * slab[4] + T[r, 2] * slab[5]
        v = T[r, 0] * slab[6] + T[r, 1] * slab[7] + T[r, 2] * slab[8]
        out[0, r], out[1, r], out[2, r], out[3, r] = middle - u - v, middle + u - v, middle + u + v, middle - u + v
    return RECTANGLE, math.sqrt(thin) * ALMOST + slab[12]
