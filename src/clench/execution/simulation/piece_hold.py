"""Grasps of meshes that are not convex: the simulation collides convex pieces, and the command is solved on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

from clench.core.exceptions import MotionError
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

#: What is said of a grasp on the pieces.
ON_PIECES: Final = "the grasp solved again on the object's convex pieces"
#: What is said if the command has no grasp on the pieces.
NO_GRASP_ON_PIECES: Final = (
    "The simulation collides convex pieces, which lie a little off the mesh. The command has no grasp on them, so the "
    "grasp of the solution was executed."
)


@dataclass(frozen=True, eq=False)
class CollidedGrasp:
    """Name what the simulation carries out: a solution, the object at its pose, and the motion of the hand."""

    solution: GraspSolution
    obj: GraspObject
    trajectory: Trajectory


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
    collided = as_collided(obj, show)
    if collided is None:
        return hold_and_pull(solution, hand, obj, hold, trajectory, **options)
    again = solve_on_pieces(solution, hand, collided, trajectory)
    if again is None:
        report = hold_and_pull(solution, hand, obj, hold, trajectory, **options)
        return replace(report, reason=f"{report.reason} {NO_GRASP_ON_PIECES}")
    drive = options.get("drive", Drive.SERVO)
    given = hold_and_pull(solution, hand, obj, hold, trajectory, show_progress=show, drive=drive)
    report = hold_and_pull(again.solution, hand, collided, hold, again.trajectory, **options)
    return replace(report, reason=_on_pieces(report), as_given=given)


def notes_on_given(touch: str, held: HoldReport | None) -> tuple[str, ...]:
    """Return a sentence for each result of the grasp of the solution itself, if another grasp was executed.

    Args:
        touch: why the touch of the solution was not reached, empty if it was. held: the hold test, None without one.
    """
    notes = [f"First, the simulation executed the grasp of the solution itself. {touch}"] if touch else []
    if held is not None and held.as_given is not None:
        notes.append(f"The hold test also executed the grasp of the solution itself. {held.as_given.reason}")
    return tuple(notes)


def _on_pieces(report: HoldReport) -> str:
    """Return the reason of a hold test on the pieces: what was executed, and what came of it."""
    if not report.pulls:
        return f"{report.reason} This is about {ON_PIECES}."
    return f"The hold test executed {ON_PIECES}: {report.reason[:1].lower()}{report.reason[1:]}"


def solve_on_pieces(
    solution: GraspSolution, hand: Hand, collided: GraspObject, trajectory: Trajectory
) -> CollidedGrasp | None:
    """Solve the command of a solution again on convex pieces, and plan its motion at the speed of a trajectory.

    Args:
        solution: on the mesh. hand: the hand. collided: the object, see `as_collided`. trajectory: of the solution.

    Returns:
        the grasp on the pieces, with the next steps of the solution; None if the command has no grasp there, or the
            grasp has no free path.
    """
    again = solve(hand, collided, command_of(solution, hand))
    if again.status is not SolutionStatus.GRASP:
        return None
    again = replace(again, next_steps=solution.next_steps)
    try:
        way = plan_trajectory(again, hand, obj=collided, speed=trajectory.speed, acceleration=trajectory.acceleration)
    except MotionError:
        return None
    return CollidedGrasp(again, collided, way)


def as_collided(obj: GraspObject, show_progress: bool) -> GraspObject | None:
    """Return the object in the pieces that the simulation collides; None if these are its own shapes."""
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
