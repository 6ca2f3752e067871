"""The three inputs of a solve, checked and brought together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from clench.closing.collision.packed_object import PackedObject, pack_object
from clench.closing.collision.sizes import warn_of_size
from clench.closing.motion import next_postures, palm_pose, task_wrenches
from clench.core.exceptions import ObjectError, UnknownNameError
from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource
from clench.scoring.calibration import Calibration
from clench.scoring.criterion_types import ScoringContext

from .checked_command import checked

#: More rounds than any finger needs that comes to rest.
UNTIL_REST = 1000


@dataclass(frozen=True, eq=False)
class Problem:
    """One problem to solve: hand, object and command, checked and at their poses; J joints.

    Args:
        hand, obj: the hand closes around the object. command: a copy of the command.
        start: posture before closing, shape (J,) [rad]. source: geometry of the hand.
        T_world_palm, T_world_object: poses. packed: the object.
    """

    hand: Hand
    obj: GraspObject
    command: GraspCommand
    start: FloatArray
    source: CollisionSource
    T_world_palm: Pose
    T_world_object: Pose
    packed: PackedObject

    @property
    def rounds(self) -> int:
        """Number of passes through all degrees of freedom."""
        return self.command.rounds or UNTIL_REST

    @property
    def together(self) -> bool:
        """Whether all joints close simultaneously."""
        return self.command.order.is_simultaneous

    @cached_property
    def T_palm_object(self) -> FloatArray:
        """Pose of the object in the palm frame, shape (4, 4)."""
        from clench.kernels.geometry.link_frames import relate_poses

        T, rows = np.zeros((4, 4)), np.array([self.T_world_palm.wxyz_xyz, self.T_world_object.wxyz_xyz])
        T[3, 3] = 1.0
        relate_poses(rows[:1], rows[1:], T[None, :3])
        return T

    def at(self, T_world_palm: Pose, T_world_object: Pose) -> Problem:
        """Return the same problem with hand and object at other poses."""
        command = self.command.at(T_world_palm, T_world_object)
        return replace(self, command=command, T_world_palm=T_world_palm, T_world_object=T_world_object)


def make_problem(hand: Hand, obj: GraspObject, command: GraspCommand) -> Problem:
    """Check the three inputs and bring them together."""
    own, start, source = checked(hand, command)
    if not any(body.role is BodyRole.GRASPABLE for body in obj.bodies):
        raise ObjectError(f"{obj.name}: no body to grasp; every body is an obstacle.")
    T_world_object = command.object_pose if command.object_pose is not None else obj.pose
    T_world_palm = palm_pose(hand, command, start)
    warn_of_size(hand, obj)
    own = own.at(command.hand_pose, command.object_pose)
    return Problem(hand, obj, own, start, source, T_world_palm, T_world_object, pack_object(obj))


def check_calibration(hand: Hand, calibration: Calibration) -> None:
    """Check that a hand has the joints that a calibration weighs.

    Raises:
        UnknownNameError: a joint that the hand does not have.
    """
    for name in calibration.joints:
        if name not in hand.joint_names:
            raise UnknownNameError(
                "joint", name, f"hand '{hand.name}', though {calibration.name} names it", hand.joint_names
            )


def make_context(problem: Problem, calibration: Calibration) -> ScoringContext:
    """Return the context in which the criteria score candidates; see `check_calibration`."""
    hand = problem.hand
    weights = np.ones(len(hand.joints)) if calibration.joints else None
    for name, weight in calibration.joints.items():
        assert weights is not None
        weights[hand.joint_index(name)] = weight
    return ScoringContext(
        hand,
        problem.start.copy(),  # criteria of others may write to it
        problem.packed,
        problem.T_palm_object,
        problem.source,
        next_postures(hand, problem.command.next_steps),
        weights,
        problem.obj,
        0.0 - problem.T_world_palm.rotation[2],
        not problem.together and problem.command.rounds == 1,
        task_wrenches(problem.command, problem.T_world_palm),
        problem.command.order.is_of_tips,
    )
