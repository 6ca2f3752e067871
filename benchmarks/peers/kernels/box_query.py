"""Collision queries between two solids through trees of boxes, for the baselines of `clench bench peers`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import Elements
from clench.kernels.geometry.core_distance import crosses, separation
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point
from clench.kernels.trees.bvh import build_tree

#: Pairs of nodes that wait at most: every level of either tree adds one, and no tree is deeper than 96.
PAIRS = 512


class BoxTrees(NamedTuple):
    """Several solids, each in its own frame, one tree of boxes each; T elements, N nodes, B solids.

    Args:
        points: corners of each element [m], (T, 3, 3). corners: how many count, 1 to 3, (T,). radius: [m], (T,).
        middle, half: of each node's box, radii included [m], (N, 3).
        first, count: elements of a leaf, count 0 for inner nodes, (N,). right: right child, the left is the next, (N,).
        root: of each solid, -1 for one without elements, (B,).
    """

    points: Floats
    corners: Ints
    radius: Floats
    middle: Floats
    half: Floats
    first: Ints
    count: Ints  # type: ignore[assignment]
    right: Ints
    root: Ints


class Query(NamedTuple):
    """The scratch space of queries: pose of the first solid in the second's frame, (3, 4), and buffers."""

    pose: Floats
    spread: Floats
    moved: Floats
    stack: Ints


@kernel(allocates=True)
def make_query() -> Query:
    """Allocate the scratch space of queries."""
    return Query(np.empty((3, 4)), np.empty((3, 3)), np.empty((3, 3)), np.empty((PAIRS, 2), dtype=np.int64))


def box_trees(solids: Sequence[Elements]) -> BoxTrees:
    """Build the trees of solids, in their order."""
    rows: list[tuple[np.ndarray, ...]] = []
    root, elements, nodes = [], 0, 0
    for solid in solids:
        root.append(nodes if len(solid.elements) else -1)
        if not len(solid.elements):
            continue
        tree = build_tree(solid.vertices, solid.elements)
        points, radius = tree.vertices[tree.triangles], solid.radius[tree.original]
        low, high = _boxes(points, radius, tree.first, tree.count, tree.right)
        same = (points[:, 1] == points[:, 2]).all(axis=1)
        corners = np.where(same, np.where((points[:, 0] == points[:, 1]).all(axis=1), 1, 2), 3)
        box = 0.5 * (low + high), 0.5 * (high - low)
        rows.append((points, corners, radius, *box, tree.first + elements, tree.count, tree.right + nodes))
        elements += len(points)
        nodes += len(low)
    empty = (np.empty((0, 3, 3)), *[np.empty(0)] * 2, *[np.empty((0, 3))] * 2, *[np.empty(0)] * 3)
    columns = [np.concatenate(column) for column in zip(*(rows or [empty]), strict=True)]
    kinds = (float, np.int64, float, float, float, np.int64, np.int64, np.int64)
    arrays: dict[str, Any] = {
        name: column.astype(kind) for name, column, kind in zip(BoxTrees._fields, columns, kinds, strict=False)
    }
    return BoxTrees(**arrays, root=np.array(root, dtype=np.int64))


def _boxes(points: Floats, radius: Floats, first: Any, count: Any, right: Any) -> tuple[Floats, Floats]:
    """Return both corners of the box of every node, a little too large."""
    low = points.min(axis=1) - radius[:, None]
    high = points.max(axis=1) + radius[:, None]
    lows, highs = np.empty((len(first), 3)), np.empty((len(first), 3))
    for i in range(len(first) - 1, -1, -1):
        if count[i]:
            own = slice(first[i], first[i] + count[i])
            lows[i], highs[i] = low[own].min(axis=0), high[own].max(axis=0)
        else:
            lows[i] = np.minimum(lows[i + 1], lows[right[i]])
            highs[i] = np.maximum(highs[i + 1], highs[right[i]])
    return lows - 1e-12, highs + 1e-12


@kernel
def within(one: BoxTrees, m: int, other: BoxTrees, r: int, bound: float, query: Query) -> bool:
    """Say whether two solids cross or come nearer than a bound [m]; `query.pose` places the first in the second."""
    stack, waiting = query.stack, 0
    if one.root[m] >= 0 and other.root[r] >= 0:
        stack[0, 0], stack[0, 1] = one.root[m], other.root[r]
        waiting = 1
    for i in range(3):
        for k in range(3):
            query.spread[i, k] = abs(query.pose[i, k])
    found = False
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if boxes_apart(one, a, other, b, bound, query):
            continue
        if one.count[a] > 0 and other.count[b] > 0:
            if leaves_meet(one, a, other, b, bound, query):
                found = True
                break
        elif other.count[b] > 0 or (one.count[a] == 0 and larger(one.half[a], other.half[b])):
            stack[waiting, 0], stack[waiting, 1] = one.right[a], b
            stack[waiting + 1, 0], stack[waiting + 1, 1] = a + 1, b
            waiting += 2
        else:
            stack[waiting, 0], stack[waiting, 1] = a, other.right[b]
            stack[waiting + 1, 0], stack[waiting + 1, 1] = a, b + 1
            waiting += 2
    return found


@kernel
def larger(a: Floats, b: Floats) -> bool:
    """Say whether a box has the longer diagonal."""
    return bool(a[0] ** 2 + a[1] ** 2 + a[2] ** 2 > b[0] ** 2 + b[1] ** 2 + b[2] ** 2)


@kernel
def boxes_apart(one: BoxTrees, a: int, other: BoxTrees, b: int, bound: float, query: Query) -> bool:
    """Say whether a face of either box keeps two nodes apart by more than a bound."""
    T, spread, p, q = query.pose, query.spread, one.middle[a], other.middle[b]
    e, f = one.half[a], other.half[b]
    x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3] - q[0]
    y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3] - q[1]
    z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3] - q[2]
    apart = abs(x) > f[0] + bound + spread[0, 0] * e[0] + spread[0, 1] * e[1] + spread[0, 2] * e[2]
    apart = apart or abs(y) > f[1] + bound + spread[1, 0] * e[0] + spread[1, 1] * e[1] + spread[1, 2] * e[2]
    apart = apart or abs(z) > f[2] + bound + spread[2, 0] * e[0] + spread[2, 1] * e[1] + spread[2, 2] * e[2]
    for k in range(3):
        if apart:
            break
        along = T[0, k] * x + T[1, k] * y + T[2, k] * z
        reach = spread[0, k] * f[0] + spread[1, k] * f[1] + spread[2, k] * f[2]
        apart = abs(along) > e[k] + bound + reach
    return bool(apart)


@kernel
def leaves_meet(one: BoxTrees, a: int, other: BoxTrees, b: int, bound: float, query: Query) -> bool:
    """Say whether any elements of two leaves cross or come nearer than a bound."""
    found = False
    for i in range(one.first[a], one.first[a] + one.count[a]):
        for c in range(3):
            put_point(query.pose, one.points[i, c], query.moved[c])
        for k in range(other.first[b], other.first[b] + other.count[b]):
            ka, kb = one.corners[i], other.corners[k]
            reach = one.radius[i] + other.radius[k] + bound
            near = reach > 0.0 and separation(query.moved, ka, other.points[k], kb)[0] < reach
            found = found or near or crosses(query.moved, ka, other.points[k], kb)
        if found:
            break
    return found
