"""Grasps on their way to another program's file: complete, in the frame that the file wants, with their confidence."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from clench.core.defaults import MASS
from clench.core.exceptions import CommandError
from clench.core.pose import Pose, invert
from clench.execution.executing import check_angles, check_geometry
from clench.execution.pregrasp import plan_pregrasp
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.piece_hold import hold_as_collided
from clench.execution.step_check import told_overlap
from clench.execution.trajectory import plan_trajectory
from clench.mechanics.grasp.contacts import DEFAULT_TORSION, ContactModel
from clench.models.hand.forward import base_pose
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.squeezing import plan_squeeze
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .grasp_posture import BASE

#: Confidences: the hold test held; a squeeze is feasible; neither.
HELD: Final = 1.0
FEASIBLE: Final = 0.5
NEITHER: Final = 0.0


@dataclass(frozen=True, eq=False)
class ExportSettings:
    """The content of an export; see `export_grasps`.

    Args:
        hand, obj: the hand and object that were solved for, None if missing.
        root: the link whose pose is written, or "world"; None: the palm. name: of the object; None: its own.
        hold: a test that every grasp goes through, None: none.
        mass, friction: for planning the squeeze, numbers or ranges [kg], [-]; None: values of the solution's squeeze,
            or of the test.
        stiffness: gain of the servos that will hold the postures [Nm/rad]; None: that of the hand's model.
    """

    hand: Hand | None = None
    obj: GraspObject | None = None
    root: str | None = None
    name: str | None = None
    hold: Hold | None = None
    mass: float | tuple[float, float] | None = None
    friction: float | tuple[float, float] | None = None
    stiffness: float | None = None


@dataclass(frozen=True, eq=False)
class OutgoingGrasp:
    """A grasp with everything that an export format writes.

    Args:
        solution: with all that could be planned. object_name: of the object.
        frame: the link whose pose is written. T_world_frame: its pose.
        pregrasp, squeezed: angles [rad] of the same joints as the solution's, by name.
        joints: joints that the frame carries, in the order of the hand's model.
        confidence: 1 held in the test; 0.5 with a feasible squeeze; 0 without one, dropped in the test, not valid, or
            without a free straight line from pregrasp to squeeze.
        notes: sentences about missing data.
    """

    solution: GraspSolution
    object_name: str
    frame: str
    T_world_frame: Pose
    pregrasp: Mapping[str, float]
    squeezed: Mapping[str, float]
    joints: tuple[str, ...]
    confidence: float
    notes: tuple[str, ...]

    @property
    def T_object_frame(self) -> Pose:
        """The frame in the object's frame."""
        return Pose.from_matrix(invert(self.solution.object_pose.matrix) @ self.T_world_frame.matrix)


def outgoing(solution: GraspSolution, settings: ExportSettings) -> OutgoingGrasp:
    """Complete a solution for a file: plan the missing parts, test it if asked, place the frame, name the gaps.

    Raises:
        CommandError: the solution is of another hand or object, its pregrasp is outside joints' limits, a root lacks
            the hand, or a test lacks the hand or the object.
        UnknownNameError: no such root link; the pregrasp or the squeeze is of a joint that the hand does not have.
    """
    hand, obj = settings.hand, settings.obj
    notes: list[str] = []
    held: bool | None = None
    if hand is not None:
        if solution.hand != hand.name:
            raise CommandError(f"The solution is for hand '{solution.hand}', not for '{hand.name}'.")
        check_geometry(solution, hand, obj)
    check_angles(solution, hand)
    if hand is not None and obj is not None:
        obj = obj.posed(solution.object_pose)
        solution = _completed(solution, hand, obj, settings)
        if settings.hold is not None:
            trajectory = plan_trajectory(solution, hand, obj=obj, force=True)
            report = hold_as_collided(solution, hand, obj, settings.hold, trajectory)
            held = report.held
            notes += [] if held else [f"The hold test: {report.reason}"]
    elif settings.hold is not None:
        raise CommandError("hold: a hold test needs the hand and the object.")
    frame, T_world_frame, joints, unplaced = _frame(solution, hand, settings.root)
    missing = () if hand is not None and obj is not None else _missing(solution)
    squeezed, unpressed = _squeezed(solution, hand, settings.stiffness)
    before = before_the_grasp(solution)
    driven_in = None if hand is None else told_overlap(solution, hand, obj, before, squeezed)
    driven = () if driven_in is None else (driven_in,)
    return OutgoingGrasp(
        solution,
        settings.name or solution.object,
        frame,
        T_world_frame,
        before,
        squeezed,
        joints,
        NEITHER if driven else _confidence(solution, held),
        (*notes, *_doubts(solution), *driven, *unplaced, *missing, *unpressed),
    )


def before_the_grasp(solution: GraspSolution) -> Mapping[str, float]:
    """Return the angles of the pregrasp [rad], else of the open hand from which the fingers close.

    Raises:
        CommandError: a joint of the grasp is missing there.
    """
    key, before = ("pregrasp", solution.pregrasp) if solution.pregrasp else ("open_angles", solution.open_angles)
    missing = next((name for name in solution.joint_angles if name not in before), None)
    if missing is not None:
        raise CommandError(f"{key}.{missing}: missing; every joint of joint_angles is needed.")
    return before


def _completed(solution: GraspSolution, hand: Hand, obj: GraspObject, settings: ExportSettings) -> GraspSolution:
    """Return a solution with a pregrasp and a squeeze.

    The squeeze is for every direction of gravity, because files do not say where down is.
    """
    if solution.pregrasp is None and solution.rounds == 1:
        solution = replace(solution, pregrasp=plan_pregrasp(solution, hand, obj=obj))
    planned: Mapping[str, Any] = solution.squeeze or {}
    given = settings.hold, settings.mass, settings.friction
    if given == (None, None, None) and planned.get("any_direction"):
        return solution
    mass: Any
    friction: Any
    if settings.hold is not None:
        mass, friction = settings.hold.planned_for
        model, torsion = settings.hold.contact_model, settings.hold.torsion
    else:
        mass = tuple(planned.get("mass_range") or ()) or planned.get("mass", MASS)
        friction = planned.get("friction") or None
        model, torsion = planned.get("contact_model", ContactModel.POINT), DEFAULT_TORSION
    plan = plan_squeeze(
        solution,
        hand,
        obj,
        mass=mass if settings.mass is None else settings.mass,
        gravity=None,
        friction=friction if settings.friction is None else settings.friction,
        contact_model=model,
        torsion=torsion,
    )
    return replace(solution, squeeze=plan.to_dict())


def _frame(
    solution: GraspSolution, hand: Hand | None, root: str | None
) -> tuple[str, Pose, tuple[str, ...], tuple[str, ...]]:
    """Return the frame's name and pose, the joints that it carries, and notes about it."""
    if hand is None:
        if root is not None:
            raise CommandError(f"root: the pose of '{root}' cannot be told without the hand.")
        note = "The pose is that of the palm, named like the hand: give the hand for the palm's name or another root."
        return solution.hand, solution.hand_pose, tuple(solution.joint_angles), (note,)
    q = posture(solution.joint_angles, hand, "joint_angles")
    if root == BASE and BASE not in [link.name for link in hand.links]:
        T_world_base = Pose.from_matrix(solution.hand_pose.matrix @ base_pose(hand, q))
        return BASE, T_world_base, hand.joint_names, ()
    link = hand.palm if root is None else hand.link_index(root)
    T_world_link = solution.hand_pose
    if link != hand.palm:
        T_world_link = Pose.from_matrix(solution.hand_pose.matrix @ hand.link_poses(q)[link])
    below = {link}
    for number, each in enumerate(hand.links):
        if each.parent in below:
            below.add(number)
    carried = {hand.links[k].joint for k in below - {link}}
    joints = tuple(name for number, name in enumerate(hand.joint_names) if number in carried)
    return hand.links[link].name, T_world_link, joints, ()


def _missing(solution: GraspSolution) -> tuple[str, ...]:
    notes = []
    if solution.pregrasp is None:
        notes.append("No pregrasp is planned: the open hand stands for it.")
    if solution.squeeze is None:
        notes.append("No squeeze is planned: the grasp itself stands for it, and nothing presses.")
    return tuple(f"{note} Give hand and object, or complete the solution." for note in notes)


def _squeezed(
    solution: GraspSolution, hand: Hand | None, stiffness: float | None
) -> tuple[Mapping[str, float], tuple[str, ...]]:
    """Return the squeezing targets of position servos [rad], and a sentence about joints without one."""
    plan = solution.squeeze or {}
    offsets, torques = dict(plan.get("offsets") or {}), dict(plan.get("torques") or {})
    if stiffness is not None:
        if hand is None:
            raise CommandError("stiffness: offsets for other servos cannot be told without the hand.")
        offsets = _offsets(solution, hand, torques, stiffness)
    silent = [name for name, torque in torques.items() if torque and name not in offsets]
    angles = {name: angle + float(offsets.get(name, 0.0)) for name, angle in solution.joint_angles.items()}
    notes = [*_beyond(solution, angles)]
    if not silent:
        return angles, tuple(notes)
    first = silent[:3] if len(silent) > 4 else silent
    named = ", ".join(f"'{name}'" for name in first)
    more = f" and {len(silent) - len(first)} more joints" if len(silent) > len(first) else ""
    note = f"The model gives no servo gain of {named}{more}: they are not told to squeeze."
    return angles, (*notes, f"{note} Give the stiffness of the servos (--stiffness, stiffness=).")


def _beyond(solution: GraspSolution, angles: Mapping[str, float]) -> Iterator[str]:
    """Yield a sentence where postures of the squeeze are beyond limits by more than the joint's whole range."""
    for name, (low, high) in solution.joint_limits.items():
        if name in angles and not 2.0 * low - high <= angles[name] <= 2.0 * high - low:
            yield "The servos are soft: to squeeze, joints are told angles far beyond their limits. Servos may refuse."
            return


def _offsets(solution: GraspSolution, hand: Hand, torques: Mapping[str, float], stiffness: float) -> dict[str, float]:
    """Return the offsets for servos of one gain at every joint or tendon [rad]."""
    from clench.mechanics.grasp.jacobian import degrees_of_freedom

    if not stiffness > 0.0:
        raise CommandError(f"stiffness: expected a number above 0 Nm/rad, got {stiffness!r}.")
    dofs = degrees_of_freedom(hand, posture(solution.joint_angles, hand, "joint_angles"))
    found: dict[str, float] = {}
    for d, (name, leader) in enumerate(zip(dofs.names, dofs.joints, strict=True)):
        gain = stiffness * hand.joints[leader].servo_share
        for j in dofs.motion[:, d].nonzero()[0] if name in torques else ():
            found[hand.joints[j].name] = float(dofs.motion[j, d] * torques[name] / gain)
    return found


def _doubts(solution: GraspSolution) -> Iterator[str]:
    """Yield the defects of a solution whose confidence is 0 without any test."""
    if not solution.is_valid():
        why = next(iter(solution.violations()), f"its status is '{solution.status.value}'")
        yield f"The solution is not valid: {why.rstrip('.')}."
    if solution.squeeze is not None and not solution.squeeze.get("feasible"):
        yield str(solution.squeeze.get("text") or "The solution's squeeze plan is not feasible.")


def _confidence(solution: GraspSolution, held: bool | None) -> float:
    if not solution.is_valid() or held is False:
        return NEITHER
    if held:
        return HELD
    return FEASIBLE if (solution.squeeze or {}).get("feasible") else NEITHER


def first_other(solutions: Sequence[GraspSolution]) -> int | None:
    """Return the index of the first solution that is of another hand or object than the first, None without one."""
    of = [(s.hand, s.object, os.path.realpath(s.object_model), s.object_scale) for s in solutions]
    return next((i for i, each in enumerate(of) if each != of[0]), None)


def all_of_one(solutions: Sequence[GraspSolution], format: str) -> None:
    """Refuse solutions of several hands or objects in one file.

    Raises:
        CommandError: there are several.
    """
    other = first_other(solutions)
    if other is not None:
        a, b = (f"solution {i} is of {solutions[i].hand} on {solutions[i].object}" for i in (0, other))
        raise CommandError(
            f"{format}: expected solutions of one hand and one object for a file; {a}, {b}. Export them separately."
        )
