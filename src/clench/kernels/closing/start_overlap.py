"""Whether fingers overlap the object before anything moves (docs/method.md section 3, *overlap at the start*)."""

from __future__ import annotations

from clench.core.tolerances import ALLOWED_PENETRATION
from clench.kernels.geometry.link_meshes import DepthWork, LinkMeshArrays, ObjectMesh, depth_of, may_hold_part
from clench.kernels.runtime.compiling import kernel

from .layout import Floats, Ints

#: No link overlaps, as far as planes do not tell; one does that closing does not move; one of all of them.
FREE, RESTING_LINK, ANY_LINK = 0, 1, 2
#: From here on: this plus a link that planes, or sweeps, say overlaps.
CROSSED = 3


@kernel
def any_deep(
    meshes: LinkMeshArrays, wanted: Ints, poses: Floats, solid: ObjectMesh, T_palm_object: Floats, work: DepthWork
) -> bool:
    """Say whether a link that is wanted overlaps the object by more than is allowed."""
    for k in range(meshes.link.shape[0]):
        if wanted[k]:
            # How much deeper does not matter.
            limit = 2.0 * ALLOWED_PENETRATION
            depth = depth_of(meshes, k, poses[meshes.link[k]], solid, T_palm_object, limit, work)[0]
            if depth > ALLOWED_PENETRATION:
                return True
    return False


@kernel
def start_overlap(
    link_pose: Floats,
    meshes: LinkMeshArrays,
    own: Ints,
    resting: Ints,
    solid: ObjectMesh,
    T_palm_object: Floats,
    full_width: bool,
    work: DepthWork,
) -> int:
    """Return whether links of a finger that the planes do not tell of overlap the object; see the codes above.

    Links that closing moves are judged on the planes; those that only the posture moves lie on none, and a part of the
    object inside a link may lie between them.

    Args:
        link_pose: see `FullWidthArrays`. meshes: of the links. own, resting: which are the finger's, and which of those
            closing does not move, (M,). solid: the object. T_palm_object: where it is, (3, 4).
        full_width: links close over their full width, and all of them are looked at: there may be no planes.
        work: scratch space.
    """
    around = full_width or may_hold_part(meshes, link_pose, solid, T_palm_object, work.points)
    if not any_deep(meshes, own if around else resting, link_pose, solid, T_palm_object, work):
        return FREE
    return ANY_LINK if around else RESTING_LINK
