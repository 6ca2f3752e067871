"""Choose from where a grasp is seen: many contacts in sight, spread out, and never from under a table."""

from __future__ import annotations

from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.appearance import SolidKind

from .camera import Camera, fitted_camera
from .stage import Stage

#: Size of the pictures in which contacts are looked for [px].
_SMALL: Final = (140, 140)
#: Weight of a contact behind the object, which is drawn translucent; behind the hand or an obstacle nothing.
_BEHIND_OBJECT: Final = 0.5
#: What counts besides the contacts in sight: their spread, how much of the object is seen, and contacts that no
#: earlier view shows.
_SPREAD: Final = 0.5
_OBJECT: Final = 0.7
_NEW: Final = 1.0
#: Two views are at least so far apart, as the cosine of the angle [-].
_APART: Final = 0.45
#: With an obstacle, a viewer is above the ground by at least this share of the distance [-].
_LOWEST: Final = 0.2
#: The object is shown as far from the hand as this share of its size [-].
_NEAR: Final = 0.5


def focus_of(stage: Stage) -> FloatArray:
    """Return the points that must be in a picture: the hand, and the object as far as it is near, shape (N, 3)."""
    hand, others = stage.points(SolidKind.HAND), stage.points(SolidKind.OBJECT)
    if not len(hand) or not len(others):
        return np.concatenate([hand, others]) if len(hand) + len(others) else stage.points(*SolidKind)
    low, high = hand.min(axis=0), hand.max(axis=0)
    reach = _NEAR * float((high - low).max())
    seen = ((others >= low - reach) & (others <= high + reach)).all(axis=1)
    return np.concatenate([hand, others[seen]])


def around() -> FloatArray:
    """Return directions to viewers all around, from above and from below, unit vectors of shape (16, 3)."""
    azimuth = 0.2 + np.arange(16) * (np.pi / 8.0)  # off the diagonals, where two world axes would coincide
    heights = np.array([0.3, 0.7, 0.15, -0.4])[np.arange(16) % 4]
    level = np.sqrt(1.0 - heights**2)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), heights])


def viewpoints(stage: Stage, focus: FloatArray, points: FloatArray, count: int) -> list[FloatArray]:
    """Choose directions to viewers that together show contacts and object well, the best one first.

    With an obstacle, every viewer is above the ground: what stands on a table is not seen from below it.

    Args:
        stage: the scene. focus: points that must be seen, shape (N, 3). points: contacts, shape (C, 3).
        count: how many directions.
    """
    directions = around()
    if any(solid.kind is SolidKind.OBSTACLE for solid in stage.solids):
        directions = directions[directions[:, 2] >= _LOWEST]
    cameras = [fitted_camera(direction, focus, _SMALL) for direction in directions]
    looks = [_look(stage, camera, points) for camera in cameras]
    chosen: list[int] = []
    missed = np.ones(len(points))
    while len(chosen) < count:
        apart = np.array([all(d @ directions[k] < _APART for k in chosen) for d in directions])
        scores = np.array(
            [score + (_NEW * float((missed * seen).mean()) if len(points) else 0.0) for score, seen in looks]
        )
        left = np.where(apart & ~np.isin(np.arange(len(directions)), chosen), scores, scores - 10.0)
        left[chosen] = -np.inf
        chosen.append(int(np.argmax(left)))
        missed = missed * (1.0 - looks[chosen[-1]][1])
    return [directions[k] for k in chosen]


def _look(stage: Stage, camera: Camera, points: FloatArray) -> tuple[float, FloatArray]:
    """Return how well a view shows a grasp, and how well it shows each contact, 0 to 1, shape (C,)."""
    whole = stage.sight(camera)
    kinds = np.array([solid.kind is SolidKind.OBJECT for solid in stage.solids] + [False])
    drawn = max(int(np.count_nonzero(whole.solid >= 0)), 1)
    score = _OBJECT * min(float(np.count_nonzero(kinds[whole.solid])) / drawn, 0.5)
    if not len(points):
        return score, np.empty(0)
    through = stage.sight(camera, without=(SolidKind.OBJECT,))
    behind, away = whole.hides(camera, points, 1), through.hides(camera, points, 1)
    seen = np.where(away, 0.0, np.where(behind, _BEHIND_OBJECT, 1.0))
    spread = float(np.ptp(camera.project(points)[:, :2], axis=0).sum()) / camera.width
    return score + float(seen.mean()) + _SPREAD * spread, seen
