"""A bounding-volume tree over triangles: built once per mesh, read by every kernel that walks a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.threads import core_count, share_out
from clench.kernels.runtime.compiling import entry_kernel

from .connectivity import owned_features
from .node_boxes import local_elements
from .node_moments import COLUMNS, node_moments
from .tree_growth import LEAF_SIZE, STACK_SIZE, Floats, Ints, grow_tree, row_parts

__all__ = ["LEAF_SIZE", "STACK_SIZE", "Floats", "Ints", "MeshTree", "build_tree", "feature_owners"]

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
        moments: see `node_moments`, shape (N, 15); only an open mesh needs them, others have no rows.
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
    moments: Floats


def build_tree(
    vertices: ArrayLike, triangles: ArrayLike, body: ArrayLike | None = None, is_open: bool = False
) -> MeshTree:
    """Build the tree of a mesh; a mesh without triangles has a tree without nodes.

    Args:
        vertices: [m], shape (V, 3).
        triangles: vertex indices, shape (T, 3).
        body: body of each triangle, shape (T,); None is all 0.
        is_open: the mesh is not watertight; with moments, what lies inside it is told much faster.

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
    order, nodes = grow_tree(v, t)
    t = np.ascontiguousarray(t[order])
    normals = np.empty((len(t), 3))
    share_out(lambda some: face_normals(v, t[some], normals[some]), row_parts(len(t)), core_count())
    moments = node_moments(v, t, nodes) if is_open else np.empty((0, COLUMNS))
    return MeshTree(v, t, normals, b[order], order, *nodes, moments)


def feature_owners(tree: MeshTree) -> NDArray[np.uint8]:
    """Give every vertex and every edge to one of its triangles, so that a walk over triangles meets each once.

    Returns:
        a mask per triangle in tree order, shape (T,): bit k for its vertex k, bit 3 + k for its edge from k to k + 1.
    """
    # Numbered by first use, vertices of neighbours lie together: the pass takes half the time.
    local = local_elements(tree.vertices, tree.triangles, np.zeros(len(tree.triangles)))
    return owned_features(local.elements, len(local.vertices))


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
