"""Join loose pieces of curves into loops that can be filled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clench.closing.outlines import RoundedOutline
from clench.core.pose import FloatArray

#: End points closer than this are one [m].
_SAME = 1e-9
#: Points around a disk.
_AROUND = 48


@dataclass(frozen=True, eq=False)
class Loop:
    """A curve: points [m], shape (N, 2), and whether it is closed."""

    points: FloatArray
    closed: bool

    def distance(self, point: FloatArray) -> float:
        """Return the distance from a point to the curve [m]."""
        ends = np.roll(self.points, -1, axis=0)
        a, b = (self.points, ends) if self.closed or len(ends) == 1 else (self.points[:-1], ends[:-1])
        run = b - a
        share = ((point - a) * run).sum(axis=1) / np.maximum((run**2).sum(axis=1), 1e-30)
        away = a + np.clip(share, 0.0, 1.0)[:, None] * run - point
        return float(np.linalg.norm(away, axis=1).min())


def join_segments(segments: FloatArray) -> list[Loop]:
    """Join segments end to start, each run with its normal on the right, so that a hole runs against its border.

    Args:
        segments: rows (a_x, a_z, b_x, b_z, n_x, n_z) in any order [m], shape (S, 6).
    """
    a, b, n = segments[:, 0:2], segments[:, 2:4], segments[:, 4:6]
    run = b - a
    flip = run[:, 1] * n[:, 0] - run[:, 0] * n[:, 1] < 0.0
    starts, ends = np.where(flip[:, None], b, a), np.where(flip[:, None], a, b)
    real = np.abs(ends - starts).max(axis=1, initial=0.0) > _SAME
    starts, ends = starts[real], ends[real]
    keys = np.round(np.vstack([starts, ends]) / _SAME).astype(np.int64)
    numbers = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    first, last = numbers[: len(starts)].tolist(), numbers[len(starts) :].tolist()
    leaving: dict[int, list[int]] = {}
    for i, point in enumerate(first):
        leaving.setdefault(point, []).append(i)
    arriving = set(last)
    # Curves with loose ends are followed from those first, or they would be cut in two.
    order = sorted(range(len(first)), key=lambda i: first[i] in arriving)
    used = [False] * len(first)
    return [_follow(i, first, last, leaving, used, starts, ends) for i in order if not used[i]]


def _follow(
    i: int,
    first: list[int],
    last: list[int],
    leaving: dict[int, list[int]],
    used: list[bool],
    starts: FloatArray,
    ends: FloatArray,
) -> Loop:
    origin = first[i]
    points = [starts[i]]
    while True:
        used[i] = True
        if last[i] == origin:
            return Loop(np.array(points), True)
        points.append(ends[i])
        following = [k for k in leaving.get(last[i], ()) if not used[k]]
        if not following:
            return Loop(np.array(points), False)
        i = following[0]


def outline_loops(outline: RoundedOutline) -> list[Loop]:
    """Return the border of a rounded outline: its core's sides, or the hull of disks around its core's vertices."""
    if outline.radius > 0.0:
        t = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
        disk = outline.radius * np.column_stack([np.cos(t), np.sin(t)])
        return [Loop(_hull((outline.vertices[:, None] + disk).reshape(-1, 2)), True)]
    ends = outline.side_ends()
    return join_segments(np.hstack([ends[:, 0], ends[:, 1], outline.sides[:, :2]]))


def _hull(points: FloatArray) -> FloatArray:
    from scipy.spatial import ConvexHull

    hull: FloatArray = points[ConvexHull(points).vertices]
    return hull
