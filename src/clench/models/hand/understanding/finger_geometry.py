"""Measure fingers at a posture: axes, anchors, tips, the angles at which links are stretched."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Finger, Hand
from clench.models.shapes import CollisionSource, Shape, ShapeKind

#: Shorter pieces of a finger tell no direction [m].
_SHORT = 2e-3
#: A piece before the first closing joint must be longer to tell where the finger is straight [m].
_LEAD = 1e-2
#: The farthest part of the last link that counts as its tip [-].
_TIP_PART = 0.85


@dataclass(frozen=True)
class FingerLine:
    """The axes of a finger's own joints and its tip, in the palm frame, at one posture.

    Args:
        axes: unit, shape (n, 3). anchors: [m], shape (n, 3). tip: [m], shape (3,).
    """

    axes: FloatArray
    anchors: FloatArray
    tip: FloatArray


def finger_line(hand: Hand, finger: Finger, q: FloatArray) -> FingerLine:
    """Return a finger's line at a posture; the tip is where its last links reach farthest."""
    poses = hand.link_poses(q)
    moved = {link.joint: i for i, link in enumerate(hand.links) if link.joint >= 0}
    axes, anchors = [], []
    for j in finger.joints:
        T = poses[moved[j]]
        axes.append(T[:3, :3] @ hand.joints[j].axis)
        anchors.append(T[:3, :3] @ hand.joints[j].anchor + T[:3, 3])
    tip = poses[finger.tip_link]
    return FingerLine(np.array(axes), np.array(anchors), tip[:3, :3] @ tip_point(hand, finger) + tip[:3, 3])


def tip_point(hand: Hand, finger: Finger) -> FloatArray:
    """Return the middle of the far end of the tip link, in its frame [m], shape (3,)."""
    points, away = _distances(hand, finger.tip_link)
    far = points[away >= _TIP_PART * away.max()]
    return np.asarray(0.5 * (far.min(axis=0) + far.max(axis=0)))


def link_reach(hand: Hand, link: int) -> float:
    """Return how far the shapes of a link reach from the joint that moves it [m]."""
    return float(_distances(hand, link)[1].max())


def _distances(hand: Hand, link: int) -> tuple[FloatArray, FloatArray]:
    """Return points on the outside of a link, in its frame, and how far they are from the joint that moves it [m]."""
    shapes = next(s for s in (hand.links[link].shapes[source] for source in CollisionSource) if s)
    points = np.vstack([_outer_points(shape) for shape in shapes])
    return points, np.linalg.norm(points - _joint_place(hand, link), axis=1)


def bends(line: FingerLine, closing: list[int], axis: FloatArray) -> list[float | None]:
    """Return by how much the finger is bent at every closing joint about an axis [rad].

    Args:
        line: the finger. closing: positions of its closing joints in the chain, palm side first.
        axis: unit, shape (3,); positive bends turn about it.

    None if a piece is too short to tell, or for a first joint that no piece of the finger precedes.
    """
    points = np.vstack([line.anchors[closing], line.tip])
    flat = points - np.outer(points @ axis, axis)
    pieces = [_lead(line, closing[0], axis), *np.diff(flat, axis=0)]
    found: list[float | None] = []
    for before, after in itertools.pairwise(pieces):
        if before is None or min(np.linalg.norm(before), np.linalg.norm(after)) < _SHORT:
            found.append(None)
            continue
        found.append(float(np.arctan2(np.cross(before, after) @ axis, before @ after)))
    return found


def built_alike(hand: Hand, one: Finger, other: Finger) -> bool:
    """Return whether two fingers have the same joints: axes turned alike, and as far from each other."""
    if len(one.joints) != len(other.joints):
        return False
    q = np.array([j.reference for j in hand.joints])
    a, b = (finger_line(hand, finger, q) for finger in (one, other))
    turned, turned_other = (np.abs(line.axes @ line.axes[-1]) for line in (a, b))
    apart, apart_other = (np.linalg.norm(np.diff(line.anchors, axis=0), axis=1) for line in (a, b))
    alike = np.allclose(turned, turned_other, atol=1e-2)
    return bool(alike and np.allclose(apart, apart_other, rtol=1e-2, atol=1e-4))


def axis_angle(a: FloatArray, b: FloatArray) -> float:
    """Return the angle between two unit axes, either sign [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)))


def tip_motion(line: FingerLine, rates: FloatArray) -> FloatArray:
    """Return the velocity of the tip [m/s] for joint rates [rad/s], shape (n,)."""
    return np.asarray(np.einsum("j,jk->k", rates, np.cross(line.axes, line.tip - line.anchors)))


def _lead(line: FingerLine, first: int, axis: FloatArray) -> FloatArray | None:
    """Return the piece of the finger before its first closing joint, across `axis` [m]; None when there is none.

    It runs from the axis of an earlier joint; its share along that axis means nothing and is taken off.
    """
    for k in range(first - 1, -1, -1):
        piece = line.anchors[first] - line.anchors[k]
        piece = piece - line.axes[k] * (piece @ line.axes[k])
        piece = piece - axis * (piece @ axis)
        if np.linalg.norm(piece) >= _LEAD:
            return np.asarray(piece)
    return None


def _joint_place(hand: Hand, link: int) -> FloatArray:
    """Return the anchor of the joint that moves a link, in the link's frame [m]."""
    T = np.eye(4)
    while hand.links[link].joint < 0 and hand.links[link].parent >= 0:
        T = hand.links[link].T_parent_link @ T
        link = hand.links[link].parent
    joint = hand.links[link].joint
    anchor = np.zeros(3) if joint < 0 else hand.joints[joint].anchor
    return T[:3, :3].T @ (anchor - T[:3, 3])


def _outer_points(shape: Shape) -> FloatArray:
    """Return points on the outside of a shape, in the link's frame; round ones by their extremes."""
    a, b, c = shape.size
    if shape.kind is ShapeKind.MESH:
        assert shape.mesh is not None
        return shape.pose.apply(shape.mesh.vertices)
    half = {
        ShapeKind.SPHERE: (a, a, a),
        ShapeKind.CAPSULE: (a, a, a + b),
        ShapeKind.CYLINDER: (a, a, b),
    }.get(shape.kind, (a, b, c))
    if shape.kind in (ShapeKind.BOX, ShapeKind.CYLINDER):
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    else:
        corners = np.vstack([np.eye(3), -np.eye(3)])
    return shape.pose.apply(corners * np.array(half))
