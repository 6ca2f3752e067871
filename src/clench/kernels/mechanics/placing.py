"""Bring open hands up to an object along their palms' normals: where each one stops (docs/method.md section 9)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.link_meshes import LinkMeshArrays, ObjectMesh, mesh_of
from clench.kernels.hulls.enclosing_hulls import HullArrays
from clench.kernels.hulls.hull_cast import Cast, CastWork, cast_hull, make_cast_work
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose, put_point
from clench.kernels.toi.passing_planes import COLUMNS as PLANE
from clench.kernels.toi.passing_planes import PLANES
from clench.kernels.toi.toi_translation import PAIRS, first_contact
from clench.kernels.trees.bvh import Ints as Stack

from .approach_order import COLUMNS, follow_links, next_link


class Placed(NamedTuple):
    """Find the stops of hands that approach, for N proposals.

    Args:
        travel: distance that each hand may go past its place before it touches anything [m], shape (N,). It is below 0
            if the hand is stopped before its place. If it is below `-short`, the hand may be stopped even earlier. It
            is `ahead` if nothing stops the hand.
        body: the body that it touches first there, as numbered by the object's tree, -1 for none, shape (N,).
    """

    travel: Floats
    body: Ints


class ApproachWork(NamedTuple):
    """Scratch space for hands of M links that approach.

    Args:
        T: poses of the links where the motion begins, in the object's frame, (M, 3, 4). along: its direction, (3,).
        balls: see `follow_links`. cast: see `cast_hull`; its stack serves `next_link`.
        stack, planes: see `first_contact`.
    """

    T: Floats
    along: Floats
    balls: Floats
    cast: CastWork
    stack: Stack
    planes: Floats


@kernel(allocates=True)
def make_approach_work(links: int) -> ApproachWork:
    """Allocate the scratch space for hands of so many links."""
    return ApproachWork(
        np.empty((links, 3, 4)),
        np.empty(3),
        np.empty((links, COLUMNS)),
        make_cast_work(),
        np.empty((PAIRS, 2), dtype=np.int32),
        np.empty((PLANES, PLANE)),
    )


class Target(NamedTuple):
    """Describe what hands approach: the object with its obstacles.

    Args:
        mesh: its surface. body: the same as one body, which may have a grid. owner: which body of the object each
            element of `body` is of, (T,).
        ball: centre and radius of a ball around all of it [m], (4,).
    """

    mesh: ObjectMesh
    body: BodyArrays
    owner: NDArray[np.int32]
    ball: Floats


@entry_kernel(allocates=True)
def bring_up(
    meshes: LinkMeshArrays,
    hulls: HullArrays,
    poses: Floats,
    shape: Ints,
    T_object_palm: Floats,
    normal: Floats,
    target: Target,
    ahead: Floats,
    short: float,
    out: Placed,
) -> None:
    """Write where hands stop that come in along their palms' normals, from outside the ball around everything.

    Links are swept in the order in which they may touch, as balls around them and the object's grid tell.

    Args:
        meshes: of the hand's links. hulls: of the links.
        poses: `T_palm_link` of every link at every preshape, (K, L, 3, 4).
        shape: which preshape each proposal has, (N,). T_object_palm: places of the palm, (N, 3, 4).
        normal: of the palm in its own frame, (3,). target: what they approach.
        ahead: how far past its place each hand is followed [m], 0 or more, (N,).
        short: a hand that is stopped farther than this before its place is not followed any more [m].
    """
    count, work = meshes.link.shape[0], make_approach_work(meshes.link.shape[0])
    T, along, balls = work.T, work.along, work.balls
    for n in range(len(shape)):
        put_direction(T_object_palm[n], normal, along)
        foremost = -np.inf
        for k in range(count):
            compose(T_object_palm[n], poses[shape[n], meshes.link[k]], T[k])
            put_point(T[k], meshes.center[k], balls[k])
            foremost = max(foremost, reach(balls[k], along) + meshes.radius[k])
        # Nothing is nearer than the ball: all links start behind it.
        back = max(foremost - (reach(target.ball, along) - target.ball[3]), 0.0)
        for k in range(count):
            for r in range(3):
                T[k, r, 3] -= back * along[r]
        best, body = back + ahead[n], -1
        follow_links(meshes, T, along, target.ball, balls)
        while best >= back - short:
            k, start = next_link(target.body, along, best, balls, work.cast.stack)
            if k < 0:
                break
            distance, touched = meet(meshes, hulls, k, target, (start, best), work)
            if touched >= 0:
                best, body = distance, touched
        out.travel[n], out.body[n] = best - back, body


@kernel
def put_direction(T: Floats, direction: Floats, out: Floats) -> None:
    """Write a direction turned by a pose, (3,)."""
    for r in range(3):
        out[r] = T[r, 0] * direction[0] + T[r, 1] * direction[1] + T[r, 2] * direction[2]


@kernel
def meet(
    meshes: LinkMeshArrays,
    hulls: HullArrays,
    k: int,
    target: Target,
    span: tuple[float, float],
    work: ApproachWork,
) -> tuple[float, int]:
    """Return how far a link moves until it touches, and which body, or -1.

    Its hulls tell. If they do not fill its shape, its triangles are looked at where the hulls touch.

    Args:
        k: mesh of the link. span: travels, the link touches nothing before the first one, and touches after the second
            one are of no interest [m].
    """
    start, best, element, full = span[0], span[1], -1, True
    first, last = hulls.body[meshes.link[k]], hulls.body[meshes.link[k] + 1]
    for hull in range(first, last):
        cast = Cast(hulls, hull, work.T[k], work.along, start)
        distance, touched = cast_hull(cast, target.body, best, work.cast)
        full = full and hulls.convex[hull] != 0
        if touched >= 0:
            best, element = distance, touched
    if last > first and (full or element < 0):
        return best, target.owner[element] if element >= 0 else -1
    owners = meshes.owners[meshes.triangle_first[k] : meshes.triangle_first[k + 1]]
    mesh = target.mesh
    distance, _, triangle = first_contact(
        mesh_of(meshes, k), owners, work.T[k], mesh.tree, mesh.owners, work.along, span[1], work.stack, work.planes
    )
    return distance, mesh.tree.body[triangle] if triangle >= 0 else -1


@kernel
def reach(ball: Floats, along: Floats) -> float:
    """Return how far along a direction the middle of a ball lies [m]."""
    return float(along[0] * ball[0] + along[1] * ball[1] + along[2] * ball[2])
