"""The meshes of a hand's links in one piece, and what lies how deep in what (docs/method.md sections 3 and 5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats
from clench.kernels.closing.layout import Ints as Numbers
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import back, compose_inverse, put_point
from clench.kernels.trees.bvh import STACK_SIZE, Ints, MeshTree

from .mesh_clearance import PAIRS, boxes_apart, surfaces_apart
from .mesh_distance import is_inside
from .penetration import CROSSINGS, penetration


class LinkMeshArrays(NamedTuple):
    """The trees of M links, one after another; M may be smaller than the number of links of the hand.

    Args:
        link: index in the hand, (M,). closed: watertight with outward normals, (M,).
        center: of a ball around it, (M, 3), radius: of that ball [m], (M,).
        point_first: first of its points, (M + 1,). points: one of every connected part [m], (P, 3).
        vertex_first, triangle_first, node_first: first vertex, triangle and node of each, (M + 1,).
        moment_first: first row of moments of each, (M + 1,); closed meshes have none.
        tree: the trees' arrays joined, with numbers that count from each tree's own beginning. owners: (T,).
    """

    link: Numbers
    closed: Numbers
    center: Floats
    radius: Floats
    point_first: Numbers
    points: Floats
    vertex_first: Numbers
    triangle_first: Numbers
    node_first: Numbers
    moment_first: Numbers
    tree: MeshTree
    owners: NDArray[np.uint8]


class ObjectMesh(NamedTuple):
    """An object's surface: tree of all its triangles, their owners, whether closed, a point of every part."""

    tree: MeshTree
    owners: NDArray[np.uint8]
    closed: bool
    points: Floats


@kernel
def mesh_of(meshes: LinkMeshArrays, k: int) -> MeshTree:
    """Return the tree of one link."""
    v0, v1 = meshes.vertex_first[k], meshes.vertex_first[k + 1]
    t0, t1 = meshes.triangle_first[k], meshes.triangle_first[k + 1]
    n0, n1 = meshes.node_first[k], meshes.node_first[k + 1]
    tree = meshes.tree
    return MeshTree(
        tree.vertices[v0:v1],
        tree.triangles[t0:t1],
        tree.normals[t0:t1],
        tree.body[t0:t1],
        tree.original[t0:t1],
        tree.low[n0:n1],
        tree.high[n0:n1],
        tree.first[n0:n1],
        tree.count[n0:n1],
        tree.right[n0:n1],
        tree.skip[n0:n1],
        tree.moments[meshes.moment_first[k] : meshes.moment_first[k + 1]],
    )


@kernel
def in_box(obj: MeshTree, p: Floats) -> bool:
    """Say whether a point lies in the box around a mesh."""
    inside = True
    for k in range(3):
        inside = inside and obj.low[0, k] <= p[k] <= obj.high[0, k]
    return bool(inside)


@kernel
def may_touch(meshes: LinkMeshArrays, k: int, T_object_link: Floats, obj: MeshTree) -> bool:
    """Say whether the ball around a link meets the box around the object."""
    if obj.low.shape[0] == 0:
        return False
    T, center, outside = T_object_link, meshes.center, 0.0
    for r in range(3):
        c = T[r, 0] * center[k, 0] + T[r, 1] * center[k, 1] + T[r, 2] * center[k, 2] + T[r, 3]
        outside += max(max(obj.low[0, r] - c, c - obj.high[0, r]), 0.0) ** 2
    return bool(outside <= meshes.radius[k] ** 2)


class DepthWork(NamedTuple):
    """The scratch space of `depth_of`: for `penetration`, two poses, two points, and for `surfaces_apart`."""

    crossings: Floats
    stack: Ints
    poses: Floats
    points: Floats
    pairs: Ints
    cores: Floats


@kernel(allocates=True)
def make_depth_work() -> DepthWork:
    """Allocate the scratch space of `depth_of`."""
    return DepthWork(
        np.empty(CROSSINGS),
        np.empty(STACK_SIZE, dtype=np.int32),
        np.empty((2, 3, 4)),
        np.empty((2, 3)),
        np.empty((PAIRS, 2), dtype=np.int32),
        np.empty((6, 3)),
    )


@entry_kernel(allocates=True)
def measure_depths(
    meshes: LinkMeshArrays, which: Numbers, poses: Floats, solid: ObjectMesh, T_palm_object: Floats, out: Floats
) -> None:
    """Write depth and place of links, (M, 4), zeros where nothing overlaps; see `penetration`.

    No depth exceeds the ball around its link: a deeper link lies inside completely.

    Args:
        meshes: of the links. which: of them, (M,). poses: `T_palm_link` of every link, (L, 3, 4).
        solid: the object. T_palm_object: where it is, (3, 4).
    """
    work = make_depth_work()
    for k in range(meshes.link.shape[0]):
        out[k] = 0.0
        if which[k]:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = depth_of(
                meshes, k, poses[meshes.link[k]], solid, T_palm_object, 2.0 * meshes.radius[k], work
            )


@kernel
def depth_of(
    meshes: LinkMeshArrays,
    k: int,
    T_palm_link: Floats,
    solid: ObjectMesh,
    T_palm_object: Floats,
    limit: float,
    work: DepthWork,
) -> tuple[float, float, float, float]:
    """Return depth, up to a limit [m], and place of one link."""
    T, T_link_object = work.poses[0], work.poses[1]
    compose_inverse(T_palm_object, T_palm_link, T)
    if not may_touch(meshes, k, T, solid.tree):
        return 0.0, 0.0, 0.0, 0.0
    mesh, closed = mesh_of(meshes, k), meshes.closed[k] != 0
    if boxes_apart(mesh, 0, solid.tree, 0, T):
        return 0.0, 0.0, 0.0, 0.0
    # A surface can get into an open mesh without crossing it.
    apart = closed and solid.closed and surfaces_apart(mesh, solid.tree, T, work.pairs, work.cores)
    if apart and not has_contained(meshes, k, T, solid, work.points[0]):
        return 0.0, 0.0, 0.0, 0.0
    compose_inverse(T_palm_link, T_palm_object, T_link_object)
    found: tuple[float, float, float, float] = penetration(
        mesh,
        meshes.owners[meshes.triangle_first[k] : meshes.triangle_first[k + 1]],
        closed,
        solid.tree,
        solid.owners,
        solid.closed,
        T,
        T_link_object,
        limit,
        (work.crossings, work.stack),
    )
    return found


@entry_kernel(allocates=True)
def find_contained(
    meshes: LinkMeshArrays, which: Numbers, poses: Floats, solid: ObjectMesh, T_palm_object: Floats
) -> int:
    """Return a link that has a part inside the object or around a part of it, or -1; as in `measure_depths`."""
    T, p = np.empty((3, 4)), np.empty(3)
    for k in range(meshes.link.shape[0]):
        if which[k]:
            compose_inverse(T_palm_object, poses[meshes.link[k]], T)
            if has_contained(meshes, k, T, solid, p):
                return int(meshes.link[k])
    return -1


@kernel
def has_contained(meshes: LinkMeshArrays, k: int, T_object_link: Floats, solid: ObjectMesh, p: Floats) -> bool:
    """Say whether a link has a part inside the object, or around a part of it; `p` is overwritten."""
    if solid.tree.low.shape[0] > 0 and may_fit(meshes, k, T_object_link, solid.tree, p):
        for i in range(meshes.point_first[k], meshes.point_first[k + 1]):
            put_point(T_object_link, meshes.points[i], p)
            if is_inside(solid.tree, (p[0], p[1], p[2]), solid.closed):
                return True
    for i in range(solid.points.shape[0]):
        part = back(T_object_link, solid.points[i, 0], solid.points[i, 1], solid.points[i, 2])
        if is_inside(mesh_of(meshes, k), part, meshes.closed[k] != 0):
            return True
    return False


@kernel
def may_fit(meshes: LinkMeshArrays, k: int, T_object_link: Floats, obj: MeshTree, p: Floats) -> bool:
    """Say whether a link of one part lies in the object's box, as it must to lie in the object; any other may."""
    if meshes.point_first[k + 1] - meshes.point_first[k] != 1:
        return True
    put_point(T_object_link, meshes.points[meshes.point_first[k]], p)
    if not in_box(obj, p):
        return False
    for i in range(meshes.vertex_first[k], meshes.vertex_first[k + 1]):
        put_point(T_object_link, meshes.tree.vertices[i], p)
        if not in_box(obj, p):
            return False
    return True


@kernel
def may_hold_part(
    meshes: LinkMeshArrays, poses: Floats, solid: ObjectMesh, T_palm_object: Floats, points: Floats
) -> bool:
    """Say whether a part of the object may lie inside a link, as the links' balls tell; `points` is scratch, (2, 3)."""
    p, c = points[0], points[1]
    for i in range(solid.points.shape[0]):
        put_point(T_palm_object, solid.points[i], p)
        for k in range(meshes.link.shape[0]):
            put_point(poses[meshes.link[k]], meshes.center[k], c)
            if (c[0] - p[0]) ** 2 + (c[1] - p[1]) ** 2 + (c[2] - p[2]) ** 2 <= meshes.radius[k] ** 2:
                return True
    return False
