"""Close the chosen candidates with other fingers in their way: in turn, or all at once (docs/method.md section 5)."""

from __future__ import annotations

from clench.kernels.closing.bundles import among
from clench.kernels.closing.in_turn import close_in_turn
from clench.kernels.closing.layout import ClosingArrays, Floats
from clench.kernels.closing.solve_layout import Closed, ProblemArrays, Workspace
from clench.kernels.meetings.at_once import close_at_once
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_sections import cut_first_axis_groups, needs_planes


@kernel(allocates=True)
def close_with_others(
    problem: ProblemArrays,
    T_palm_object: Floats,
    space: Workspace,
    final: ClosingArrays,
    found: Closed,
    n: int,
    fresh: bool,
) -> int:
    """Close the picked candidates with the other fingers in their way, at pose `n`.

    Args:
        final: answers of the picked candidates, which are overwritten. found: written. fresh: the arenas hold the
            sections of another pose.

    Returns:
        the capacity of the arenas that is wanted, or 0.
    """
    command, target = problem.command, problem.target
    for f in range(final.contacts.shape[0]):
        found.anew[n, f], found.overlapping[n, f] = 0, 0
    found.met.size[n, 0] = 0
    if command.alone:
        return 0
    if fresh and needs_planes(space.picked):
        shared, pose = space.arena.shared, space.work.pose
        overflow = cut_first_axis_groups(problem.hand, target.tree, target.rounds, T_palm_object, shared, pose)
        if overflow > 0:
            return int(overflow)
    if not command.together:
        return int(close_in_turn(problem, T_palm_object, space, final, found.blocked[n], found.anew[n]))
    own = problem.full_width
    everything = among(own, space.swept, target.bodies, own.link_pose, own.checked)
    chosen = space.rows[: put_swept(space)]
    return int(close_at_once(problem, everything, T_palm_object, space, chosen, final, found, n))


@kernel
def put_swept(space: Workspace) -> int:
    """Write the fingers that are swept over the full width to `space.rows`; return how many there are."""
    count = 0
    for f in range(space.swept.shape[0]):
        if space.swept[f]:
            space.rows[count] = f
            count += 1
    return count
