"""A whole posture, from a planner, a glove or a learned model, taken apart into posture and closing motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand, JointRole

from .command import GraspCommand
from .command_file import check_angle


def command_from_posture(hand: Hand, q: FloatArray | Mapping[str, float], hand_pose: Pose) -> GraspCommand:
    """Keep the posture and upstream joints of a posture as the preshape; closing joints start open and are solved anew.

    Args:
        hand: the hand.
        q: all joint angles [rad], in model order, shape (J,), or by name. Followers are ignored, because their leaders
            decide; they may be missing by name.
        hand_pose: `T_world_palm`.

    Raises:
        CommandError: wrong length, an angle missing, not finite or outside the joint's limits (closing joints too: a
            posture in degrees is noticed there). UnknownNameError: no such joint.
    """
    check_type(hand, Hand, "hand")
    check_type(hand_pose, Pose, "hand_pose")
    followers = {coupling.follower for coupling in hand.couplings}
    angles = _by_joint(hand, q, followers)
    for joint, angle in angles.items():
        if joint not in followers:
            check_angle(hand, joint, angle, f"posture.{hand.joints[joint].name}")
    kept = (JointRole.POSTURE, JointRole.UPSTREAM)
    preshape = {
        joint.name: angles[i] for i, joint in enumerate(hand.joints) if joint.role in kept and i not in followers
    }
    return GraspCommand(hand_pose, preshape=preshape)


def _by_joint(hand: Hand, q: FloatArray | Mapping[str, float], followers: set[int]) -> dict[int, float]:
    """Return the finite angle [rad] of every joint that was given, by index; all but followers must be."""
    if isinstance(q, Mapping):
        given: dict[int, Any] = {hand.joint_index(name): angle for name, angle in q.items()}
        missing = [j.name for i, j in enumerate(hand.joints) if i not in given and i not in followers]
        if missing:
            raise CommandError(
                f"posture.{missing[0]}: missing; expected the angle of every joint of hand '{hand.name}'."
            )
    else:
        values = np.asarray(q)
        if values.shape != (len(hand.joints),):
            expected = f"{len(hand.joints)} angles in rad in the order of hand '{hand.name}'"
            raise CommandError(f"posture: expected {expected}, got shape {values.shape}.")
        given = dict(enumerate(values.tolist()))
    return {i: _angle(angle, f"posture.{hand.joints[i].name}") for i, angle in given.items()}


def _angle(value: Any, key: str) -> float:
    try:
        angle = float(value)
    except (TypeError, ValueError):
        raise CommandError(f"{key}: expected a number in rad, got {value!r}.") from None
    if not np.isfinite(angle):
        raise CommandError(f"{key}: expected a finite number in rad, got {angle}.")
    return angle
