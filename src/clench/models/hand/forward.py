"""Compute where the links of a hand are at its postures (forward kinematics)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from clench.core.pose import FloatArray

if TYPE_CHECKING:
    from .hand import Hand


class JointArrays(NamedTuple):
    """Constants for the forward kinematics of a hand; J joints.

    Args:
        reference: angles at which the links' own poses hold [rad], (J,). anchor: points on the axes [m], (J, 3).
        cross, square: matrix of the cross product with each axis, and its square, (J, 3, 3).
    """

    reference: FloatArray
    anchor: FloatArray
    cross: FloatArray
    square: FloatArray


def joint_arrays(hand: Hand) -> JointArrays:
    """Return the joints of a hand as arrays."""
    axes = np.array([j.axis for j in hand.joints]).reshape(-1, 3)
    cross = np.zeros((len(axes), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = axes
    cross[:, [1, 2, 0], [2, 0, 1]] = -axes
    return JointArrays(
        np.array([j.reference for j in hand.joints]),
        np.array([j.anchor for j in hand.joints]).reshape(-1, 3),
        cross,
        cross @ cross,
    )


def poses_at(hand: Hand, postures: FloatArray, links: Sequence[int] | None = None) -> FloatArray:
    """Return `T_palm_link` of links at several postures, shape (S, L, 4, 4).

    Args:
        hand: the hand. postures: angles of all its joints [rad], shape (S, J).
        links: which links, in this order; None: all.
    """
    motions = _joint_motions(hand.joint_arrays, postures)
    poses = np.empty((len(postures), len(hand.links), 4, 4))
    for i in range(len(hand.links)) if links is None else _with_parents(hand, links):
        link = hand.links[i]
        local = link.T_parent_link if link.joint < 0 else link.T_parent_link @ motions[:, link.joint]
        poses[:, i] = poses[:, link.parent] @ local if link.parent >= 0 else local
    palm = poses[:, hand.palm]
    back = np.zeros((len(postures), 1, 4, 4))
    back[:, 0, :3, :3] = palm[:, :3, :3].transpose(0, 2, 1)
    back[:, 0, :3, 3] = -np.einsum("sji,sj->si", palm[:, :3, :3], palm[:, :3, 3])
    back[:, 0, 3, 3] = 1.0
    placed: FloatArray = back @ (poses if links is None else poses[:, list(links)])
    return placed


def _with_parents(hand: Hand, links: Sequence[int]) -> list[int]:
    """Return links, the palm, and all links between them and the root, parents first."""
    found = set[int]()
    for i in (*links, hand.palm):
        while i >= 0 and i not in found:
            found.add(i)
            i = hand.links[i].parent
    return sorted(found)


def base_pose(hand: Hand, q: FloatArray) -> FloatArray:
    """Return `T_palm_base` at a posture: the frame of the model's file that the root link stands in, shape (4, 4).

    Args:
        hand: the hand. q: angles of all its joints [rad], shape (J,).
    """
    root = hand.links[0]
    local = root.T_parent_link
    if root.joint >= 0:
        local = local @ _joint_motions(hand.joint_arrays, q[None])[0, root.joint]
    base: FloatArray = poses_at(hand, q[None])[0, 0] @ np.linalg.inv(local)
    return base


def _joint_motions(joints: JointArrays, postures: FloatArray) -> FloatArray:
    """Return the motion of every joint at several postures in the frame of its link, shape (S, J, 4, 4)."""
    angles = postures - joints.reference
    turned = np.sin(angles)[..., None, None] * joints.cross + (1.0 - np.cos(angles))[..., None, None] * joints.square
    motions = np.zeros((*postures.shape, 4, 4))
    motions[..., :3, :3] = np.eye(3) + turned
    motions[..., :3, 3] = -np.einsum("sjab,jb->sja", turned, joints.anchor)
    motions[..., 3, 3] = 1.0
    return motions
