"""Boxes of any direction, and capsules, around the nodes of a tree: as thin as the surface is there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from .compiling import inner_kernel, kernel
from .layout import Floats

if TYPE_CHECKING:
    from .tree import MeshTree

Whole = NDArray[np.int64]
#: Numbers of a box: its middle, three half edges, the shortest last, and by how much it is grown.
SLAB: Final = 13
#: Numbers of a capsule: its middle, half of its axis, and its radius.
LIMB: Final = 7
#: A capsule is that thin at most, as a fraction of the ball around the box; else the ball takes its place [-].
THIN: Final = 0.75
#: More than rounding to single precision takes from the smallest numbers [m].
TINY: Final = 1e-37


def node_slabs(tree: MeshTree, begin: Whole, end: Whole, grown: Floats) -> NDArray[np.float32]:
    """Return a box around the elements of each node, along their principal axes.

    Single precision halves what is kept and read; every box is grown by what rounding may have taken.

    Args:
        tree: of the elements. begin, end: each node's elements, (N,). grown: their largest radius [m], (N,).

    Returns:
        see `SLAB` [m], (N, 13).
    """
    count = len(begin)
    spread, box = np.empty((count, 3, 3)), np.empty((count, 6))
    measure_spread(tree.vertices, tree.triangles, begin, end, spread)
    scale = np.abs(spread).max(axis=(1, 2), initial=0.0)
    usual = np.isfinite(scale) & (scale > 0.0)
    spread[usual] /= scale[usual, None, None]
    spread[~usual] = np.eye(3)
    axes = np.ascontiguousarray(np.linalg.eigh(spread)[1].transpose(0, 2, 1)[:, ::-1])
    measure_extent(tree.vertices, tree.triangles, begin, end, axes, box)
    middle = np.einsum("nk,nkj->nj", 0.5 * (box[:, :3] + box[:, 3:]), axes)
    half = 0.5 * (box[:, 3:] - box[:, :3])
    order = np.argsort(-half, axis=1, kind="stable")
    edges = np.take_along_axis(half[:, :, None] * axes, order[:, :, None], axis=1)
    exact = np.concatenate([middle, edges.reshape(-1, 9)], axis=1)
    slab = np.empty((count, SLAB), dtype=np.float32)
    slab[:, :12] = exact
    lost = np.linalg.norm((slab[:, :12] - exact).reshape(-1, 4, 3), axis=2).sum(axis=1)
    size = np.abs(exact).sum(axis=1) + grown
    slab[:, 12] = (grown + lost + 1e-12 * size) * (1.0 + 1e-6) + TINY
    return slab


def node_limbs(slab: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a capsule around each node: middle, half axis (zero where a ball is as good) and radius [m], (N, 7)."""
    box = slab.astype(np.float64)
    length, width, height = (np.linalg.norm(box[:, k : k + 3], axis=1) for k in (3, 6, 9))
    radius = np.sqrt(width**2 + height**2)
    ball = np.sqrt(length**2 + radius**2)
    long = radius < THIN * ball
    limb = np.empty((len(slab), LIMB), dtype=np.float32)
    limb[:, :3] = slab[:, :3]
    limb[:, 3:6] = np.where(long[:, None], slab[:, 3:6], 0.0)
    limb[:, 6] = (np.where(long, radius, ball) + box[:, 12]) * (1.0 + 1e-6) + TINY
    return limb


@kernel
def measure_spread(vertices: Floats, elements: Any, begin: Any, end: Any, spread: Floats) -> None:
    """Write the second moments of the corners of each node's elements about their mean, (N, 3, 3)."""
    for n in range(begin.shape[0]):
        for i in range(3):
            for j in range(3):
                spread[n, i, j] = 0.0
        x, y, z, corners = 0.0, 0.0, 0.0, 3.0 * (end[n] - begin[n])
        for t in range(begin[n], end[n]):
            for k in range(3):
                v = elements[t, k]
                x, y, z = x + vertices[v, 0], y + vertices[v, 1], z + vertices[v, 2]
        x, y, z = x / corners, y / corners, z / corners
        for t in range(begin[n], end[n]):
            for k in range(3):
                v = elements[t, k]
                dx, dy, dz = vertices[v, 0] - x, vertices[v, 1] - y, vertices[v, 2] - z
                spread[n, 0, 0] += dx * dx
                spread[n, 1, 1] += dy * dy
                spread[n, 2, 2] += dz * dz
                spread[n, 1, 0] += dx * dy
                spread[n, 2, 0] += dx * dz
                spread[n, 2, 1] += dy * dz
        spread[n, 0, 1], spread[n, 0, 2], spread[n, 1, 2] = spread[n, 1, 0], spread[n, 2, 0], spread[n, 2, 1]


@kernel
def measure_extent(vertices: Floats, elements: Any, begin: Any, end: Any, axes: Floats, box: Floats) -> None:
    """Write the smallest and the largest coordinate of each node's elements along its axes, (N, 6)."""
    for n in range(begin.shape[0]):
        for i in range(3):
            box[n, i], box[n, 3 + i] = np.inf, -np.inf
        for t in range(begin[n], end[n]):
            for k in range(3):
                v = elements[t, k]
                for i in range(3):
                    at = (
                        axes[n, i, 0] * vertices[v, 0] + axes[n, i, 1] * vertices[v, 1] + axes[n, i, 2] * vertices[v, 2]
                    )
                    box[n, i], box[n, 3 + i] = min(box[n, i], at), max(box[n, 3 + i], at)


@inner_kernel
def slab_top(slab: Any, nx: float, ny: float, nz: float) -> float:
    """Return the largest coordinate of a box along the unit vector n, in the box's frame."""
    top: float = nx * slab[0] + ny * slab[1] + nz * slab[2] + slab[12]
    for k in range(3, 12, 3):
        top += abs(nx * slab[k] + ny * slab[k + 1] + nz * slab[k + 2])
    return top


@inner_kernel
def slab_misses(slab: Any, T: Floats, core: Floats, corners: int, w: float) -> bool:
    """Say whether a core lies farther than `w` beyond a face of a box, where a pose puts that; else nothing is known.

    A box without height is flat: the direction across its other edges takes the place of the third.
    """
    ux, uy, uz = float(slab[3]), float(slab[4]), float(slab[5])
    vx, vy, vz = float(slab[6]), float(slab[7]), float(slab[8])
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
        half = slab_top(slab, x, y, z) - middle - slab[12]
        middle += nx * T[0, 3] + ny * T[1, 3] + nz * T[2, 3]
        low, high = math.inf, -math.inf
        for k in range(corners):
            at = nx * core[k, 0] + ny * core[k, 1] + nz * core[k, 2] - middle
            low, high = min(low, at), max(high, at)
        if max(low, -high) > half + size * (w + slab[12]):
            return True
    return False
