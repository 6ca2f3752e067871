"""Split the commanded motion: posture as commanded, closing to be solved, alternatives (docs/method.md section 1)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from clench.core.pose import FloatArray, Pose, invert
from clench.models.command import GraspCommand
from clench.models.hand.hand import Finger, Hand, JointRole


def open_posture(hand: Hand, command: GraspCommand) -> FloatArray:
    """Return the posture before closing, shape (J,) [rad]: open values, with the preshape's in their place.

    Args:
        hand: the hand. command: its preshape is given by angles.
    """
    q = np.array([j.open_value for j in hand.joints])
    for name, angle in command.angles.items():
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

    The yaw grid offsets the finger's last posture joint before its closing joints. The opposition grid offsets the
    first posture joint of a thumb. The open-value variants offset the finger's free joints before it starts to close.
    """
    postures = [q]
    first, last = _posture_joints(hand, finger)
    turns = _with_zero(command.yaw_grid if last is not None else ())
    oppositions = _with_zero(command.opposition_grid if first is not None and finger.is_thumb else ())
    for opposition, turn, curl in itertools.product(oppositions, turns, _with_zero(command.open_variants)):
        variant = q.copy()
        if first is not None:
            _shift(hand, variant, first, opposition)
        if last is not None:
            _shift(hand, variant, last, turn)
        for j in finger.joints:
            if hand.joints[j].role is JointRole.CLOSING:
                _shift(hand, variant, j, curl * hand.joints[j].direction)
        variant = hand.coupled(variant)
        if not any(np.array_equal(variant, p) for p in postures):
            postures.append(variant)
    return postures


def next_postures(hand: Hand, steps: Sequence[Mapping[str, float]]) -> tuple[FloatArray, ...]:
    """Return the postures of the next steps of the work, NaN for joints that a step leaves alone, shape (J,) each."""
    postures = []
    for step in steps:
        q = np.full(len(hand.joints), np.nan)
        for name, angle in step.items():
            q[hand.joint_index(name)] = angle
        for c in hand.couplings:
            # A leader that is left alone leaves its followers alone.
            q[c.follower] = np.clip(
                c.ratio * q[c.leader] + c.offset, hand.joints[c.follower].lower, hand.joints[c.follower].upper
            )
        postures.append(q)
    return tuple(postures)


def task_wrenches(command: GraspCommand, T_world_palm: Pose) -> FloatArray:
    """Return the task's wrenches on the object in the palm frame: force [N] and torque [Nm], shape (N, 6)."""
    parts = [[w.get(part, (0.0, 0.0, 0.0)) for part in ("force", "torque")] for w in command.task_wrenches]
    there: FloatArray = np.array(parts, dtype=np.float64).reshape(-1, 2, 3) @ T_world_palm.rotation
    return there.reshape(-1, 6)


def decompose(hand: Hand, q: FloatArray) -> dict[str, dict[str, float]]:
    """Return a posture as its two motions, by joint name [rad]; upstream joints count as posture."""
    found: dict[str, dict[str, float]] = {"posture": {}, "closing": {}}
    for joint, angle in zip(hand.joints, q.tolist(), strict=True):
        found["closing" if joint.role is JointRole.CLOSING else "posture"][joint.name] = angle
    return found


def _with_zero(offsets: Sequence[float]) -> list[float]:
    return [0.0, *(o for o in offsets if o != 0.0)]


def _posture_joints(hand: Hand, finger: Finger) -> tuple[int | None, int | None]:
    """Return the first and the last posture joint before the closing joints; None for a joint that may not move."""
    before = list(itertools.takewhile(lambda j: hand.joints[j].role is not JointRole.CLOSING, finger.joints))
    before = [j for j in before if hand.joints[j].role is JointRole.POSTURE]
    # A joint that another finger follows would move that finger too.
    tied = {c.leader for c in hand.couplings if c.follower not in finger.joints} | {c.follower for c in hand.couplings}
    first, last = (before[0], before[-1]) if before else (None, None)
    return (None if first in tied else first), (None if last in tied else last)


def _shift(hand: Hand, q: FloatArray, joint: int, offset: float) -> None:
    q[joint] = min(max(q[joint] + offset, hand.joints[joint].lower), hand.joints[joint].upper)
