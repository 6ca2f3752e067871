"""A bounding-volume tree over triangles: built once per mesh, read by every kernel that walks a mesh."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.kernels.runtime.compiling import entry_kernel, kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: Triangles per leaf at most.
LEAF_SIZE = 4
#: No path from the root is longer, so a traversal stack of this many entries never overflows.
STACK_SIZE = 96
#: From this depth on nodes are halved by count, which bounds the depth for any input.
_BALANCED_DEPTH = 48
_BINS = 16
#: A triangle whose height is below this fraction of its longest edge has no reliable normal.
_FLAT = 1e-14


class MeshTree(NamedTuple):
    """A triangle mesh in the order of its tree; nodes are in preorder, the left child of `i` is `i + 1`.

    A walk that needs no order needs no stack: go to `i + 1`, or to `skip[i]` when node `i` is of no interest.

    Args:
        vertices: [m], shape (V, 3), in the order of the input.
        triangles: vertex indices in tree order, shape (T, 3), counter-clockwise seen from outside.
        normals: outward unit normals, shape (T, 3); zero for triangles without area.
        body: body of each triangle, shape (T,).
        original: index of each triangle in the input, shape (T,).
        low, high: corners of each node's box [m], shape (N, 3).
        first: first triangle of a leaf, shape (N,). count: its triangles, 0 for inner nodes, shape (N,).
        right: right child of an inner node, -1 for leaves, shape (N,).
        skip: first node after the node's subtree, shape (N,).
    """

    vertices: Floats
    triangles: Ints
    normals: Floats
    body: Ints
    original: Ints
    low: Floats
    high: Floats
    first: Ints
    count: Ints  # type: ignore[assignment]
    right: Ints
    skip: Ints


def build_tree(vertices: ArrayLike, triangles: ArrayLike, body: ArrayLike | None = None) -> MeshTree:
    """Build the tree of a mesh; a mesh without triangles has a tree without nodes.

    Args:
        vertices: [m], shape (V, 3).
        triangles: vertex indices, shape (T, 3).
        body: body of each triangle, shape (T,); None is all 0.

    Raises:
        ValueError: a vertex that is not finite, an index that does not exist, or a wrong length of `body`.
    """
    v = np.array(vertices, dtype=np.float64, order="C").reshape(-1, 3)
    t = np.array(triangles, dtype=np.int32, order="C").reshape(-1, 3)
    b = np.zeros(len(t), dtype=np.int32) if body is None else np.array(body, dtype=np.int32, order="C")
    if not np.isfinite(v).all():
        raise ValueError("vertices: expected finite coordinates.")
    if len(t) and (t.min() < 0 or t.max() >= len(v)):
        raise ValueError(f"triangles: expected vertex indices from 0 to {len(v) - 1}, got {t.min()} to {t.max()}.")
    if b.shape != (len(t),):
        raise ValueError(f"body: expected {len(t)} numbers, one per triangle, got shape {b.shape}.")
    order, low, high, first, count, right, skip = _grow(v, t)
    t = np.ascontiguousarray(t[order])
    normals = np.empty((len(t), 3))
    face_normals(v, t, normals)
    return MeshTree(v, t, normals, b[order], order, low, high, first, count, right, skip)


def feature_owners(tree: MeshTree) -> NDArray[np.uint8]:
    """Give every vertex and every edge to one of its triangles, so that a walk over triangles meets each once.

    Returns:
        a mask per triangle in tree order, shape (T,): bit k for its vertex k, bit 3 + k for its edge from k to k + 1.
    """
    masks = np.zeros(len(tree.triangles), dtype=np.uint8)
    vertices = tree.triangles.ravel()
    first = np.full(len(tree.vertices), -1, dtype=np.int32)
    # The last assignment wins: the first triangle that names a vertex.
    first[vertices[::-1]] = np.arange(len(vertices), dtype=np.int32)[::-1]
    _own(masks, first[first >= 0], 0)
    nexts = np.roll(tree.triangles, -1, axis=1).ravel()
    edges = np.minimum(vertices, nexts) * np.int64(max(len(tree.vertices), 1)) + np.maximum(vertices, nexts)
    order = np.argsort(edges, kind="stable")
    edges = edges[order]
    _own(masks, order[np.concatenate([[True], edges[1:] != edges[:-1]])] if len(order) else order, 3)
    return masks


def _own(masks: NDArray[np.uint8], sides: NDArray[np.integer], shift: int) -> None:
    """Set the bit of each side or corner, which is number `side % 3` of a triangle, shifted by some bits."""
    for k in range(3):
        masks[sides[sides % 3 == k] // 3] |= np.uint8(1 << (k + shift))


@entry_kernel
def face_normals(vertices: Floats, triangles: Ints, out: Floats) -> None:
    """Write the unit normal of each triangle to `out`, shape (T, 3); zero for triangles without area."""
    for i in range(triangles.shape[0]):
        a, b, c = triangles[i, 0], triangles[i, 1], triangles[i, 2]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        nx = uy * vz - uz * vy
        ny = uz * vx - ux * vz
        nz = ux * vy - uy * vx
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz)
        if area <= _FLAT * longest:
            nx, ny, nz, area = 0.0, 0.0, 0.0, 1.0
        out[i, 0] = nx / area
        out[i, 1] = ny / area
        out[i, 2] = nz / area


def _grow(vertices: Floats, triangles: Ints) -> tuple[Ints, Floats, Floats, Ints, Ints, Ints, Ints]:
    """Return the order of the triangles and the nodes.

    The arrays are made here: every kind of allocation in a kernel is one more function to compile.
    """
    size = triangles.shape[0]
    capacity = max(2 * size - 1, 0)
    order = np.arange(size, dtype=np.int32)
    low, high = np.empty((capacity, 3)), np.empty((capacity, 3))
    first, count = np.zeros(capacity, dtype=np.int32), np.zeros(capacity, dtype=np.int32)
    right, skip = np.full(capacity, -1, dtype=np.int32), np.empty(capacity, dtype=np.int32)
    boxes, centers = np.empty((size, 6)), np.empty((size, 3))
    scratch, numbers = np.empty(size, dtype=np.int32), np.empty(_BINS, dtype=np.int64)
    bin_boxes, areas = np.empty((_BINS, 6)), np.empty(_BINS)
    todo = np.zeros((2 * STACK_SIZE, 4), dtype=np.int64)
    todo[0] = 0, size, -1, 0
    triangle_boxes(vertices, triangles, boxes, centers)
    nodes = part_nodes(
        boxes, centers, order, low, high, first, count, right, skip, scratch, bin_boxes, numbers, areas, todo
    )
    return (
        order,
        low[:nodes].copy(),
        high[:nodes].copy(),
        first[:nodes].copy(),
        count[:nodes].copy(),
        right[:nodes].copy(),
        skip[:nodes].copy(),
    )


@entry_kernel
def part_nodes(
    boxes: Floats,
    centers: Floats,
    order: Ints,
    low: Floats,
    high: Floats,
    first: Ints,
    count: Ints,
    right: Ints,
    skip: Ints,
    scratch: Ints,
    bin_boxes: Floats,
    numbers: Any,
    areas: Floats,
    todo: Any,
) -> int:
    """Split the triangles into nodes down to leaves; write `order` and the nodes, return their number.

    Args:
        boxes, centers: see `triangle_boxes`. order: triangles, 0 ... T - 1 at the start, (T,).
        low, high, first, count, right, skip: the nodes, with room for 2 T - 1; `first` and `count` 0, `right` -1.
        scratch: (T,). bin_boxes, numbers, areas: one row per bin. todo: stack, whose first row is (0, T, -1, 0).
    """
    waiting = 1 if order.shape[0] else 0
    nodes = 0
    while waiting:
        waiting -= 1
        start, end, parent, depth = todo[waiting, 0], todo[waiting, 1], todo[waiting, 2], todo[waiting, 3]
        node = nodes
        nodes += 1
        if parent >= 0:
            right[parent] = node
        _bounds(boxes, order, start, end, low, high, node)
        if end - start <= LEAF_SIZE:
            first[node], count[node] = start, end - start
            continue
        middle = (start + end) // 2
        if depth < _BALANCED_DEPTH:
            middle = _split(boxes, centers, order, start, end, scratch, bin_boxes, numbers, areas)
        todo[waiting, 0], todo[waiting, 1], todo[waiting, 2], todo[waiting, 3] = middle, end, node, depth + 1
        # The left child is next off the stack, hence node + 1: it needs no pointer.
        todo[waiting + 1, 0], todo[waiting + 1, 1], todo[waiting + 1, 2] = start, middle, -1
        todo[waiting + 1, 3] = depth + 1
        waiting += 2
    for node in range(nodes - 1, -1, -1):
        skip[node] = node + 1 if count[node] else skip[right[node]]
    return nodes


@entry_kernel
def triangle_boxes(vertices: Floats, triangles: Ints, boxes: Floats, centers: Floats) -> None:
    """Write the box of each triangle as (low, high), shape (T, 6), and the middle of each box, shape (T, 3)."""
    for i in range(triangles.shape[0]):
        for k in range(3):
            a = vertices[triangles[i, 0], k]
            b = vertices[triangles[i, 1], k]
            c = vertices[triangles[i, 2], k]
            boxes[i, k] = min(a, b, c)
            boxes[i, k + 3] = max(a, b, c)
            centers[i, k] = 0.5 * (boxes[i, k] + boxes[i, k + 3])


@kernel
def _bounds(boxes: Floats, order: Ints, start: int, end: int, low: Floats, high: Floats, node: int) -> None:
    for k in range(3):
        low[node, k] = np.inf
        high[node, k] = -np.inf
    for i in range(start, end):
        t = order[i]
        for k in range(3):
            low[node, k] = min(low[node, k], boxes[t, k])
            high[node, k] = max(high[node, k], boxes[t, k + 3])


@kernel
def _split(
    boxes: Floats,
    centers: Floats,
    order: Ints,
    start: int,
    end: int,
    scratch: Ints,
    bin_boxes: Floats,
    numbers: Any,
    areas: Floats,
) -> int:
    """Part `order[start:end]` along the longest axis of the centres by the surface area rule; return the middle."""
    axis, least, most = 0, 0.0, 0.0
    for k in range(3):
        a, b = np.inf, -np.inf
        for i in range(start, end):
            a = min(a, centers[order[i], k])
            b = max(b, centers[order[i], k])
        if k == 0 or b - a > most - least:
            axis, least, most = k, a, b
    scale = _BINS / (most - least) if most > least else 0.0
    if not np.isfinite(scale) or scale == 0.0:
        return (start + end) // 2
    _fill_bins(boxes, centers, order, start, end, axis, least, scale, bin_boxes, numbers)
    cut = _best_cut(bin_boxes, numbers, areas)
    middle, rest = start, 0
    for i in range(start, end):
        t = order[i]
        if min(int((centers[t, axis] - least) * scale), _BINS - 1) < cut:
            order[middle] = t
            middle += 1
        else:
            scratch[rest] = t
            rest += 1
    for i in range(rest):
        order[middle + i] = scratch[i]
    if middle in (start, end):
        return (start + end) // 2
    return middle


@kernel
def _fill_bins(
    boxes: Floats,
    centers: Floats,
    order: Ints,
    start: int,
    end: int,
    axis: int,
    least: float,
    scale: float,
    bin_boxes: Floats,
    numbers: Any,
) -> None:
    for j in range(_BINS):
        numbers[j] = 0
        for k in range(3):
            bin_boxes[j, k] = np.inf
            bin_boxes[j, k + 3] = -np.inf
    for i in range(start, end):
        t = order[i]
        j = min(int((centers[t, axis] - least) * scale), _BINS - 1)
        numbers[j] += 1
        for k in range(3):
            bin_boxes[j, k] = min(bin_boxes[j, k], boxes[t, k])
            bin_boxes[j, k + 3] = max(bin_boxes[j, k + 3], boxes[t, k + 3])


@kernel
def _best_cut(bin_boxes: Floats, numbers: Any, areas: Floats) -> int:
    """Return the bin before which to cut: the least sum of area times number of triangles."""
    for side in range(2):
        total = 0
        x0, y0, z0, x1, y1, z1 = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
        best, cut = np.inf, _BINS // 2
        for step in range(_BINS - 1):
            j = _BINS - 1 - step if side == 0 else step
            if numbers[j]:
                total += numbers[j]
                x0, x1 = min(x0, bin_boxes[j, 0]), max(x1, bin_boxes[j, 3])
                y0, y1 = min(y0, bin_boxes[j, 1]), max(y1, bin_boxes[j, 4])
                z0, z1 = min(z0, bin_boxes[j, 2]), max(z1, bin_boxes[j, 5])
            area = 0.0
            if total:
                area = (x1 - x0) * (y1 - y0) + (y1 - y0) * (z1 - z0) + (z1 - z0) * (x1 - x0)
            if side == 0:
                areas[j] = area * total
            elif area * total + areas[j + 1] < best:
                best, cut = area * total + areas[j + 1], j + 1
    return cut
