"""Torques of the hand's degrees of freedom for given contact forces: `tau = J^T f`, through coupling.

A degree of freedom is a joint that follows none, with its followers `q_f = a q_l + b`. A follower at its limit does not
move with its leader, so it carries its share by itself. Breakaway is left aside: degrees of freedom are taken as rigid.
Stops of joints at their limits are not counted on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand

from .contacts import ContactSet

#: A follower this close to its limit stands still [rad].
_AT_LIMIT = 1e-9


@dataclass(frozen=True, eq=False)
class DegreesOfFreedom:
    """The degrees of freedom of a hand at a posture.

    Args:
        names: of the leading joints, in model order.
        joints: indices of these joints.
        motion: rates of all joints per rate of a degree of freedom, shape (J, D).
        limits: largest torque [Nm], infinite where the model gives none, shape (D,). It is the effort limit of
            the leading joint alone, also where followers are driven, too: a bound on the safe side.
        losses: torque that dry friction in the joints takes [Nm], shape (D,); None: none.
    """

    names: tuple[str, ...]
    joints: tuple[int, ...]
    motion: FloatArray
    limits: FloatArray
    losses: FloatArray | None = None


def degrees_of_freedom(hand: Hand, q: FloatArray) -> DegreesOfFreedom:
    """Return the degrees of freedom of a hand at a posture q [rad], shape (J,)."""
    followers = {c.follower for c in hand.couplings}
    leaders = [j for j in range(len(hand.joints)) if j not in followers]
    motion = np.zeros((len(hand.joints), len(leaders)))
    motion[leaders, np.arange(len(leaders))] = 1.0
    for c in hand.couplings:
        joint, wanted = hand.joints[c.follower], c.ratio * q[c.leader] + c.offset
        if joint.lower - _AT_LIMIT <= wanted <= joint.upper + _AT_LIMIT:
            motion[c.follower, leaders.index(c.leader)] = c.ratio
    efforts = [hand.joints[j].effort for j in leaders]
    return DegreesOfFreedom(
        names=tuple(hand.joints[j].name for j in leaders),
        joints=tuple(leaders),
        motion=motion,
        limits=np.array([np.inf if e is None else e for e in efforts]),
        losses=np.abs(motion).T @ np.array([joint.friction_loss for joint in hand.joints]),
    )


def hand_jacobian(hand: Hand, q: FloatArray, contacts: ContactSet, dofs: DegreesOfFreedom) -> FloatArray:
    """Return J, shape (C * width, D): motion of the contacts, in their frames, per rate of the degrees of freedom.

    `J^T f` are the torques [Nm] with which the hand pushes on the object with forces f. Joints that are not between the
    palm and the link (wrist, arm) do not move its contacts relative to the palm.

    Args:
        hand: the hand. q: its posture [rad], shape (J,).
        contacts: in the palm frame, with links. dofs: see `degrees_of_freedom`.
    """
    poses = hand.link_poses(q)
    upstream = _ancestors(hand, hand.palm)
    J = np.zeros((len(contacts), contacts.width, len(hand.joints)))
    links = np.empty(0, dtype=np.int64) if contacts.links is None else contacts.links
    for c, link in enumerate(links):
        for k in _ancestors(hand, int(link)) - upstream:
            joint = hand.links[k].joint
            if joint < 0:
                continue
            axis = poses[k, :3, :3] @ hand.joints[joint].axis
            anchor = poses[k, :3, :3] @ hand.joints[joint].anchor + poses[k, :3, 3]
            frame = contacts.frames[c]
            J[c, :3, joint] = frame.T @ _crossed(axis, contacts.positions[c] - anchor)
            if contacts.width == 4:
                J[c, 3, joint] = contacts.normals[c] @ axis
    result: FloatArray = J.reshape(-1, len(hand.joints)) @ dofs.motion
    return result


def _crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product of two vectors; for single ones `np.cross` takes ten times as long."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _ancestors(hand: Hand, link: int) -> set[int]:
    """Return a link and all links between it and the root."""
    found = set()
    while link >= 0:
        found.add(link)
        link = hand.links[link].parent
    return found
