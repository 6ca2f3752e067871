"""Torques of the hand's degrees of freedom for given contact forces: `tau = J^T f`, through coupling.

A degree of freedom is a joint that follows none, with its followers `q_f = a q_l + b`. A follower at its limit does not
move with its leader, so it carries its share by itself. Breakaway is left aside: degrees of freedom are taken as rigid.
Stops of joints at their limits are not counted on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    if contacts.links is None or not len(contacts):
        return np.zeros((len(contacts) * contacts.width, len(dofs.joints)))
    joints, carriers, moved, lines = hand.kept(("contact joints",), lambda: _moved_by(hand))
    poses = hand.link_poses(q)[carriers]
    axes = np.einsum("jab,jb->ja", poses[:, :3, :3], lines[0])
    anchors = np.einsum("jab,jb->ja", poses[:, :3, :3], lines[1]) + poses[:, :3, 3]
    arms = contacts.positions[:, None] - anchors
    # For small arrays, `np.cross` takes ten times as long.
    speed = axes[:, [1, 2, 0]] * arms[..., [2, 0, 1]] - axes[:, [2, 0, 1]] * arms[..., [1, 2, 0]]
    mine = moved[contacts.links]
    J = np.zeros((len(contacts), contacts.width, len(hand.joints)))
    J[:, :3, joints] = contacts.frames.transpose(0, 2, 1) @ (speed * mine[..., None]).transpose(0, 2, 1)
    if contacts.width == 4:
        J[:, 3, joints] = (contacts.normals @ axes.T) * mine
    result: FloatArray = J.reshape(-1, len(hand.joints)) @ dofs.motion
    return result


def _moved_by(hand: Hand) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, FloatArray]:
    """Return the joints that move links relative to the palm, the links that they carry, and which links each moves.

    Returns:
        joints and their links, shape (K,) each; 1 for every link (row) that a joint moves, else 0, shape (L, K); and
        axes and anchors of the joints in the frames of their links, shape (2, K, 3).
    """
    upstream = _ancestors(hand, hand.palm)
    carriers = [i for i, link in enumerate(hand.links) if link.joint >= 0 and i not in upstream]
    above = [_ancestors(hand, i) for i in range(len(hand.links))]
    moved = np.array([[1.0 if k in mine else 0.0 for k in carriers] for mine in above])
    joints = np.array([hand.links[k].joint for k in carriers], dtype=np.int64)
    lines = np.array([[hand.joints[j].axis for j in joints], [hand.joints[j].anchor for j in joints]])
    moved = moved.reshape(len(hand.links), len(carriers))
    return joints, np.array(carriers, dtype=np.int64), moved, lines.reshape(2, len(carriers), 3)


def _ancestors(hand: Hand, link: int) -> set[int]:
    """Return a link and all links between it and the root."""
    found = set()
    while link >= 0:
        found.add(link)
        link = hand.links[link].parent
    return found
