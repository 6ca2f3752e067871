"""Split the commanded motion: posture from the command, closing to be solved, alternatives (METHOD.md section 1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clench.base.pose import FloatArray, Pose, invert
from clench.models.command import GraspCommand
from clench.models.hand.hand import Finger, Hand, JointRole


def open_posture(hand: Hand, command: GraspCommand) -> FloatArray:
    """Return the posture before closing, shape (J,) [rad]: open values, with the preshape's in their place."""
    q = np.array([j.open_value for j in hand.joints])
    for name, angle in command.preshape.items():
        joint = hand.joint_index(name)
        q[joint] = min(max(angle, hand.joints[joint].lower), hand.joints[joint].upper)
    return hand.coupled(q)


def palm_pose(hand: Hand, command: GraspCommand, q: FloatArray) -> Pose:
    """Return `T_world_palm` of a command whose `hand_pose` may place another root link."""
    if command.root_link is None:
        return command.hand_pose
    T_palm_root = hand.link_poses(q)[hand.link_index(command.root_link)]
    return Pose.from_matrix(command.hand_pose.matrix @ invert(T_palm_root))


def asked_fingers(hand: Hand, command: GraspCommand) -> tuple[Finger, ...]:
    """Return the fingers that close, in the command's order."""
    if command.fingers is None:
        return hand.fingers
    return tuple(hand.finger(name) for name in command.fingers)


def alternatives(hand: Hand, finger: Finger, q: FloatArray, command: GraspCommand) -> list[FloatArray]:
    """Return the open postures to try for a finger, the commanded one first, each inside the limits, shape (J,).

    The yaw grid offsets the finger's last posture joint before its closing joints; the open-value variants close the
    finger's free joints by an offset before it starts.
    """
    postures = [q]
    yaw = _yaw_joint(hand, finger)
    for turn in _with_zero(command.yaw_grid if yaw is not None else ()):
        for curl in _with_zero(command.open_variants):
            variant = q.copy()
            if yaw is not None:
                _shift(hand, variant, yaw, turn)
            for j in finger.joints:
                if hand.joints[j].role is JointRole.CLOSING:
                    _shift(hand, variant, j, curl * hand.joints[j].direction)
            variant = hand.coupled(variant)
            if not any(np.array_equal(variant, p) for p in postures):
                postures.append(variant)
    return postures


def decompose(hand: Hand, q: FloatArray) -> dict[str, dict[str, float]]:
    """Return a posture as its two motions, by joint name [rad]; upstream joints count as posture."""
    closing = {j.name: float(a) for j, a in zip(hand.joints, q, strict=True) if j.role is JointRole.CLOSING}
    posture = {j.name: float(a) for j, a in zip(hand.joints, q, strict=True) if j.role is not JointRole.CLOSING}
    return {"posture": posture, "closing": closing}


def _with_zero(offsets: Sequence[float]) -> list[float]:
    return [0.0, *(o for o in offsets if o != 0.0)]


def _yaw_joint(hand: Hand, finger: Finger) -> int | None:
    before = None
    for j in finger.joints:
        if hand.joints[j].role is JointRole.CLOSING:
            break
        if hand.joints[j].role is JointRole.POSTURE:
            before = j
    # A joint that another finger follows would move that finger too.
    shared = any(c.leader == before and c.follower not in finger.joints for c in hand.couplings)
    follows = any(c.follower == before for c in hand.couplings)
    return None if shared or follows else before


def _shift(hand: Hand, q: FloatArray, joint: int, offset: float) -> None:
    q[joint] = min(max(q[joint] + offset, hand.joints[joint].lower), hand.joints[joint].upper)
