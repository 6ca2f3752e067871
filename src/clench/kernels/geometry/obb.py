"""Boxes of any direction, and capsules, around the nodes of a tree: as thin as the surface is there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.memory import in_parts
from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import put_point

if TYPE_CHECKING:
    from .bvh import MeshTree

Whole = NDArray[np.int64]
#: Numbers of a box: its middle, three half edges, the shortest last, and by how much it is grown.
SLAB: Final = 13
#: Corners of a core that is a rectangle, in order.
RECTANGLE: Final = 4
#: A capsule is that thin at most, as a fraction of the ball around the box; else the ball takes its place [-].
THIN: Final = 0.75
#: A box that is no thinner than this fraction of the width across its longest edge does not count as flat [-].
FLAT: Final = 0.5
#: How much of a box's width counts as slack beside its thickness [-].
SOME: Final = 0.1
#: More than how far from square the edges of a box are in single precision [-].
ALMOST: Final = 1.0 + 1e-6
#: More than rounding to single precision takes from the smallest numbers [m].
TINY: Final = 1e-37


def node_slabs(tree: MeshTree, begin: Whole, end: Whole, grown: Floats) -> NDArray[np.float32]:
    """Return a box around the elements of each node, along their principal axes.

    Single precision halves the memory that is kept and read; every box is grown by a bound on the rounding.

    Args:
        tree: of the elements. begin, end: each node's elements, (N,). grown: their largest radius [m], (N,).

    Returns:
        see `SLAB` [m], (N, 13).
    """
    count = len(begin)
    spread, slab = np.empty((count, 3, 3)), np.empty((count, SLAB), dtype=np.float32)
    parts = np.column_stack([tree.first, tree.count, tree.right]).astype(np.int64)
    middle = tree.vertices.mean(axis=0)
    measure_spread(tree.vertices - middle, tree.triangles, parts, np.empty((count, 10)), spread)
    for some in in_parts(count):
        slab[some] = _slabs(tree, begin[some], end[some], grown[some], spread[some])
    return slab


def _slabs(tree: MeshTree, begin: Whole, end: Whole, grown: Floats, spread: Floats) -> NDArray[np.float32]:
    """Return what `node_slabs` does for some nodes, whose second moments are given and overwritten."""
    scale = np.abs(spread).max(axis=(1, 2), initial=0.0)
    usual = np.isfinite(scale) & (scale > 0.0)
    spread[usual] /= scale[usual, None, None]
    spread[~usual] = np.eye(3)
    axes = np.ascontiguousarray(np.linalg.eigh(spread)[1].transpose(0, 2, 1)[:, ::-1])
    box = np.empty((len(begin), 6))
    measure_extent(tree.vertices, tree.triangles, begin, end, axes, box)
    middle = np.einsum("nk,nkj->nj", 0.5 * (box[:, :3] + box[:, 3:]), axes)
    half = 0.5 * (box[:, 3:] - box[:, :3])
    order = np.argsort(-half, axis=1, kind="stable")
    edges = np.take_along_axis(half[:, :, None] * axes, order[:, :, None], axis=1)
    exact = np.concatenate([middle, edges.reshape(-1, 9)], axis=1)
    slab = np.empty((len(begin), SLAB), dtype=np.float32)
    slab[:, :12] = exact
    lost = np.linalg.norm((slab[:, :12] - exact).reshape(-1, 4, 3), axis=2).sum(axis=1)
    size = np.abs(exact).sum(axis=1) + grown
    slab[:, 12] = (grown + lost + 1e-12 * size) * ALMOST + TINY
    return slab


@entry_kernel
def measure_spread(vertices: Floats, elements: Any, tree_parts: Any, sums: Floats, spread: Floats) -> None:
    """Write the second moments of the corners of each node's elements about their mean, (N, 3, 3).

    Args:
        vertices, elements: of the tree. tree_parts: first element, number of elements and right child of each node,
            (N, 3). sums: how many corners, the sum of their coordinates, and of those' products, (N, 10), overwritten.
    """
    for n in range(sums.shape[0] - 1, -1, -1):
        first, count, right = tree_parts[n, 0], tree_parts[n, 1], tree_parts[n, 2]
        for k in range(10):
            sums[n, k] = 0.0 if count > 0 else sums[n + 1, k] + sums[right, k]
        for t in range(first, first + count):
            for k in range(3):
                p = vertices[elements[t, k]]
                sums[n, 0] += 1.0
                for i in range(3):
                    sums[n, 1 + i] += p[i]
                    for j in range(i + 1):
                        sums[n, 4 + i * (i + 1) // 2 + j] += p[i] * p[j]
        for i in range(3):
            for j in range(i + 1):
                product = sums[n, 1 + i] * sums[n, 1 + j] / sums[n, 0]
                spread[n, i, j] = sums[n, 4 + i * (i + 1) // 2 + j] - product
                spread[n, j, i] = spread[n, i, j]


@entry_kernel
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
