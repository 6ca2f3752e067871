"""Part triangles into the nodes of a bounding-volume tree, by the surface area rule, in several threads.

The triangles of a node lie next to each other while the tree grows, so every pass reads memory in order. Large nodes
are parted one level after another. Each smaller node is then a part of the work of its own. These parts depend on the
mesh alone, so the tree does too, and not on the number of threads.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.core.threads import core_count, share_out
from clench.kernels.runtime.compiling import entry_kernel, kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

#: Triangles per leaf at most.
LEAF_SIZE: Final = 4
#: No path from the root is longer, so a traversal stack of this many entries never overflows.
STACK_SIZE: Final = 96
#: From this depth on nodes are halved by count, which bounds the depth for any input.
_BALANCED_DEPTH: Final = 48
_BINS: Final = 16
#: A thread takes a node of at most so many triangles with all that is below it.
_PART: Final = 8192
#: Rows that a thread works on at once.
ROWS: Final = 65536


class Nodes(NamedTuple):
    """Nodes in preorder; see `clench.kernels.trees.bvh.MeshTree`."""

    low: Floats
    high: Floats
    first: Ints
    count: Ints  # type: ignore[assignment]
    right: Ints
    skip: Ints

    def rows(self, start: int, end: int) -> Nodes:
        """Return some of the nodes, as views."""
        columns: list[Any] = [column[start:end] for column in self]
        return Nodes(*columns)


class Sorted(NamedTuple):
    """Boxes of triangles (T, 6) and their numbers (T,), in the order of the tree as far as it has grown."""

    boxes: Floats
    order: Ints
    spare_boxes: Floats
    spare_order: Ints


class Scratch(NamedTuple):
    """Scratch space of a thread: of bins (B,), what `measure_boxes` writes, and a stack."""

    bin_boxes: Floats
    numbers: NDArray[np.int64]
    areas: Floats
    extent: Floats
    todo: NDArray[np.int64]


class _Span(NamedTuple):
    """A node that waits for a thread: its first triangle, the one after its last, and its depth."""

    start: int
    end: int
    depth: int


def row_parts(rows: int) -> list[slice]:
    """Return slices that part rows into works for threads, the same ones for any number of threads."""
    return [slice(start, min(start + ROWS, rows)) for start in range(0, rows, ROWS)]


def grow_tree(vertices: Floats, triangles: Ints) -> tuple[Ints, Nodes]:
    """Return the triangles in the order of the tree, (T,), and its nodes.

    Args:
        vertices: [m], (V, 3). triangles: vertex indices, (T, 3).
    """
    size = len(triangles)
    boxes, order = np.empty((size, 6)), np.arange(size, dtype=np.int32)
    share_out(lambda some: triangle_boxes(vertices, triangles[some], boxes[some]), row_parts(size), core_count())
    held = Sorted(boxes, order, np.empty_like(boxes), np.empty_like(order))
    inner, parts = _part_large(held)
    room = _room(2 * size)
    sizes = dict[int, int]()

    def grow(part: _Span) -> None:
        nodes = room.rows(2 * part.start, 2 * part.end)
        sizes[part.start] = grow_nodes(held, part.start, part.end, part.depth, nodes, _scratch())

    share_out(grow, parts, core_count())
    return order, _joined(inner, parts, room, sizes)


def _part_large(held: Sorted) -> tuple[dict[tuple[int, int], int], list[_Span]]:
    """Part all nodes that are too large for one thread.

    Returns:
        where each one ends in its left child, by its span, and the nodes that are left.
    """
    inner, parts = dict[tuple[int, int], int](), list[_Span]()
    waiting = [_Span(0, len(held.order), 0)] if len(held.order) else []

    def part(span: _Span) -> None:
        inner[span.start, span.end] = part_node(held, span.start, span.end, span.depth, _scratch())

    while waiting:
        parts += [span for span in waiting if span.end - span.start <= _PART]
        large = [span for span in waiting if span.end - span.start > _PART]
        share_out(part, large, core_count())
        waiting = []
        for start, end, depth in large:
            middle = inner[start, end]
            waiting += [_Span(start, middle, depth + 1), _Span(middle, end, depth + 1)]
    return inner, sorted(parts)


def _room(nodes: int) -> Nodes:
    """Return room for so many nodes; memory that stays unused is never taken from the system."""
    numbers = (np.empty(nodes, dtype=np.int32) for _ in range(4))
    return Nodes(np.empty((nodes, 3)), np.empty((nodes, 3)), *numbers)


def _scratch() -> Scratch:
    stack = np.empty((2 * STACK_SIZE, 4), dtype=np.int64)
    return Scratch(np.empty((_BINS, 6)), np.empty(_BINS, dtype=np.int64), np.empty(_BINS), np.empty(12), stack)


def _joined(inner: dict[tuple[int, int], int], parts: list[_Span], room: Nodes, sizes: dict[int, int]) -> Nodes:
    """Return the nodes of the whole tree, given those of its parts at twice the start of each."""
    total = len(inner) + sum(sizes.values())
    made = Nodes(*(np.empty((total, *column.shape[1:]), dtype=column.dtype) for column in room))
    place, at = dict[tuple[int, int], int](), 0
    whole = {(part.start, part.end): part.start for part in parts}
    waiting = [(0, max(part.end for part in parts))] if parts else []
    while waiting:
        span = waiting.pop()
        place[span] = at
        if span not in whole:
            middle = inner[span]
            waiting += [(middle, span[1]), (span[0], middle)]
            at += 1
            continue
        count = sizes[span[0]]
        mine, theirs = made.rows(at, at + count), room.rows(2 * span[0], 2 * span[0] + count)
        for k in range(len(mine)):
            np.copyto(mine[k], theirs[k])
        mine.right[mine.right >= 0] += at
        mine.skip[:] += at
        at += count
    _put_inner(made, inner, place)
    return made


def _put_inner(made: Nodes, inner: dict[tuple[int, int], int], place: dict[tuple[int, int], int]) -> None:
    """Write the nodes above the parts, children before their parents."""
    for span in sorted(inner, key=lambda span: -place[span]):
        node, right = place[span], place[inner[span], span[1]]
        made.low[node] = np.minimum(made.low[node + 1], made.low[right])
        made.high[node] = np.maximum(made.high[node + 1], made.high[right])
        made.first[node], made.count[node] = 0, 0
        made.right[node], made.skip[node] = right, made.skip[right]


@entry_kernel
def triangle_boxes(vertices: Floats, triangles: Ints, boxes: Floats) -> None:
    """Write the box of each triangle as (low, high), shape (T, 6)."""
    for i in range(triangles.shape[0]):
        for k in range(3):
            a = vertices[triangles[i, 0], k]
            b = vertices[triangles[i, 1], k]
            c = vertices[triangles[i, 2], k]
            boxes[i, k] = min(a, b, c)
            boxes[i, k + 3] = max(a, b, c)


@entry_kernel
def grow_nodes(held: Sorted, start: int, end: int, depth: int, nodes: Nodes, room: Scratch) -> int:
    """Part triangles into nodes down to leaves; write the nodes, and return their number.

    Args:
        held: the triangles, which are sorted from `start` to `end`. depth: of the node that holds these.
        nodes: written, numbered from 0. room: scratch space.
    """
    low, high, first, count = nodes.low, nodes.high, nodes.first, nodes.count
    right, skip, todo, extent = nodes.right, nodes.skip, room.todo, room.extent
    waiting, made = 1, 0
    todo[0, 0], todo[0, 1], todo[0, 2], todo[0, 3] = start, end, -1, depth
    while waiting:
        waiting -= 1
        begin, stop, parent, level = todo[waiting, 0], todo[waiting, 1], todo[waiting, 2], todo[waiting, 3]
        node = made
        made += 1
        if parent >= 0:
            right[parent] = node
        first[node], count[node], right[node] = 0, 0, -1
        measure_boxes(held.boxes, begin, stop, extent)
        for k in range(3):
            low[node, k], high[node, k] = extent[k], extent[3 + k]
        if stop - begin <= LEAF_SIZE:
            first[node], count[node] = begin, stop - begin
            continue
        middle = _split(held, begin, stop, level, room)
        todo[waiting, 0], todo[waiting, 1], todo[waiting, 2], todo[waiting, 3] = middle, stop, node, level + 1
        # The left child is next off the stack, hence node + 1: it needs no pointer.
        todo[waiting + 1, 0], todo[waiting + 1, 1], todo[waiting + 1, 2] = begin, middle, -1
        todo[waiting + 1, 3] = level + 1
        waiting += 2
    for node in range(made - 1, -1, -1):
        skip[node] = node + 1 if count[node] else skip[right[node]]
    return made


@entry_kernel
def part_node(held: Sorted, start: int, end: int, depth: int, room: Scratch) -> int:
    """Part the triangles of one node; return the first of its right child. See `grow_nodes`."""
    measure_boxes(held.boxes, start, end, room.extent)
    return _split(held, start, end, depth, room)


@kernel
def measure_boxes(boxes: Floats, start: int, end: int, extent: Floats) -> None:
    """Write the box around some boxes and the one around their middles, as (low, high, low, high), (12,)."""
    for k in range(3):
        low, high, least, most = np.inf, -np.inf, np.inf, -np.inf
        for i in range(start, end):
            a, b = boxes[i, k], boxes[i, k + 3]
            low, high = min(low, a), max(high, b)
            at = 0.5 * (a + b)
            least, most = min(least, at), max(most, at)
        extent[k], extent[3 + k], extent[6 + k], extent[9 + k] = low, high, least, most


@kernel
def _split(held: Sorted, start: int, end: int, depth: int, room: Scratch) -> int:
    """Part triangles along the longest axis of their middles by the surface area rule; return the middle."""
    half = (start + end) // 2
    if depth >= _BALANCED_DEPTH:
        return half
    boxes, order, spare_boxes, spare_order = held.boxes, held.order, held.spare_boxes, held.spare_order
    axis, extent = 0, room.extent
    for k in range(1, 3):
        if extent[9 + k] - extent[6 + k] > extent[9 + axis] - extent[6 + axis]:
            axis = k
    least, size = extent[6 + axis], extent[9 + axis] - extent[6 + axis]
    scale = _BINS / size if size > 0.0 else 0.0
    if not np.isfinite(scale) or scale == 0.0:
        return half
    _fill_bins(boxes, start, end, axis, least, scale, room.bin_boxes, room.numbers)
    cut = _best_cut(room.bin_boxes, room.numbers, room.areas)
    middle, rest = start, start
    for i in range(start, end):
        n = order[i]
        if _bin_of(boxes, i, axis, least, scale) < cut:
            order[middle] = n
            for k in range(6):
                boxes[middle, k] = boxes[i, k]
            middle += 1
        else:
            spare_order[rest] = n
            for k in range(6):
                spare_boxes[rest, k] = boxes[i, k]
            rest += 1
    for i in range(rest - start):
        order[middle + i] = spare_order[start + i]
        for k in range(6):
            boxes[middle + i, k] = spare_boxes[start + i, k]
    if middle in (start, end):
        return half
    return middle


@kernel
def _bin_of(boxes: Floats, i: int, axis: int, least: float, scale: float) -> int:
    """Return the bin of a box."""
    return min(int((0.5 * (boxes[i, axis] + boxes[i, axis + 3]) - least) * scale), _BINS - 1)


@kernel
def _fill_bins(
    boxes: Floats, start: int, end: int, axis: int, least: float, scale: float, bin_boxes: Floats, numbers: Any
) -> None:
    for j in range(_BINS):
        numbers[j] = 0
        for k in range(3):
            bin_boxes[j, k] = np.inf
            bin_boxes[j, k + 3] = -np.inf
    for i in range(start, end):
        j = _bin_of(boxes, i, axis, least, scale)
        numbers[j] += 1
        for k in range(3):
            bin_boxes[j, k] = min(bin_boxes[j, k], boxes[i, k])
            bin_boxes[j, k + 3] = max(bin_boxes[j, k + 3], boxes[i, k + 3])


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
