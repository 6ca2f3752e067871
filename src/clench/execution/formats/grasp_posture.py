"""The shared content of other programs' file formats: a palm pose and the angles of the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose, invert
from clench.core.showing.short_repr import short_repr
from clench.models.command import GraspCommand
from clench.models.hand.forward import base_pose
from clench.models.hand.hand import Hand
from clench.solver.preshapes.named_angles import posture

#: Name of the frame of the hand's own model file in files.
BASE: Final = "world"


@dataclass(frozen=True)
class GraspPosture:
    """A grasp that another program computed, as read from its file.

    Args:
        name: in the file. hand_pose: of the link `root` in the world. object_pose: `T_world_object`.
        joint_angles: [rad] by name, or in the order of the hand's model; empty when the file gives none.
        confidence: the file's own number, None if missing.
        root: a link of the hand, or "world" for the frame of the hand's model file. None, or a name that the hand does
            not have, is the palm.
    """

    name: str
    hand_pose: Pose
    object_pose: Pose = field(default_factory=Pose.identity)
    joint_angles: Mapping[str, float] | Sequence[float] = ()
    confidence: float | None = None
    root: str | None = None

    __repr__ = short_repr

    def command(self, hand: Hand) -> GraspCommand:
        """Return a command that keeps the posture joints and closes the others anew (docs/method.md section 1).

        Raises:
            CommandError: angles that the hand's joints cannot have, or another number of them.
            UnknownNameError: a joint that the hand does not have.
        """
        if not self.joint_angles:
            q = hand.open_angles()
            return GraspCommand(self._palm_pose(hand, q), object_pose=self.object_pose)
        if isinstance(self.joint_angles, Mapping):
            angles = dict(self.joint_angles)
        elif len(self.joint_angles) == len(hand.joints):
            angles = dict(zip(hand.joint_names, self.joint_angles, strict=True))
        else:
            expected = f"{len(hand.joints)} joint angles in the order of hand '{hand.name}'"
            raise CommandError(f"{self.name}: expected {expected}, got {len(self.joint_angles)}.")
        palm_pose = self._palm_pose(hand, posture(angles, hand, f"{self.name}.joint_angles"))
        posed = GraspCommand.from_posture(hand, angles, palm_pose)
        return GraspCommand(palm_pose, object_pose=self.object_pose, preshape=posed.preshape)

    def _palm_pose(self, hand: Hand, q: FloatArray) -> Pose:
        links = [link.name for link in hand.links]
        if self.root in links:
            T_palm_root = hand.link_poses(q)[links.index(self.root)]
        elif self.root == BASE:
            T_palm_root = base_pose(hand, q)
        else:
            return self.hand_pose
        return Pose.from_matrix(self.hand_pose.matrix @ invert(T_palm_root))
