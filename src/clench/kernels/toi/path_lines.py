"""The straight lines of a path, and those that a pair of bodies sees of it (docs/method.md section 7).

Most way-points lie on a line between two others. A pair sees fewer lines than the hand: only the joints that move one
of its bodies matter to it.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.link_frames import FrameArrays, put_link
from clench.kernels.runtime.compiling import kernel

#: Way-points whose joints are this close to a straight line lie on it [rad].
STRAIGHT: Final = 1e-12
#: Rows of `PathLines.kept`: all joints, and those of a pair.
ALL, PAIR = 0, 1


class PathLines(NamedTuple):
    """The ends of the lines of a path; N way-points, L links, J joints.

    Args:
        kept: numbers of the way-points that are ends of lines, for all joints and for those of a pair, (2, N).
        last: number of the last of these ends, for both, (2,).
        path: postures at the ends of the pair's lines [rad], (N, J).
        stations: poses of the links from the root at the way-points that are ends for all joints, (N, L, 3, 4).
        poses: scratch space, (2, 3, 4).
    """

    kept: Ints
    last: Ints
    path: Floats
    stations: Floats
    poses: Floats


@kernel(allocates=True)
def make_path_lines(joints: int, links: int, points: int) -> PathLines:
    """Allocate the lines of a path."""
    return PathLines(
        np.empty((2, points), dtype=np.int64),
        np.zeros(2, dtype=np.int64),
        np.empty((points, joints)),
        np.empty((points, links, 3, 4)),
        np.empty((2, 3, 4)),
    )


@kernel
def keep_lines(path: Floats, frames: FrameArrays, turning: Ints, lines: PathLines) -> None:
    """Write the lines of a path for all joints, and where the links are at their ends; `turning` is overwritten."""
    joints, points = path.shape[1], path.shape[0]
    for j in range(joints):
        turning[j] = j
    for k in range(points):
        lines.kept[PAIR, k] = k
    lines.last[ALL] = find_corners(path, lines.kept[PAIR], points, turning, joints, lines.kept[ALL])
    for n in range(lines.last[ALL] + 1):
        k = lines.kept[ALL, n]
        for i in range(frames.parent.shape[0]):
            put_link(frames, i, path[k], lines.poses[0], lines.poses[1], lines.stations[k])


@kernel
def keep_pair_lines(path: Floats, turning: Ints, count: int, lines: PathLines) -> None:
    """Write the lines of a path that a pair sees; `count` joints of `turning` move one of its bodies."""
    ends = lines.last[ALL] + 1
    lines.last[PAIR] = find_corners(path, lines.kept[ALL], ends, turning, count, lines.kept[PAIR])
    for n in range(lines.last[PAIR] + 1):
        for j in range(path.shape[1]):
            lines.path[n, j] = path[lines.kept[PAIR, n], j]


@kernel
def find_corners(path: Floats, numbers: Ints, points: int, turning: Ints, count: int, kept: Ints) -> int:
    """Write to `kept` the way-points at which the direction of some joints changes; return how many lines there are.

    Args:
        numbers: the way-points that are looked at; `points` of them. turning: the joints; `count` of them.
    """
    n, kept[0] = 0, numbers[0]
    for k in range(1, points - 1):
        if not lies_between(path, kept[n], numbers[k], numbers[k + 1], turning, count):
            n += 1
            kept[n] = numbers[k]
    if points > 1:
        n += 1
        kept[n] = numbers[points - 1]
    return n


@kernel
def lies_between(path: Floats, a: int, b: int, c: int, turning: Ints, count: int) -> bool:
    """Say whether some joints are at way-point `b` on the straight line from `a` to `c`."""
    share, whole = share_between(path, a, b, c, turning, count)
    if whole == 0.0:
        share = 0.0
    if not 0.0 <= share <= 1.0:
        return False
    for i in range(count):
        j = turning[i]
        if abs(path[a, j] + share * (path[c, j] - path[a, j]) - path[b, j]) > STRAIGHT:
            return False
    return True


@kernel
def share_between(path: Floats, a: int, b: int, c: int, turning: Ints, count: int) -> tuple[float, float]:
    """Return which share of the way from way-point `a` to `c` way-point `b` lies along it, and the way's square."""
    along, whole = 0.0, 0.0
    for i in range(count):
        j = turning[i]
        step = path[c, j] - path[a, j]
        along += (path[b, j] - path[a, j]) * step
        whole += step * step
    return (along / whole if whole > 0.0 else 0.0), whole


@kernel
def place_on_path(path: Floats, k: int, t: float, turning: Ints, count: int, lines: PathLines) -> float:
    """Return the place on the path of a place on a pair's line: a way-point, and the share of the way to the next.

    Args:
        k, t: the line, and the share of it. turning: the pair's joints; `count` of them.
    """
    a, c, before = lines.kept[PAIR, k], lines.kept[PAIR, min(k + 1, lines.last[PAIR])], 0.0
    for b in range(a + 1, c + 1):
        share = 1.0 if b == c else share_between(path, a, b, c, turning, count)[0]
        if share > t:
            return b - 1 + (t - before) / (share - before)
        before = share
    return float(c if t > 0.0 else a)
