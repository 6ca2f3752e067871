"""Execute a solution on any actuator of a hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from clench.closing.collision.packed_object import hash_bodies, hash_hand
from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, MotionError, UnknownNameError
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.obstacles import TABLE
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

from .execution_report import ExecutionReport
from .trajectory import Trajectory, plan_trajectory
from .trajectory_checks import ROUNDING


class Executor(Protocol):
    """Move a hand along a trajectory and report the reached state."""

    @property
    def name(self) -> str:
        """Name of the actuator, for reports."""

    @property
    def hand(self) -> Hand:
        """The hand that it moves."""

    @property
    def obj(self) -> GraspObject | None:
        """The object that it closes on; None when it knows of none."""

    def execute(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Open the hand, follow the trajectory to the touch, and compare with the solution."""


def execute(
    solution: GraspSolution, actuator: Executor, *, speed: float = 1.0, force: bool = False, next_steps: bool = True
) -> ExecutionReport:
    """Execute a solution: open the hand, close it along a planned path, and go to the next steps.

    clench does not execute an invalid solution, or a solution without a free path. It checks every link against every
    other link, the object and obstacles along the whole motion, see `plan_trajectory`. The report says why clench
    refused a solution.

    Args:
        solution: the solution to execute.
        actuator: the hand that moves, e.g. `SimulatedHand`.
        speed: fraction of the joints' velocity limits to use, above 0 and up to 1.
        force: execute such a solution all the same. A `HardwareHand` still refuses a path that is not free.
        next_steps: go to the next steps of the solution after the touch, and after the squeeze if there is one.

    Raises:
        CommandError: the solution is for another hand or another geometry of hand or object, `speed` is out of range,
            or the pregrasp or a next step is outside a joint's limits.
        UnknownNameError: its pregrasp, squeeze or a next step is of a joint that the hand does not have.
    """
    check_type(solution, GraspSolution, "solution")
    if not hasattr(actuator, "execute"):
        given = type(actuator).__name__
        raise CommandError(
            f"actuator: expected what moves a hand, such as clench.SimulatedHand(hand, obj), got {given}."
        )
    if not next_steps:
        solution = replace(solution, next_steps=())
    if solution.hand != actuator.hand.name:
        raise CommandError(f"The solution is for hand '{solution.hand}', the actuator moves '{actuator.hand.name}'.")
    check_geometry(solution, actuator.hand, actuator.obj)
    check_angles(solution, actuator.hand)
    try:
        trajectory = plan_trajectory(solution, actuator.hand, obj=actuator.obj, speed=speed, force=force)
        why = None
    except MotionError as error:
        why = str(error)
    if not (force or solution.is_valid()):
        found = solution.violations()
        why = found[0] if found else f"its status is '{solution.status.value}'"
    if why is not None:
        return ExecutionReport(actuator.name, success=False, reason=f"Not carried out: {why.rstrip('.')}.")
    report = actuator.execute(solution, trajectory)
    return replace(report, notes=(*report.notes, *trajectory.notes))


def check_geometry(solution: GraspSolution, hand: Hand, obj: GraspObject | None) -> None:
    """Check that a solution was computed for exactly this geometry of hand and object.

    Args:
        solution: its `geometry_hash` is compared. hand: the hand. obj: the object, None when it is not known.

    Raises:
        CommandError: it was computed for another one.
    """
    source = CollisionSource(solution.collision_source)
    for_hand, _, for_object = solution.geometry_hash.partition("+")
    if for_hand != hash_hand(hand, source):
        raise CommandError(
            f"geometry_hash: the solution was computed for another geometry of hand '{hand.name}'; load the hand from "
            f"the same model, with the same hand file and palm, or solve again."
        )
    if obj is not None and for_object != hash_bodies(obj.bodies, CollisionSource(obj.collision_source)):
        raise CommandError(
            f"geometry_hash: the solution was computed for another geometry of object '{obj.name}'; load the object "
            f"from the same model, with the same scale and obstacles{_obstacles_told(solution, obj)}, or solve again."
        )


def missing_obstacles(solution: GraspSolution, obj: GraspObject) -> str:
    """Return the options that would add the obstacles of a solution that an object lacks; empty if it has all."""
    missing = [name for name in solution.obstacles if name not in obj.obstacles]
    named = ", ".join(f"'{name}'" for name in missing)
    options = dict.fromkeys("--table HEIGHT" if name == TABLE else "--obstacle SHAPE@x,y,z" for name in missing)
    many = "s" if len(missing) > 1 else ""
    return f"with obstacle{many} {named}: add {' and '.join(options)}" if missing else ""


def _obstacles_told(solution: GraspSolution, obj: GraspObject) -> str:
    """Return what is known of the obstacles that a solution was computed with, in brackets."""
    missing = missing_obstacles(solution, obj)
    if missing:
        return f" (it was computed {missing})"
    return " (--scale, --table, --obstacle)"


def check_angles(solution: GraspSolution, hand: Hand | None) -> None:
    """Check the joints and limits of a solution's pregrasp, and the joints of its squeeze's offsets.

    Args:
        solution: may come from a file that was edited. hand: the model; None: the solution tells the limits itself.

    Raises:
        CommandError: an angle is outside its limits. UnknownNameError: a joint that the hand does not have.
    """
    limits = dict(solution.joint_limits) if hand is None else {j.name: (j.lower, j.upper) for j in hand.joints}
    joints = tuple(solution.joint_angles if hand is None else hand.joint_names)
    named = {"pregrasp": solution.pregrasp or {}, "squeeze.offsets": (solution.squeeze or {}).get("offsets") or {}}
    for key, angles in named.items():
        for name in angles:
            if name not in joints:
                raise UnknownNameError("joint", name, f"hand '{solution.hand}' ({key} of the solution)", joints)
    for name, angle in named["pregrasp"].items():
        low, high = limits.get(name, (-np.inf, np.inf))
        margin = ROUNDING * (high - low)
        # Written so that NaN fails.
        if not low - margin <= angle <= high + margin:
            raise CommandError(
                f"pregrasp.{name}: {angle:.6g} rad is outside the joint's limits [{low:.6g}, {high:.6g}] rad."
            )
