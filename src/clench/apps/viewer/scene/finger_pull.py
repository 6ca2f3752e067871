"""A pull at a link with the mouse: which joint of the preshape follows it, and how far."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand, JointRole

#: A joint whose axis is nearer to the point than this does not move it [m].
_LEVER = 1e-2


@dataclass(frozen=True, eq=False)
class FingerPull:
    """A joint that follows a pull.

    Args:
        joint: its index. turn: by how much it turns for a way in the world [rad/m], shape (3,).
    """

    joint: int
    turn: FloatArray

    def angle(self, way: FloatArray) -> float:
        """Return the turn for a way of the pulled point in the world [m], shape (3,) [rad]."""
        return float(self.turn @ way)


def find_pull(
    hand: Hand, q: FloatArray, hand_pose: Pose, link: int, point: FloatArray, way: FloatArray
) -> FingerPull | None:
    """Return the joint that follows a pull best; posture joints go before closing ones. None where none moves it.

    Args:
        hand: the hand. q: angles of all joints [rad], shape (J,). hand_pose: of the palm. link: that is pulled.
        point: where it is pulled, way: how far, both in the world [m], shape (3,).
    """
    back = hand_pose.inverse()
    moved = [(j, motion) for j, motion in _motions(hand, q, link, back.apply(point))]
    there = back.rotation @ way
    ranked = [
        (
            hand.joints[j].role is JointRole.POSTURE,
            abs(float(motion @ there)) / float(np.linalg.norm(motion)),
            j,
            motion,
        )
        for j, motion in moved
    ]
    if not ranked:
        return None
    _, _, joint, motion = max(ranked, key=lambda entry: entry[:3])
    return FingerPull(joint, hand_pose.rotation @ motion / float(motion @ motion))


def _motions(hand: Hand, q: FloatArray, link: int, point: FloatArray) -> Iterator[tuple[int, FloatArray]]:
    """Yield the joints that move a point of a link, and its motion per turn [m/rad], in the palm frame."""
    poses = hand.link_poses(q)
    followers = {coupling.follower for coupling in hand.couplings}
    while link >= 0 and link != hand.palm:
        j = hand.links[link].joint
        if j >= 0 and j not in followers and hand.joints[j].role is not JointRole.UPSTREAM:
            joint, T = hand.joints[j], poses[link]
            lever = point - (T[:3, :3] @ joint.anchor + T[:3, 3])
            motion = np.cross(T[:3, :3] @ joint.axis, lever)
            if np.linalg.norm(motion) > _LEVER:
                yield j, motion
        link = hand.links[link].parent
