"""The pads of fingers: the side of each last link that a closing finger pushes with (docs/method.md section 10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clench.base.pose import FloatArray

from .forward import poses_at
from .hand import Finger, Hand, JointRole
from .link_mesh import LinkMesh, link_meshes

#: Triangles whose normal is within this cosine of the closing direction belong to the pad [-].
_FACING = 0.5
#: The pad lies as high as this share of its surface reaches along the closing direction [-].
_HIGH = 0.9


@dataclass(frozen=True, eq=False)
class Pad:
    """The pad of a finger.

    Args:
        finger: index in the hand. link: index of the last link that has a shape.
        point: middle of the pad in the frame of the link [m], shape (3,). normal: out of the link, unit, shape (3,).
    """

    finger: int
    link: int
    point: FloatArray
    normal: FloatArray


def finger_pads(hand: Hand) -> tuple[Pad, ...]:
    """Return the pads of the fingers that close, in the order of the hand's fingers."""
    meshes = {mesh.link: mesh for mesh in link_meshes(hand)}
    found = []
    for number, finger in enumerate(hand.fingers):
        mesh = meshes.get(finger.tip_link)
        if mesh is not None and closing_joints_of(hand, finger):
            pad = _pad(hand, number, finger, mesh)
            if pad is not None:
                found.append(pad)
    return tuple(found)


def closing_joints_of(hand: Hand, finger: Finger) -> tuple[int, ...]:
    """Return the joints of a finger that close and follow no other joint, palm side first."""
    followers = {c.follower for c in hand.couplings}
    return tuple(j for j in finger.joints if hand.joints[j].role is JointRole.CLOSING and j not in followers)


def closing_limit(hand: Hand, joint: int) -> float:
    """Return the limit of a joint that it closes towards [rad]."""
    found = hand.joints[joint]
    return found.upper if found.direction > 0 else found.lower


def _pad(hand: Hand, number: int, finger: Finger, mesh: LinkMesh) -> Pad | None:
    towards = _closing_direction(hand, finger, mesh)
    if towards is None:
        return None
    corners = mesh.tree.vertices[mesh.tree.triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    facing = mesh.tree.normals @ towards
    weight = areas * np.where(facing > _FACING, facing, 0.0)
    if not weight.sum() > 0.0:
        return None
    middles = corners.mean(axis=1)
    middle, heights = weight @ middles / weight.sum(), middles @ towards
    order = np.argsort(heights, kind="stable")
    height = heights[order[np.searchsorted(np.cumsum(weight[order]), _HIGH * weight.sum())]]
    return Pad(number, finger.tip_link, middle + towards * (height - middle @ towards), towards)


def _closing_direction(hand: Hand, finger: Finger, mesh: LinkMesh) -> FloatArray | None:
    """Return the way in which the last link moves while its finger closes, in its frame, unit, shape (3,)."""
    q = hand.open_angles()
    after = q.copy()
    for j in closing_joints_of(hand, finger):
        after[j] += 1e-3 * hand.joints[j].direction
    poses = poses_at(hand, np.array([q, hand.coupled(after)]))[:, mesh.link]
    moved = (poses[1] - poses[0])[:3, :3] @ mesh.center + (poses[1] - poses[0])[:3, 3]
    size = float(np.linalg.norm(moved))
    if size < 1e-9:
        return None
    way: FloatArray = poses[0, :3, :3].T @ moved / size
    return way
