"""Whether the surfaces of two meshes lie apart, as the boxes of their trees tell, and near each other triangles."""

from __future__ import annotations

from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point
from clench.kernels.toi.core_motion import plane_gap
from clench.kernels.trees.bvh import STACK_SIZE, Floats, Ints, MeshTree

from .core_distance import crosses, separation

#: Pairs of nodes that wait at most: every level of either tree adds one.
PAIRS = 2 * STACK_SIZE
#: Of the numbers that two boxes are compared by, which rounding may have changed [-].
ROUNDING = 1e-13
#: Triangles that are nearer than this may touch [m].
NEAR = 1e-12


@kernel
def boxes_apart(a: MeshTree, n: int, b: MeshTree, m: int, T: Floats) -> bool:
    """Say whether a face of either of two nodes' boxes keeps them apart, `T` = `T_b_a` of shape (3, 4)."""
    lowest, highest, low, high = a.low, a.high, b.low, b.high
    x, y = 0.5 * (lowest[n, 0] + highest[n, 0]), 0.5 * (lowest[n, 1] + highest[n, 1])
    z = 0.5 * (lowest[n, 2] + highest[n, 2])
    hx, hy, hz = highest[n, 0] - x, highest[n, 1] - y, highest[n, 2] - z
    for k in range(3):
        there = T[k, 0] * x + T[k, 1] * y + T[k, 2] * z + T[k, 3]
        half = abs(T[k, 0]) * hx + abs(T[k, 1]) * hy + abs(T[k, 2]) * hz
        half += ROUNDING * (abs(there) + half)
        if there - half > high[m, k] or there + half < low[m, k]:
            return True
    x, y, z = 0.5 * (low[m, 0] + high[m, 0]), 0.5 * (low[m, 1] + high[m, 1]), 0.5 * (low[m, 2] + high[m, 2])
    hx, hy, hz = high[m, 0] - x, high[m, 1] - y, high[m, 2] - z
    x, y, z = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    for k in range(3):
        there = T[0, k] * x + T[1, k] * y + T[2, k] * z
        half = abs(T[0, k]) * hx + abs(T[1, k]) * hy + abs(T[2, k]) * hz
        half += ROUNDING * (abs(there) + half + abs(x) + abs(y) + abs(z))
        if there - half > highest[n, k] or there + half < lowest[n, k]:
            return True
    return False


@kernel
def size(tree: MeshTree, n: int) -> float:
    """Return the sum of a box's edges [m]; below 0 for a leaf, which has no smaller ones."""
    if tree.count[n] > 0:
        return -1.0
    low, high = tree.low, tree.high
    return float(high[n, 0] - low[n, 0] + high[n, 1] - low[n, 1] + high[n, 2] - low[n, 2])


@kernel
def surfaces_apart(a: MeshTree, b: MeshTree, T: Floats, pairs: Ints, cores: Floats) -> bool:
    """Say whether no triangle of one mesh touches one of another.

    Args:
        a, b: the meshes, with triangles. T: `T_b_a`, (3, 4). pairs, cores: scratch space, (PAIRS, 2) and (6, 3).
    """
    pairs[0, 0], pairs[0, 1], waiting = 0, 0, 1
    while waiting > 0:
        waiting -= 1
        n, m = pairs[waiting, 0], pairs[waiting, 1]
        if boxes_apart(a, n, b, m, T):
            continue
        one, other = size(a, n), size(b, m)
        if one < 0.0 and other < 0.0:
            if not triangles_apart(a, n, b, m, T, cores):
                return False
            continue
        if one >= other:
            pairs[waiting, 0], pairs[waiting + 1, 0], pairs[waiting + 1, 1] = a.right[n], n + 1, m
        else:
            pairs[waiting, 1], pairs[waiting + 1, 0], pairs[waiting + 1, 1] = b.right[m], n, m + 1
        waiting += 2
    return True


@kernel
def triangles_apart(a: MeshTree, n: int, b: MeshTree, m: int, T: Floats, cores: Floats) -> bool:
    """Say whether no triangle of one leaf touches one of another; the rest as in `surfaces_apart`."""
    one, other, nx, ny, nz = cores[:3], cores[3:], 0.0, 0.0, 0.0
    for i in range(a.first[n], a.first[n] + a.count[n]):
        for c in range(3):
            put_point(T, a.vertices[a.triangles[i, c]], one[c])
        for k in range(b.first[m], b.first[m] + b.count[m]):
            for c in range(3):
                for r in range(3):
                    other[c, r] = b.vertices[b.triangles[k, c], r]
            # A plane that separated two triangles separates most of their neighbours.
            if plane_gap(one, 3, other, 3, nx, ny, nz) > NEAR:
                continue
            d, nx, ny, nz, _, _, _, _, _ = separation(one, 3, other, 3)
            if d <= NEAR or crosses(one, 3, other, 3):
                return False
    return True
