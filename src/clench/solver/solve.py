"""Solve: from hand, object and command to one solution."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from clench.core.argument_types import check_type
from clench.core.pose import Pose
from clench.models.command import GraspCommand, as_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.posture_choice import PostureSolver, with_posture
from clench.solver.preshapes.postures import posture_options

from .clock import Clock
from .pose_solver import solve_posture
from .solution import GraspSolution

if TYPE_CHECKING:
    from clench.solver.analysis.record import Record


def solve(hand: Hand, obj: GraspObject, command: GraspCommand | Pose, *, record: Record | None = None) -> GraspSolution:
    """Close a hand around an object and return contacts and joint angles (docs/method.md).

    If the command leaves the posture to clench, it closes and compares the preshapes of the hand first. The solution's
    `choice` then names the chosen one and the reason (docs/preshapes.md). Otherwise there is one closing.

    Args:
        hand: see `Hand.load`. obj: see `GraspObject.load`.
        command: pose of the hand, preshape, and options; or the pose of the palm, `T_world_palm`.
        record: a store that the solution is appended to.

    Raises:
        ClenchError: a command that does not fit the hand, or a hand that no plane can close.
    """
    from clench.kernels.runtime.warming import warm_up

    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    command = as_command(command)
    warm_up()
    options = posture_options(hand, command)
    if options:
        clock = Clock()
        chosen, said = PostureSolver(hand, obj, command, options).choose_one()
        clock.lap("posture")
        solution = solve_posture(hand, obj, replace(command, preshape=chosen.angles))
        solution = with_posture(solution, said, clock.stages()["posture"])
    else:
        solution = solve_posture(hand, obj, command)
    if record is not None:
        record.append(solution)
    return solution
