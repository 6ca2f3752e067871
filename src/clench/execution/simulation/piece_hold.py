"""The hold test of a mesh: the simulation collides convex pieces, so the grasp is solved again on them first."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource, ShapeKind
from clench.solver.solution import GraspSolution, SolutionStatus
from clench.solver.solve import solve

from .convex_pieces import in_pieces
from .hold import Hold, HoldReport
from .pulling import hold_and_pull
from .simulated_actuators import Drive


def hold_as_collided(
    solution: GraspSolution, hand: Hand, obj: GraspObject, hold: Hold, trajectory: Trajectory, **options: Any
) -> HoldReport:
    """Test a grasp on the shapes that the simulation collides.

    The simulation replaces a mesh that is not convex by convex pieces, a little off its surface. Fingers that touch the
    mesh press into a piece or miss it. There the same command is solved on the pieces first, and that grasp is tested.
    The original grasp is tested, too, and reported in `as_given`.

    Args:
        solution, hand, obj, hold, trajectory: see `hold_and_pull`. options: the others of `hold_and_pull`.

    Raises:
        HandError, ObjectError, CommandError: see `hold_and_pull`.
    """
    show = bool(options.get("show_progress", False))
    collided = _collided(obj, show)
    if collided is None:
        return hold_and_pull(solution, hand, obj, hold, trajectory, **options)
    again = solve(hand, collided, command_of(solution, hand))
    if again.status is not SolutionStatus.GRASP:
        report = hold_and_pull(solution, hand, obj, hold, trajectory, **options)
        note = "Solved again on the convex pieces that the simulation collides, it is no grasp: this is of the mesh's."
        return replace(report, reason=f"{report.reason} {note}")
    drive = options.get("drive", Drive.SERVO)
    given = hold_and_pull(solution, hand, obj, hold, trajectory, show_progress=show, drive=drive)
    way = plan_trajectory(again, hand, obj=collided)
    report = hold_and_pull(again, hand, collided, hold, way, **options)
    note = f"This is of the grasp solved again on the object's convex pieces; as given, it was: {given.reason}"
    return replace(report, reason=f"{report.reason} {note}", as_given=given)


def _collided(obj: GraspObject, show_progress: bool) -> GraspObject | None:
    """Return the object in the pieces that the simulation collides, None where these are its own shapes."""
    graspable = [body for body in obj.bodies if body.role is BodyRole.GRASPABLE]
    if not any(shape.kind is ShapeKind.MESH for body in graspable for shape in body.shapes):
        return None
    if obj.collision_source is CollisionSource.ENGINE:
        return None
    collided = in_pieces(obj, show_progress=show_progress)
    same = all(len(new.shapes) == len(old.shapes) for new, old in zip(collided.bodies, obj.bodies, strict=True))
    return None if same else collided


def command_of(solution: GraspSolution, hand: Hand) -> GraspCommand:
    """Return the command that a solution of a hand answers, over the full width, without its next steps."""
    followers = {coupling.follower for coupling in hand.couplings}
    free = [name for number, name in enumerate(hand.joint_names) if number not in followers]
    best = [finger.best for finger in solution.fingers.values()]
    order = next((candidate.order for candidate in best if candidate is not None), ClosingOrder.PROXIMAL_FIRST)
    return GraspCommand(
        solution.hand_pose,
        object_pose=solution.object_pose,
        preshape={name: solution.open_angles[name] for name in free},
        fingers=tuple(solution.fingers),
        order=ClosingOrder(order),
        rounds=solution.rounds,
        speeds=dict(solution.speeds),
        collision_source=CollisionSource(solution.collision_source),
    )
