"""What the file formats of other programs have in common: a palm pose and the angles of the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from clench.base.errors import CommandError
from clench.base.pose import Pose, invert
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.solve.solution import GraspSolution


@dataclass(frozen=True)
class GraspPosture:
    """Hold a grasp that another program computed.

    Args:
        name: in the file. hand_pose: `T_world_palm`. object_pose: `T_world_object`.
        joint_angles: [rad] by name, or in the order of the hand's model; empty when the file gives none.
        confidence: what the file says of its quality, None when nothing.
    """

    name: str
    hand_pose: Pose
    object_pose: Pose = field(default_factory=Pose.identity)
    joint_angles: Mapping[str, float] | Sequence[float] = ()
    confidence: float | None = None

    def command(self, hand: Hand) -> GraspCommand:
        """Return a command that keeps the posture joints and closes the others anew (METHOD.md section 1).

        Raises:
            CommandError: angles that the hand's joints cannot have, or another number of them.
            UnknownNameError: a joint that the hand does not have.
        """
        command = GraspCommand(self.hand_pose, object_pose=self.object_pose)
        if not self.joint_angles:
            return command
        if isinstance(self.joint_angles, Mapping):
            angles = dict(self.joint_angles)
        elif len(self.joint_angles) == len(hand.joints):
            angles = dict(zip(hand.joint_names, self.joint_angles, strict=True))
        else:
            expected = f"{len(hand.joints)} joint angles in the order of hand '{hand.name}'"
            raise CommandError(f"{self.name}: expected {expected}, got {len(self.joint_angles)}.")
        posed = GraspCommand.from_posture(hand, angles, self.hand_pose)
        return GraspCommand(self.hand_pose, object_pose=self.object_pose, preshape=posed.preshape)


def palm_in_object(solution: GraspSolution) -> Pose:
    """Return `T_object_palm` of a solution."""
    return Pose.from_matrix(invert(solution.object_pose.matrix) @ solution.hand_pose.matrix)


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


def squeezed(solution: GraspSolution) -> Mapping[str, float]:
    """Return what position servos are told to squeeze [rad]: the grasp and, where planned, the squeeze's offsets."""
    offsets = (solution.squeeze or {}).get("offsets") or {}
    return {name: angle + float(offsets.get(name, 0.0)) for name, angle in solution.joint_angles.items()}
