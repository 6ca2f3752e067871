"""Whether fingers overlap the object before anything moves (docs/method.md section 3, *overlap at the start*)."""

from __future__ import annotations

from clench.core.tolerances import ALLOWED_PENETRATION
from clench.kernels.geometry.link_meshes import depth_of, has_contained, may_hold_part
from clench.kernels.grid.grid_bound import AWAY, is_box_off
from clench.kernels.hulls.near_elements import list_touching
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import compose_inverse, copy_pose

from .layout import Floats, Ints
from .solve_layout import ProblemArrays, Workspace

#: No link overlaps, as far as planes do not tell; one does that closing does not move; one of all of them.
FREE, RESTING_LINK, ANY_LINK = 0, 1, 2
#: From here on: this plus a link that planes, or sweeps, say overlaps.
CROSSED = 3
#: Two polyhedra of the same round link differ by less than this share of the ball around it [-].
DIFFER = 1e-4


@kernel
def any_deep(problem: ProblemArrays, wanted: Ints, poses: Floats, T_palm_object: Floats, space: Workspace) -> bool:
    """Say whether a link that is wanted overlaps the object by more than is allowed.

    Args:
        wanted: which of the links' meshes are, (M,). poses: `T_palm_link` of every link, (L, 3, 4).
        T_palm_object: where the object is, (3, 4). space: scratch space.
    """
    meshes = problem.meshes
    for k in range(meshes.link.shape[0]):
        T = poses[meshes.link[k]]
        if wanted[k] and not is_off(problem, k, T, T_palm_object, space):
            # How much deeper does not matter.
            limit = 2.0 * ALLOWED_PENETRATION
            if depth_of(meshes, k, T, problem.mesh, T_palm_object, limit, space.depth)[0] > ALLOWED_PENETRATION:
                return True
    return False


@kernel
def is_off(problem: ProblemArrays, k: int, T_palm_link: Floats, T_palm_object: Floats, space: Workspace) -> bool:
    """Say whether the surfaces of a link and of the object are seen to lie apart, and neither inside of the other.

    The object's grid tells, or planes around the hulls of the link. A surface can get into an open mesh without
    crossing it, so an open object is not asked about. What gets into an open link crosses its hull.
    """
    meshes, solid, T = problem.meshes, problem.mesh, space.depth.poses[0]
    n, tree = meshes.node_first[k], meshes.tree
    if not solid.closed or n == meshes.node_first[k + 1]:
        return False
    low = tree.low[n, 0], tree.low[n, 1], tree.low[n, 2]
    high = tree.high[n, 0], tree.high[n, 1], tree.high[n, 2]
    middle = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])
    half = 0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1]), 0.5 * (high[2] - low[2])
    compose_inverse(T_palm_object, T_palm_link, T)
    off = meshes.closed[k] != 0 and is_box_off(problem.target.bodies, middle, half, T, space.depth.pairs)
    if not (off or are_hulls_off(problem, k, T_palm_link, T_palm_object, space)):
        return False
    return not has_contained(meshes, k, T, solid, space.depth.points[0])


@kernel
def are_hulls_off(problem: ProblemArrays, k: int, T_palm_link: Floats, T_palm_object: Floats, space: Workspace) -> bool:
    """Say whether planes keep all hulls of a link off the surface of the object; not if the link has none."""
    bodies, links, m, sweep = problem.target.bodies, problem.full_width.links, problem.meshes.link[k], space.sweep
    if links.root[m] < 0:
        return False
    copy_pose(T_palm_link, sweep.moving)
    copy_pose(T_palm_object, sweep.resting)
    # An object without a grid has few elements, which are its shapes or lie in them.
    near = DIFFER * problem.meshes.radius[k]
    if bodies.grid.square.shape[0] > 0:
        near += AWAY * bodies.grid.place[3]
    return bool(list_touching(links, m, bodies, 0, near, sweep) == 0)


@kernel
def start_overlap(problem: ProblemArrays, finger_posture: int, T_palm_object: Floats, space: Workspace) -> int:
    """Return whether links of a finger that the planes do not tell of overlap the object; see the codes above.

    Links that closing moves are judged on the planes; those that only the posture moves lie on none, and a part of the
    object inside a link may lie between them. Where links close over their full width, all of them are looked at: there
    may be no planes.
    """
    command, poses = problem.command, problem.full_width.link_pose[finger_posture]
    around = command.full_width or may_hold_part(problem.meshes, poses, problem.mesh, T_palm_object, space.depth.points)
    wanted = command.own[finger_posture] if around else command.resting[finger_posture]
    if not any_deep(problem, wanted, poses, T_palm_object, space):
        return FREE
    return ANY_LINK if around else RESTING_LINK
