"""Tell jaws that are closed where a model's angles are zero: their limits lead all fingertips apart."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Finger, Hand
from clench.models.shapes import CollisionSource

from .finger_geometry import finger_line, tip_point

#: Postures from straight to the far limits at which the tips are looked at.
_LOOKS = 9
#: Tips come apart when the distance between them grows by this factor [-] and by this much [m].
_GROWTH, _GAIN = 1.25, 5e-3
#: Tips whose mean direction of motion is longer move to a common side, as fingers of a hand do [-].
_COMMON = 0.4
#: A single finger touches a fixed jaw when its tip is nearer than this share of the finger's length [-].
_NEAR = 0.35
#: Points along each side of a triangle of the fixed jaw.
_GRID = 6


def open_apart(hand: Hand, fingers: Sequence[Finger], ways: Mapping[int, tuple[float, float]]) -> bool:
    """Return whether every fingertip moves away from all others, from the first of two angles to the second.

    The tip of a single finger is compared with the palm's shapes, which may be the other jaw.

    Args:
        hand: the hand; other joints stay open. fingers: which. ways: both angles by joint [rad].
    """
    points = [(finger.tip_link, tip_point(hand, finger)) for finger in fingers]
    if len(fingers) == 1:
        return _leaves_fixed_jaw(hand, fingers[0], _tips(hand, points, ways)[0])
    if not _all_grow(_tips(hand, points, ways, looks=2)):
        return False
    tips = _tips(hand, points, ways)
    return _opposed(tips[:, 1] - tips[:, 0]) and _all_grow(tips)


def _tips(
    hand: Hand,
    points: Sequence[tuple[int, FloatArray]],
    ways: Mapping[int, tuple[float, float]],
    looks: int = _LOOKS,
) -> FloatArray:
    """Return where points of links are along a motion of the joints [m], shape (points, looks, 3)."""
    q = np.array([j.open_value for j in hand.joints])
    postures = np.tile(q, (looks, 1))
    for j, (near, far) in ways.items():
        postures[:, j] = np.linspace(near, far, looks)
    poses = poses_at(hand, np.array([hand.coupled(posture) for posture in postures]))
    return np.array([poses[:, link, :3, :3] @ point + poses[:, link, :3, 3] for link, point in points])


def _opposed(motions: FloatArray) -> bool:
    """Return whether motions of tips, shape (N, 3), cancel each other, as motions of jaws do."""
    sizes = np.linalg.norm(motions, axis=1)
    return bool(sizes.min() > 0.0 and np.linalg.norm((motions / sizes[:, None]).mean(axis=0)) < _COMMON)


def _all_grow(tips: FloatArray) -> bool:
    return all(_grows(np.linalg.norm(a - b, axis=1)) for a, b in itertools.combinations(tips, 2))


def _grows(distances: FloatArray) -> bool:
    """Return whether distances are smallest at the start and clearly larger at the end."""
    start, end = float(distances[0]), float(distances[-1])
    return start <= distances.min() + 1e-6 and end >= _GROWTH * start + _GAIN


def _leaves_fixed_jaw(hand: Hand, finger: Finger, tips: FloatArray) -> bool:
    jaw = _surface(hand)
    line = finger_line(hand, finger, np.array([j.open_value for j in hand.joints]))
    length = float(np.linalg.norm(tips[0] - line.anchors[0]))
    if not len(jaw):
        return False
    distances = np.array([np.linalg.norm(jaw - tip, axis=1).min() for tip in tips])
    return bool(distances[0] <= _NEAR * length) and _grows(distances)


def _surface(hand: Hand) -> FloatArray:
    """Return points on the palm's shapes in its frame [m], shape (N, 3)."""
    link = hand.links[hand.palm]
    shapes = next((s for s in (link.shapes[source] for source in CollisionSource) if s), ())
    meshes = [shape.to_mesh(1e-3) for shape in shapes]
    if not meshes:
        return np.empty((0, 3))
    steps = np.linspace(0.0, 1.0, _GRID)
    weights = np.array([(u, v, 1.0 - u - v) for u in steps for v in steps if u + v <= 1.0 + 1e-9])
    return np.vstack([(weights @ mesh.vertices[mesh.triangles]).reshape(-1, 3) for mesh in meshes])
