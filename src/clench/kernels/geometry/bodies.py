"""Rigid bodies for sweeps: triangles, segments and points, each with a radius, in trees of balls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.core.memory import in_parts
from clench.kernels.grid.distance_grid import DistanceGrid, grid_around, no_grid
from clench.kernels.hulls.enclosing_hulls import HullArrays, HullPart, pack_hulls
from clench.kernels.trees.bvh import MeshTree, build_tree
from clench.kernels.trees.node_boxes import SLAB, element_balls, local_elements, node_slabs, node_spans

from .convexity import is_convex

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


#: By how much boxes are grown, more than rounding [m].
ROUNDING: Final = 1e-9
#: A body of so many elements is swept faster without a grid.
FEW: Final = 8


class BodyArrays(NamedTuple):
    """Several bodies, each in its own frame, one tree each; V vertices, T elements, N nodes, B bodies.

    Nodes are in preorder, the left child of `i` is `i + 1`. An element is the convex hull of its vertices, grown by its
    radius: a triangle of a mesh, the core of a capsule or of a sphere (docs/method.md section 5).

    Args:
        vertices: [m], (V, 3). elements: vertex indices, (T, 3), repeated for segments and points.
        corners: number of different vertices, 1 to 3, (T,). radius: [m], (T,).
        ball: centre and radius of the ball around each element, its own radius included [m], (T, 4).
        source: number of each element in the caller's list, (T,).
        node: centre and radius of the ball around each node [m], (N, 4).
        slab: box of any direction around each node, see `clench.kernels.trees.obb` [m], (N, 13).
        first: first element of a leaf, (N,). count: its elements, 0 for inner nodes, (N,).
        right: right child of an inner node, (N,). root: of each body's tree, -1 for a body without elements, (B,).
        box: middle and half size of the box around each body [m], (B, 6); half sizes below zero without elements.
        hulls: convex hulls around the parts of each body; a body may have none.
        grid: of distances from the one body; bodies that move have none.
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
    hulls: HullArrays
    grid: DistanceGrid


class Elements(NamedTuple):
    """List the elements of one body.

    Args:
        vertices: [m], (V, 3). elements: vertex indices, (T, 3). radius: of each element [m], (T,).
        parts: first element of every part that has a convex hull of its own; `(0,)`: the body is one part.
    """

    vertices: Floats
    elements: Ints
    radius: Floats
    parts: tuple[int, ...] = (0,)


def join_elements(parts: Sequence[Elements]) -> Elements:
    """Return the elements of several parts as those of one body, in order."""
    shift = np.cumsum([0, *(len(p.vertices) for p in parts)])
    begin = np.cumsum([0, *(len(p.elements) for p in parts)])
    return Elements(
        np.concatenate([np.empty((0, 3)), *(p.vertices for p in parts)]),
        np.concatenate([np.empty((0, 3), np.int32), *(p.elements + k for p, k in zip(parts, shift, strict=False))]),
        np.concatenate([np.empty(0), *(p.radius for p in parts)]),
        tuple(int(k) + first for p, k in zip(parts, begin, strict=False) for first in p.parts) or (0,),
    )


def pack_bodies(bodies: Sequence[Elements]) -> BodyArrays:
    """Build the trees of bodies and put them into one set of arrays; the order of the bodies is kept."""
    packed, vertices, elements, nodes = [_nothing(0)], 0, 0, 0
    for body in bodies:
        part = _nothing(1)
        if len(body.elements):
            tree = build_tree(body.vertices, body.elements)
            part = _body(tree, body.radius[tree.original])
        inner = part.count == 0
        packed.append(
            part._replace(
                elements=part.elements + vertices,
                first=part.first + elements,
                right=np.where(inner, part.right + nodes, -1).astype(np.int32),
                root=np.where(part.root >= 0, part.root + nodes, -1).astype(np.int32),
            )
        )
        vertices += len(part.vertices)
        elements += len(part.elements)
        nodes += len(part.node)
    joined: Any = [np.concatenate(column) for column in list(zip(*packed, strict=True))[:-2]]
    joined += [pack_hulls([_parts(body) for body in bodies]), no_grid()]
    return BodyArrays(*joined)


def _parts(body: Elements) -> list[HullPart]:
    """Return every part of a body that has elements."""
    ends = (*body.parts[1:], len(body.elements))
    spans = [slice(first, end) for first, end in zip(body.parts, ends, strict=True) if end > first]
    return [
        HullPart(
            body.vertices[np.unique(body.elements[s])],
            float(body.radius[s].max()),
            is_convex(body.vertices, body.elements[s]),
        )
        for s in spans
    ]


def pack_triangles(tree: MeshTree) -> BodyArrays:
    """Return the triangles of a tree as one body, which shares the tree's arrays."""
    return _body(tree, np.zeros(len(tree.triangles))) if len(tree.triangles) else no_body()


def with_grid(body: BodyArrays) -> BodyArrays:
    """Return one body with an empty grid around it, which sweeps towards it fill; a body of few elements needs none."""
    return body._replace(grid=grid_around(body.box[0])) if len(body.elements) > FEW else body


def no_body() -> BodyArrays:
    """Return one body without elements."""
    return _nothing(1)


def _nothing(bodies: int) -> BodyArrays:
    """Return so many bodies without elements."""
    whole, box = np.empty(0, np.int32), np.array([0.0, 0.0, 0.0, -np.inf, -np.inf, -np.inf])
    return BodyArrays(
        vertices=np.empty((0, 3)),
        elements=np.empty((0, 3), np.int32),
        corners=whole,
        radius=np.empty(0),
        ball=np.empty((0, 4)),
        source=whole,
        node=np.empty((0, 4)),
        slab=np.empty((0, SLAB), np.float32),
        first=whole,
        count=whole,
        right=whole,
        root=np.full(bodies, -1, np.int32),
        box=np.tile(box, (bodies, 1)),
        hulls=pack_hulls([()] * bodies),
        grid=no_grid(),
    )


def _body(tree: MeshTree, radius: Floats) -> BodyArrays:
    """Return one body.

    Args:
        tree: of its elements. radius: of each of them, in the tree's order [m], (T,).
    """
    local = local_elements(tree.vertices, tree.triangles, radius)
    spans = node_spans(tree.first, tree.count, tree.right, radius)
    corners, ball, (low, high) = element_balls(local)
    return BodyArrays(
        vertices=tree.vertices,
        elements=tree.triangles,
        corners=corners,
        radius=radius,
        ball=ball,
        source=tree.original,
        node=_node_balls(tree, spans.grown),
        slab=node_slabs(local, spans, tree.right),
        first=tree.first,
        count=tree.count,
        right=tree.right,
        root=np.zeros(1, dtype=np.int32),
        box=np.concatenate([0.5 * (low + high), 0.5 * (high - low) + ROUNDING])[None],
        hulls=pack_hulls([()]),
        grid=no_grid(),
    )


def _node_balls(tree: MeshTree, grown: Floats) -> Floats:
    """Return the ball around the box of each node, grown by the largest radius of its elements."""
    ball = np.empty((len(tree.low), 4))
    for some in in_parts(len(ball)):
        low, high = tree.low[some], tree.high[some]
        ball[some, :3] = 0.5 * (low + high)
        ball[some, 3] = 0.5 * np.linalg.norm(high - low, axis=1) * (1.0 + 1e-12) + grown[some]
    return ball
