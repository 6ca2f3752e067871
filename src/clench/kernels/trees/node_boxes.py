"""Measure what the nodes and the elements of a tree reach: boxes along principal axes, and balls."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.core.threads import core_count, share_out
from clench.kernels.runtime.compiling import entry_kernel, kernel

from .tree_growth import Floats, Ints, row_parts

#: Numbers of a box: its middle, three half edges, the shortest last, and by how much it is grown.
SLAB: Final = 13
#: More than how far from square the edges of a box are in single precision [-].
ALMOST: Final = 1.0 + 1e-6
#: More than rounding to single precision takes from the smallest numbers [m].
TINY: Final = 1e-37
#: More than the relative error of a ball's radius [-].
_ROUNDED: Final = 1.0 + 1e-12
#: Numbers that describe where the corners of a node are: their count, sums, and sums of products.
_SUMS: Final = 10
#: Sweeps of rotations that make a matrix diagonal; four suffice for almost every matrix.
_SWEEPS: Final = 12
#: A matrix whose other numbers are below this part of its largest one is diagonal [-].
_DIAGONAL: Final = 1e-15
#: Nodes that a thread works on at once.
_NODES: Final = 8192


class Local(NamedTuple):
    """The elements of a tree with their vertices numbered by first use, so that neighbours lie together.

    Args:
        vertices: [m], (V, 3). elements: vertex indices in tree order, (T, 3). radius: of each element [m], (T,).
        fresh: number of vertices that elements before this one use, (T + 1,).
    """

    vertices: Floats
    elements: Ints
    radius: Floats
    fresh: Ints


class Spans(NamedTuple):
    """First element of each node, the one after its last, and the largest radius of them [m], (N,)."""

    begin: Ints
    end: Ints
    grown: Floats


def local_elements(vertices: Floats, elements: Ints, radius: Floats) -> Local:
    """Return the elements of a tree with the vertices that they use, numbered by first use.

    Args:
        vertices: [m], (V, 3). elements: in tree order, (T, 3). radius: of each [m], (T,).
    """
    place, used = np.full(len(vertices), -1, dtype=np.int32), np.empty(len(vertices), dtype=np.int32)
    found = Local(
        np.empty((len(vertices), 3)), np.empty_like(elements), radius, np.empty(len(elements) + 1, dtype=np.int32)
    )
    count = number_vertices(vertices, elements, place, used, *found[:2], found.fresh)
    return found._replace(vertices=found.vertices[:count])


def node_spans(first: Ints, count: Ints, right: Ints, radius: Floats) -> Spans:
    """Return the elements of each node.

    Args:
        first, count, right: of the nodes in preorder, (N,). radius: of the elements [m], (T,).
    """
    spans = Spans(np.empty_like(first), np.empty_like(first), np.empty(len(first)))
    span_nodes(first, count, right, radius, *spans)
    return spans


def node_slabs(local: Local, spans: Spans, right: Ints) -> NDArray[np.float32]:
    """Return a box around the elements of each node, along their principal axes.

    Single precision halves the memory that is kept and read; every box is grown by a bound on the rounding.

    Args:
        local: the elements. spans, right: of the nodes in preorder.

    Returns:
        see `SLAB` [m], (N, 13).
    """
    count = len(right)
    slab, sums, middle = (
        np.empty((count, SLAB), dtype=np.float32),
        np.empty((count, _SUMS)),
        local.vertices.mean(axis=0),
    )
    parts = [slice(start, min(start + _NODES, count)) for start in range(0, count, _NODES)]

    def sum_up(some: slice) -> None:
        begin, end = spans.begin[some], spans.end[some]
        sum_leaves(local.vertices, local.elements, middle, begin, end, right[some], sums[some])

    def measure(some: slice) -> None:
        nodes = Spans(spans.begin[some], spans.end[some], spans.grown[some])
        axes = np.empty((2, 3, 3))
        box_nodes(local, nodes, sums[some], axes[0], axes[1], np.empty(6), slab[some])

    share_out(sum_up, parts, core_count())
    sum_nodes(right, sums)
    share_out(measure, parts, core_count())
    return slab


def element_balls(local: Local) -> tuple[Ints, Floats, Floats]:
    """Return how many corners of each element differ, (T,), its ball, (T, 4), and the box around all [m], (2, 3)."""
    count = len(local.elements)
    corners, ball = np.empty(count, dtype=np.int32), np.empty((count, 4))
    parts = row_parts(count)
    boxes = np.empty((len(parts), 2, 3))

    def measure(n: int) -> None:
        some = parts[n]
        measure_elements(local.vertices, local.elements[some], local.radius[some], corners[some], ball[some], boxes[n])

    share_out(measure, range(len(parts)), core_count())
    return corners, ball, np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


@entry_kernel
def number_vertices(
    vertices: Floats, elements: Ints, place: Ints, used: Ints, points: Floats, local: Ints, fresh: Ints
) -> int:
    """Number the vertices that elements use in the order of their use; return how many there are.

    Args:
        vertices: (V, 3). elements: (T, 3). place: -1 at the start, (V,), overwritten. used: scratch space, (V,).
        points: written with the used vertices, (V, 3). local: with the elements of those, (T, 3). fresh: with how many
            vertices are used before each element, (T + 1,).
    """
    count = 0
    for t in range(elements.shape[0]):
        fresh[t] = count
        for k in range(3):
            v = elements[t, k]
            if place[v] < 0:
                place[v] = count
                used[count] = v
                count += 1
            local[t, k] = place[v]
    fresh[elements.shape[0]] = count
    for n in range(count):
        for i in range(3):
            points[n, i] = vertices[used[n], i]
    return count


@entry_kernel
def span_nodes(first: Ints, count: Ints, right: Ints, radius: Floats, begin: Ints, end: Ints, grown: Floats) -> None:
    """Write the first element of each node, the one after its last, and the largest radius of them, (N,)."""
    for n in range(first.shape[0] - 1, -1, -1):
        if count[n]:
            begin[n], end[n], grown[n] = first[n], first[n] + count[n], 0.0
            for t in range(begin[n], end[n]):
                grown[n] = max(grown[n], radius[t])
        else:
            begin[n], end[n], grown[n] = begin[n + 1], end[right[n]], max(grown[n + 1], grown[right[n]])


@entry_kernel
def sum_leaves(
    vertices: Floats, elements: Ints, middle: Floats, begin: Ints, end: Ints, right: Ints, sums: Floats
) -> None:
    """Write for each leaf how many corners it has, the sum of their coordinates, and of those' products, (N, 10)."""
    for n in range(begin.shape[0]):
        if right[n] >= 0:
            continue
        for k in range(sums.shape[1]):
            sums[n, k] = 0.0
        for t in range(begin[n], end[n]):
            for k in range(3):
                v = elements[t, k]
                x, y, z = vertices[v, 0] - middle[0], vertices[v, 1] - middle[1], vertices[v, 2] - middle[2]
                sums[n, 0] += 1.0
                sums[n, 1] += x
                sums[n, 2] += y
                sums[n, 3] += z
                sums[n, 4] += x * x
                sums[n, 5] += y * x
                sums[n, 6] += y * y
                sums[n, 7] += z * x
                sums[n, 8] += z * y
                sums[n, 9] += z * z


@entry_kernel
def sum_nodes(right: Ints, sums: Floats) -> None:
    """Write the sums of inner nodes, given those of the leaves."""
    for n in range(right.shape[0] - 1, -1, -1):
        if right[n] >= 0:
            for k in range(sums.shape[1]):
                sums[n, k] = sums[n + 1, k] + sums[right[n], k]


@entry_kernel
def box_nodes(local: Local, spans: Spans, sums: Floats, spread: Floats, axes: Floats, box: Floats, slab: Any) -> None:
    """Write the box of each node along its principal axes, see `node_slabs`.

    Args:
        local: the elements. spans, sums: of the nodes. spread, axes: scratch space, (3, 3). box: scratch space, (6,).
        slab: written, (N, 13).
    """
    vertices, elements, fresh, begin, end = local.vertices, local.elements, local.fresh, spans.begin, spans.end
    for n in range(begin.shape[0]):
        put_spread(sums[n], spread)
        put_principal_axes(spread, axes)
        for i in range(3):
            box[i], box[3 + i] = math.inf, -math.inf
        a, b = fresh[begin[n]], fresh[end[n]]
        # Vertices that no element before uses are neighbours. Few of the node's are not among those.
        for t in range(begin[n], end[n]):
            for k in range(3):
                if elements[t, k] < a:
                    reach_vertex(vertices, elements[t, k], axes, box)
        for v in range(a, b):
            reach_vertex(vertices, v, axes, box)
        put_slab(axes, box, spans.grown[n], slab[n])


@kernel
def put_spread(sums: Floats, spread: Floats) -> None:
    """Write the second moments of a node's corners about their mean, divided by the largest of them."""
    largest = 0.0
    for i in range(3):
        for j in range(i + 1):
            moment = sums[4 + i * (i + 1) // 2 + j] - sums[1 + i] * sums[1 + j] / sums[0]
            spread[i, j], spread[j, i] = moment, moment
            largest = max(largest, abs(moment))
    usual = largest > 0.0 and math.isfinite(1.0 / largest) and math.isfinite(largest)
    for i in range(3):
        for j in range(3):
            # A sum that overflows leaves no number behind.
            known = usual and math.isfinite(spread[i, j])
            spread[i, j] = spread[i, j] / largest if known else 1.0 if i == j else 0.0


@kernel
def put_principal_axes(spread: Floats, axes: Floats) -> None:
    """Write the unit eigenvectors of a symmetric matrix as rows, by Jacobi's rotations; the matrix is overwritten."""
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        if max(abs(spread[0, 1]), abs(spread[0, 2]), abs(spread[1, 2])) <= _DIAGONAL:
            break
        rotate_pair(spread, axes, 0, 1, 2)
        rotate_pair(spread, axes, 0, 2, 1)
        rotate_pair(spread, axes, 1, 2, 0)


@kernel
def rotate_pair(spread: Floats, axes: Floats, p: int, q: int, r: int) -> None:
    """Turn two axes in their plane, so that the matrix has no product of the two left; `r` is the third axis."""
    off = spread[p, q]
    if off == 0.0:
        return
    ratio = 0.5 * (spread[q, q] - spread[p, p]) / off
    # The ratio's square may overflow to infinity, which makes the tangent 0.
    tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
    cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    spread[p, p] -= tangent * off
    spread[q, q] += tangent * off
    spread[p, q], spread[q, p] = 0.0, 0.0
    a, b = spread[r, p], spread[r, q]
    spread[r, p], spread[r, q] = cosine * a - sine * b, sine * a + cosine * b
    spread[p, r], spread[q, r] = spread[r, p], spread[r, q]
    for k in range(3):
        a, b = axes[p, k], axes[q, k]
        axes[p, k], axes[q, k] = cosine * a - sine * b, sine * a + cosine * b


@kernel
def reach_vertex(vertices: Floats, v: int, axes: Floats, box: Floats) -> None:
    """Extend the smallest and the largest coordinates along three axes to a vertex."""
    x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
    for i in range(3):
        at = axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z
        box[i], box[3 + i] = min(box[i], at), max(box[3 + i], at)


@kernel
def put_slab(axes: Floats, box: Floats, grown: float, slab: Any) -> None:
    """Write a box along given axes in single precision, grown by a radius and a bound on the rounding."""
    size, lost = 0.0, 0.0
    for i in range(3):
        at = 0.0
        for k in range(3):
            at += 0.5 * (box[k] + box[3 + k]) * axes[k, i]
        slab[i] = at
        size += abs(at)
        lost += (np.float64(slab[i]) - at) ** 2
    lost = math.sqrt(lost)
    a, b, c = 0.5 * (box[3] - box[0]), 0.5 * (box[4] - box[1]), 0.5 * (box[5] - box[2])
    long = 0 if a >= b and a >= c else 1 if b >= c else 2
    short = 2 if c <= b and c <= a else 1 if b <= a else 0
    for column in range(3):
        k = long if column == 0 else short if column == 2 else 3 - long - short
        half, off = 0.5 * (box[3 + k] - box[k]), 0.0
        for i in range(3):
            edge = half * axes[k, i]
            slab[3 + 3 * column + i] = edge
            size += abs(edge)
            off += (np.float64(slab[3 + 3 * column + i]) - edge) ** 2
        lost += math.sqrt(off)
    slab[12] = (grown + lost + 1e-12 * (size + grown)) * ALMOST + TINY


@entry_kernel
def measure_elements(
    vertices: Floats, elements: Ints, radius: Floats, corners: Ints, ball: Floats, around: Floats
) -> None:
    """Write how many corners of each element differ, (T,), its ball, (T, 4), and the box around all, (2, 3).

    The middle of a ball is that of the element's longest side. The third corner can be outside: then the ball grows.
    """
    for i in range(3):
        around[0, i], around[1, i] = math.inf, -math.inf
    for t in range(elements.shape[0]):
        a, b, c = vertices[elements[t, 0]], vertices[elements[t, 1]], vertices[elements[t, 2]]
        for i in range(3):
            around[0, i] = min(around[0, i], min(a[i], b[i], c[i]) - radius[t])
            around[1, i] = max(around[1, i], max(a[i], b[i], c[i]) + radius[t])
        same = b[0] == c[0] and b[1] == c[1] and b[2] == c[2]
        corners[t] = 3 if not same else 1 if a[0] == b[0] and a[1] == b[1] and a[2] == b[2] else 2
        ab, bc, ca = apart(a, b), apart(b, c), apart(c, a)
        reach = 0.0
        for i in range(3):
            if ab >= bc and ab >= ca:
                ball[t, i] = 0.5 * (a[i] + b[i])
            elif bc >= ca:
                ball[t, i] = 0.5 * (b[i] + c[i])
            else:
                ball[t, i] = 0.5 * (c[i] + a[i])
        reach = max(apart(a, ball[t]), apart(b, ball[t]), apart(c, ball[t]))
        ball[t, 3] = reach * _ROUNDED + radius[t]


@kernel
def apart(a: Floats, b: Floats) -> float:
    """Return the distance of two points, of which the first three numbers count."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)
