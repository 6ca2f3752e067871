"""Whether fingers overlap the object before anything moves (docs/method.md section 3, *overlap at the start*)."""

from __future__ import annotations

from clench.core.tolerances import ALLOWED_PENETRATION
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.link_meshes import (
    DepthWork,
    LinkMeshArrays,
    ObjectMesh,
    depth_of,
    has_contained,
    may_hold_part,
)
from clench.kernels.grid.grid_bound import is_box_off
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import compose_inverse

from .layout import Floats, Ints

#: No link overlaps, as far as planes do not tell; one does that closing does not move; one of all of them.
FREE, RESTING_LINK, ANY_LINK = 0, 1, 2
#: From here on: this plus a link that planes, or sweeps, say overlaps.
CROSSED = 3


@kernel
def any_deep(
    meshes: LinkMeshArrays,
    wanted: Ints,
    poses: Floats,
    solid: ObjectMesh,
    bodies: BodyArrays,
    T_palm_object: Floats,
    work: DepthWork,
) -> bool:
    """Say whether a link that is wanted overlaps the object by more than is allowed.

    Args:
        bodies: the object as one body, whose grid tells that most links are far away. The rest as in `depth_of`.
    """
    for k in range(meshes.link.shape[0]):
        if wanted[k] and not is_off(meshes, k, poses[meshes.link[k]], solid, bodies, T_palm_object, work):
            # How much deeper does not matter.
            limit = 2.0 * ALLOWED_PENETRATION
            depth = depth_of(meshes, k, poses[meshes.link[k]], solid, T_palm_object, limit, work)[0]
            if depth > ALLOWED_PENETRATION:
                return True
    return False


@kernel
def is_off(
    meshes: LinkMeshArrays,
    k: int,
    T_palm_link: Floats,
    solid: ObjectMesh,
    bodies: BodyArrays,
    T_palm_object: Floats,
    work: DepthWork,
) -> bool:
    """Say whether the object's grid tells that the surfaces of a link and of the object lie apart, and neither inside.

    A surface can get into an open mesh without crossing it: then nothing is known.
    """
    n, tree, T = meshes.node_first[k], meshes.tree, work.poses[0]
    if not (solid.closed and meshes.closed[k] != 0) or n == meshes.node_first[k + 1]:
        return False
    low = tree.low[n, 0], tree.low[n, 1], tree.low[n, 2]
    high = tree.high[n, 0], tree.high[n, 1], tree.high[n, 2]
    middle = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])
    half = 0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1]), 0.5 * (high[2] - low[2])
    compose_inverse(T_palm_object, T_palm_link, T)
    if not is_box_off(bodies, middle, half, T, work.pairs):
        return False
    return not has_contained(meshes, k, T, solid, work.points[0])


@kernel
def start_overlap(
    link_pose: Floats,
    meshes: LinkMeshArrays,
    own: Ints,
    resting: Ints,
    solid: ObjectMesh,
    bodies: BodyArrays,
    T_palm_object: Floats,
    full_width: bool,
    work: DepthWork,
) -> int:
    """Return whether links of a finger that the planes do not tell of overlap the object; see the codes above.

    Links that closing moves are judged on the planes; those that only the posture moves lie on none, and a part of the
    object inside a link may lie between them.

    Args:
        link_pose: see `FullWidthArrays`. meshes: of the links. own, resting: which are the finger's, and which of those
            closing does not move, (M,). solid: the object; bodies: see `any_deep`. T_palm_object: where it is, (3, 4).
        full_width: links close over their full width, and all of them are looked at: there may be no planes.
        work: scratch space.
    """
    around = full_width or may_hold_part(meshes, link_pose, solid, T_palm_object, work.points)
    if not any_deep(meshes, own if around else resting, link_pose, solid, bodies, T_palm_object, work):
        return FREE
    return ANY_LINK if around else RESTING_LINK
