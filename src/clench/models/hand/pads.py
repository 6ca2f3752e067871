"""The pads of fingers: the side of each last link that a closing finger pushes with (docs/method.md section 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray

from .forward import poses_at
from .hand import Finger, Hand, JointRole
from .link_mesh import LinkMesh, link_meshes

#: Triangles whose normal is within this cosine of the closing direction belong to the pad [-].
_FACING = 0.5
#: Places of that surface that are looked at; one in so many is nearest to its middle.
_PLACES, _MIDDLE = 600, 12


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
    points, normals = _facing_surface(mesh, towards)
    if not len(points):
        return None
    across = points - np.outer(points @ towards, towards)
    away = np.linalg.norm(across - across.mean(axis=0), axis=1)
    near = np.argsort(away, kind="stable")[: max(len(points) // _MIDDLE, 1)]
    normal = normals[near].mean(axis=0)
    return Pad(number, finger.tip_link, points[near].mean(axis=0), normal / np.linalg.norm(normal))


def _facing_surface(mesh: LinkMesh, towards: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places of the surface that faces a direction, by area as seen from there, with normals, (N, 3) each."""
    facing = mesh.tree.normals @ towards
    corners = mesh.tree.vertices[mesh.tree.triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = np.cumsum(areas * np.where(facing > _FACING, facing, 0.0))
    if not len(weights) or not weights[-1] > 0.0:
        return np.empty((0, 3)), np.empty((0, 3))
    rng = np.random.default_rng(0)
    chosen = np.searchsorted(weights, weights[-1] * (np.arange(_PLACES) + 0.5) / _PLACES, side="right")
    root, other = np.sqrt(rng.random(_PLACES)), rng.random(_PLACES)
    shares = np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
    return np.einsum("nk,nkx->nx", shares, corners[chosen]), mesh.tree.normals[chosen]


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
