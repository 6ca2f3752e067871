"""Bring open hands up to an object along their palms' normals: where each one stops (docs/method.md section 9)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.link_meshes import LinkMeshArrays, ObjectMesh, mesh_of
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose
from clench.kernels.toi.passing_planes import COLUMNS, PLANES
from clench.kernels.toi.toi_translation import PAIRS, first_contact
from clench.kernels.trees.bvh import Ints as Stack


class Placed(NamedTuple):
    """Find the stops of hands that approach, for N proposals.

    Args:
        travel: distance that each hand may go past its place before it touches anything [m], shape (N,). It is below 0
            if the hand is stopped before its place, and any such number if it is stopped by more than `short`; it is
            `ahead` if nothing stops the hand.
        body: the body that it touches first there, as numbered by the object's tree, -1 for none, shape (N,).
        link: mesh of the hand that touches, -1 for none, shape (N,).
    """

    travel: Floats
    body: Ints
    link: Ints


@entry_kernel(allocates=True)
def bring_up(
    meshes: LinkMeshArrays,
    poses: Floats,
    shape: Ints,
    T_object_palm: Floats,
    normal: Floats,
    solid: ObjectMesh,
    ball: Floats,
    ahead: Floats,
    short: float,
    out: Placed,
) -> None:
    """Write where hands stop that come in along their palms' normals, from outside the ball around everything.

    Args:
        meshes: of the hand's links. poses: `T_palm_link` of every link at every preshape, (K, L, 3, 4).
        shape: which preshape each proposal has, (N,). T_object_palm: places of the palm, (N, 3, 4).
        normal: of the palm in its own frame, (3,). solid: the object with its obstacles.
        ball: centre and radius of a ball around all of `solid` [m], (4,).
        ahead: how far past its place each hand is followed [m], 0 or more, (N,).
        short: a hand that is stopped farther than this before its place is not followed any more [m].
    """
    count = meshes.link.shape[0]
    T, keys, order = np.empty((count, 3, 4)), np.empty(count), np.empty(count, dtype=np.int64)
    stack, along = np.empty((PAIRS, 2), dtype=np.int32), np.empty(3)
    planes = np.empty((PLANES, COLUMNS))
    for n in range(len(shape)):
        put_direction(T_object_palm[n], normal, along)
        foremost = -np.inf
        for k in range(count):
            compose(T_object_palm[n], poses[shape[n], meshes.link[k]], T[k])
            keys[k] = _reach(T[k], meshes.center[k], along) + meshes.radius[k]
            foremost = max(foremost, keys[k])
            _put(order, keys, k)
        middle = ball[0] * along[0] + ball[1] * along[1] + ball[2] * along[2]
        # Nothing is nearer than the ball: all links start behind it.
        back = max(foremost - (middle - ball[3]), 0.0)
        best, body, link = back + ahead[n], -1, -1
        for i in range(count):
            k = order[i]
            for r in range(3):
                T[k, r, 3] -= back * along[r]
            distance, touched = _meet(meshes, k, T[k], solid, along, best, stack, planes)
            if touched >= 0:
                best, body, link = distance, touched, k
            if best < back - short:
                break
        out.travel[n], out.body[n], out.link[n] = best - back, body, link


@kernel
def put_direction(T: Floats, direction: Floats, out: Floats) -> None:
    """Write a direction turned by a pose, (3,)."""
    for r in range(3):
        out[r] = T[r, 0] * direction[0] + T[r, 1] * direction[1] + T[r, 2] * direction[2]


@kernel
def _meet(
    meshes: LinkMeshArrays,
    k: int,
    T: Floats,
    solid: ObjectMesh,
    along: Floats,
    limit: float,
    stack: Stack,
    planes: Floats,
) -> tuple[float, int]:
    """Return how far a link moves until it touches, and which body, or -1."""
    owners = meshes.owners[meshes.triangle_first[k] : meshes.triangle_first[k + 1]]
    distance, _, triangle = first_contact(
        mesh_of(meshes, k), owners, T, solid.tree, solid.owners, along, limit, stack, planes
    )
    if triangle < 0:
        return np.inf, -1
    return distance, solid.tree.body[triangle]


@kernel
def _reach(T: Floats, point: Floats, along: Floats) -> float:
    """Return how far along a direction a point of a placed link lies [m]."""
    reach = 0.0
    for r in range(3):
        reach += along[r] * (T[r, 0] * point[0] + T[r, 1] * point[1] + T[r, 2] * point[2] + T[r, 3])
    return reach


@kernel
def _put(order: Ints, keys: Floats, k: int) -> None:
    """Put mesh k into the order of the meshes before it, those that reach farthest first."""
    i = k
    while i > 0 and keys[order[i - 1]] < keys[k]:
        order[i] = order[i - 1]
        i -= 1
    order[i] = k
