"""Rigid bodies for exact sweeps: triangles, segments and points, each with a radius, in trees of balls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .slabs import SLAB, node_slabs
from .tree import MeshTree, build_tree

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


#: By how much boxes are grown, more than rounding [m].
ROUNDING: Final = 1e-9


class BodyArrays(NamedTuple):
    """Hold several bodies, each in its own frame, one tree each; V vertices, T elements, N nodes, B bodies.

    Nodes are in preorder, the left child of `i` is `i + 1`. An element is the convex hull of its vertices, grown by its
    radius: a triangle of a mesh, the core of a capsule or of a sphere (METHOD.md section 5).

    Args:
        vertices: [m], (V, 3). elements: vertex indices, (T, 3), repeated for segments and points.
        corners: number of different vertices, 1 to 3, (T,). radius: [m], (T,).
        ball: centre and radius of the ball around each element, its own radius included [m], (T, 4).
        source: number of each element in the caller's list, (T,).
        node: centre and radius of the ball around each node [m], (N, 4).
        slab: box of any direction around each node, see `clench.kernels.slabs` [m], (N, 13).
        first: first element of a leaf, (N,). count: its elements, 0 for inner nodes, (N,).
        right: right child of an inner node, (N,). root: of each body's tree, -1 for a body without elements, (B,).
        box: middle and half size of the box around each body [m], (B, 6); half sizes below zero without elements.
    """

    vertices: Floats
    elements: Ints
    corners: Ints
    radius: Floats
    ball: Floats
    source: Ints
    node: Floats
    slab: NDArray[np.float32]
    first: Ints
    count: Ints  # type: ignore[assignment]
    right: Ints
    root: Ints
    box: Floats


class Elements(NamedTuple):
    """List the elements of one body: `vertices` (V, 3) [m], `elements` (T, 3), `radius` (T,) [m]."""

    vertices: Floats
    elements: Ints
    radius: Floats


def join_elements(parts: Sequence[Elements]) -> Elements:
    """Return the elements of several parts as those of one body, in order."""
    shift = np.cumsum([0, *(len(p.vertices) for p in parts)])
    return Elements(
        np.concatenate([np.empty((0, 3)), *(p.vertices for p in parts)]),
        np.concatenate([np.empty((0, 3), np.int32), *(p.elements + k for p, k in zip(parts, shift, strict=False))]),
        np.concatenate([np.empty(0), *(p.radius for p in parts)]),
    )


def pack_bodies(bodies: Sequence[Elements]) -> BodyArrays:
    """Build the trees of bodies and put them into one set of arrays; the order of the bodies is kept."""
    rows: list[tuple[np.ndarray, ...]] = []
    root, vertices, elements, nodes = [], 0, 0, 0
    for body in bodies:
        if not len(body.elements):
            root.append(-1)
            continue
        tree = build_tree(body.vertices, body.elements)
        radius = body.radius[tree.original]
        ball = _balls(tree.vertices[tree.triangles], radius)
        begin, end, grown = _spans(tree, radius)
        node = _node_balls(tree, grown)
        inner = tree.count == 0
        rows.append(
            (
                tree.vertices,
                tree.triangles + vertices,
                _corners(tree.vertices[tree.triangles]),
                radius,
                ball,
                tree.original,
                node,
                node_slabs(tree, begin, end, grown),
                tree.first + elements,
                tree.count,
                np.where(inner, tree.right + nodes, -1),
            )
        )
        root.append(nodes)
        vertices += len(tree.vertices)
        elements += len(tree.triangles)
        nodes += len(tree.low)
    shapes = ((0, 3), (0, 3), (0,), (0,), (0, 4), (0,), (0, 4), (0, SLAB), (0,), (0,), (0,))
    kinds = (float, np.int32, np.int32, float, float, np.int32, float, np.float32, np.int32, np.int32, np.int32)
    joined = [
        np.concatenate([np.empty(shape, kind), *(row[k] for row in rows)]).astype(kind)
        for k, (shape, kind) in enumerate(zip(shapes, kinds, strict=True))
    ]
    columns: dict[str, NDArray[Any]] = dict(zip(BodyArrays._fields, joined, strict=False))
    box = np.array([_box(body) for body in bodies]).reshape(-1, 6)
    return BodyArrays(**columns, root=np.array(root, dtype=np.int32), box=box)


def _box(body: Elements) -> Floats:
    """Return middle and half size of the box around elements, a little too large, shape (6,)."""
    if not len(body.elements):
        return np.array([0.0, 0.0, 0.0, -np.inf, -np.inf, -np.inf])
    corners = body.vertices[body.elements]
    low = (corners - body.radius[:, None, None]).min(axis=(0, 1))
    high = (corners + body.radius[:, None, None]).max(axis=(0, 1))
    return np.concatenate([0.5 * (low + high), 0.5 * (high - low) + ROUNDING])


def no_body() -> BodyArrays:
    """Return one body without elements."""
    return pack_bodies([join_elements([])])


def _corners(points: Floats) -> Ints:
    """Return how many of the first vertices of each element differ; repeated ones stand last."""
    same_last = (points[:, 1] == points[:, 2]).all(axis=1)
    same_all = same_last & (points[:, 0] == points[:, 1]).all(axis=1)
    return np.where(same_all, 1, np.where(same_last, 2, 3)).astype(np.int32)


def _balls(points: Floats, radius: Floats) -> Floats:
    """Return the ball around each element: its middle is that of the longest side, unless a corner is outside."""
    sides = np.linalg.norm(points - np.roll(points, -1, axis=1), axis=2)
    k = np.argmax(sides, axis=1)
    each = np.arange(len(points))
    center = 0.5 * (points[each, k] + points[each, (k + 1) % 3])
    reach = np.linalg.norm(points - center[:, None], axis=2).max(axis=1)
    return np.column_stack([center, reach * (1.0 + 1e-12) + radius])


def _spans(tree: MeshTree, radius: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
    """Return the first element of each node, the one after its last, and the largest radius of them."""
    # The elements of a node are those from its first leaf to its last one.
    leaves = np.flatnonzero(tree.count)
    begin = tree.first[leaves[np.searchsorted(leaves, np.arange(len(tree.low)))]].astype(np.int64)
    last = leaves[np.searchsorted(leaves, tree.skip) - 1]
    end = (tree.first[last] + tree.count[last]).astype(np.int64)
    grown = np.maximum.reduceat(np.append(radius, 0.0), np.column_stack([begin, end]).ravel())[::2]
    return begin, end, grown


def _node_balls(tree: MeshTree, grown: Floats) -> Floats:
    """Return the ball around the box of each node, grown by the largest radius of its elements."""
    reach = 0.5 * np.linalg.norm(tree.high - tree.low, axis=1) * (1.0 + 1e-12) + grown
    return np.column_stack([0.5 * (tree.low + tree.high), reach])
