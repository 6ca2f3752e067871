"""Planes across the way of a mesh that moves along a line: they tell how far it goes before it meets a part.

Let n be a unit vector with n·d > 0 for the direction d of the motion. A moving point p that meets a resting point q
after a distance t has n·p + t n·d = n·q. So no point of one set meets a point of another one before

    t = (least n·q - largest n·p) / n·d.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.trees.bvh import MeshTree

#: The planes that are remembered, the latest first, and the columns of each: normal in the frame of the mesh at rest,
#: and in the moving mesh's frame; height of that frame's origin; height of the moving mesh; 1/(n·d), 0 for no plane.
PLANES, COLUMNS = 4, 9
#: A plane is of use if the motion leads through it at this sine of an angle at least [-].
STEEP = 0.05
_ORIGIN, _TOP, _PER_HEIGHT = 6, 7, 8


@kernel
def forget_passing(planes: Floats) -> None:
    """Forget all planes, shape (PLANES, COLUMNS)."""
    for k in range(PLANES):
        planes[k, _PER_HEIGHT] = 0.0


@kernel
def remember_passing(n: Vector, moving: MeshTree, T: Floats, direction: Floats, planes: Floats) -> None:
    """Put a plane before the others, and forget the last one; nothing for a plane that is edge-on to the motion.

    Args:
        n: unit normal in the frame of the mesh at rest, of either sign. T: pose of the moving mesh at the start.
        direction: of the motion, (3,). planes: see `PLANES`.
    """
    x, y, z = n
    along = x * direction[0] + y * direction[1] + z * direction[2]
    if not abs(along) > STEEP:
        return
    if along < 0.0:
        x, y, z, along = -x, -y, -z, -along
    for k in range(PLANES - 1, 0, -1):
        for c in range(COLUMNS):
            planes[k, c] = planes[k - 1, c]
    row = planes[0]
    row[0], row[1], row[2] = x, y, z
    for c in range(3):
        row[3 + c] = T[0, c] * x + T[1, c] * y + T[2, c] * z
    row[_ORIGIN] = T[0, 3] * x + T[1, 3] * y + T[2, 3] * z
    row[_TOP] = row[_ORIGIN] + top_of(moving, (row[3], row[4], row[5]))
    row[_PER_HEIGHT] = 1.0 / along


@kernel
def passes_until(moving: MeshTree, a: int, rest: MeshTree, b: int, slack: float, limit: float, planes: Floats) -> bool:
    """Say whether a plane tells that the parts of two meshes in two nodes do not meet before `limit`.

    Args:
        slack: more than all rounding of a height [m].
    """
    for k in range(PLANES):
        per_height = planes[k, _PER_HEIGHT]
        if per_height == 0.0:
            return False
        low, top = box_low(rest, b, planes[k]), planes[k, _TOP]
        if (low - top - slack) * per_height >= limit:
            return True
        top = min(top, planes[k, _ORIGIN] + box_top(moving, a, (planes[k, 3], planes[k, 4], planes[k, 5])))
        if (low - top - slack) * per_height >= limit:
            return True
    return False


@kernel
def passes_triangle(
    moving: MeshTree, a: int, triangle: tuple[Vector, Vector, Vector], slack: float, limit: float, planes: Floats
) -> bool:
    """Say whether a plane tells that a node of the moving mesh does not meet a resting triangle before `limit`."""
    u, v, w = triangle
    for k in range(PLANES):
        n, per_height = planes[k], planes[k, _PER_HEIGHT]
        if per_height == 0.0:
            return False
        low = min(
            n[0] * u[0] + n[1] * u[1] + n[2] * u[2],
            n[0] * v[0] + n[1] * v[1] + n[2] * v[2],
            n[0] * w[0] + n[1] * w[1] + n[2] * w[2],
        )
        top = min(n[_TOP], n[_ORIGIN] + box_top(moving, a, (n[3], n[4], n[5])))
        if (low - top - slack) * per_height >= limit:
            return True
    return False


@kernel
def box_low(tree: MeshTree, node: int, n: Floats) -> float:
    """Return the least height of a node's box along a vector [m]."""
    low, high = tree.low[node], tree.high[node]
    return float(
        min(n[0] * low[0], n[0] * high[0]) + min(n[1] * low[1], n[1] * high[1]) + min(n[2] * low[2], n[2] * high[2])
    )


@kernel
def box_top(tree: MeshTree, node: int, n: Vector) -> float:
    """Return the largest height of a node's box along a vector [m]."""
    low, high, x, y, z = tree.low[node], tree.high[node], n[0], n[1], n[2]
    return float(max(x * low[0], x * high[0]) + max(y * low[1], y * high[1]) + max(z * low[2], z * high[2]))


@kernel
def top_of(tree: MeshTree, n: Vector) -> float:
    """Return the largest height of a mesh along a vector [m]."""
    node = 0
    while tree.count[node] == 0:
        right = tree.right[node]
        node = node + 1 if box_top(tree, node + 1, n) >= box_top(tree, right, n) else right
    top, node, count = top_of_leaf(tree, node, n), 0, tree.low.shape[0]
    while node < count:
        if box_top(tree, node, n) <= top:
            node = tree.skip[node]
            continue
        if tree.count[node] > 0:
            top = max(top, top_of_leaf(tree, node, n))
        node += 1
    return top


@kernel
def top_of_leaf(tree: MeshTree, node: int, n: Vector) -> float:
    """Return the largest height of a leaf's triangles along a vector [m]."""
    top = -math.inf
    for i in range(tree.first[node], tree.first[node] + tree.count[node]):
        for k in range(3):
            p = tree.vertices[tree.triangles[i, k]]
            top = max(top, n[0] * p[0] + n[1] * p[1] + n[2] * p[2])
    return top
