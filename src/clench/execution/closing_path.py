"""Paths in joint space on which joints move at given speeds and couplings are obeyed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand

#: Places of a path that differ by less than this share of its length are one [-].
ROUNDING: Final = 1e-12
#: Way-points per stage of a finger; speed rises from zero and falls to zero within each.
STAGE_STEPS: Final = 8
#: Joints that move less than this stand still [rad].
STILL: Final = 1e-9


def closing_path(
    hand: Hand, joints: Sequence[int], start: FloatArray, end: FloatArray, speed: FloatArray, steps: int
) -> FloatArray:
    """Return way-points on which joints move at their speeds, each until its end, shape (n, J); the others rest.

    Followers keep to their couplings, between their own start and end. A follower at its limit waits. A follower that
    breaks away continues with the actuator while its leader is held, or stays while its leader continues. Every place
    at which a joint starts or stops is a way-point; between two of them the path is a straight line.
    """
    away = end - start
    closing = hand.kept(("closing directions",), lambda: np.array([float(j.direction) for j in hand.joints]))
    rate = np.where(np.abs(away) > STILL, np.sign(away), closing) * speed
    free = start.copy()
    for c in hand.couplings:
        rate[c.follower] = c.ratio * rate[c.leader]
        free[c.follower] = c.ratio * start[c.leader] + c.offset
    moves = np.zeros(len(start), dtype=np.bool_)
    moves[list(joints)] = True
    moves &= (away != 0.0) & (rate != 0.0)
    events = np.array([start - free, end - free])[:, moves] / rate[moves]
    last = float(events.max(initial=0.0))
    if last <= 0.0:
        return start[None].copy()
    s = _shares(steps)
    inside = np.minimum(np.maximum(events.ravel(), 0.0), last)
    places = distinct(np.concatenate([inside, last * s * s * (3.0 - 2.0 * s)]))
    between = np.maximum(free + places[:, None] * rate, np.minimum(start, end))
    between = np.minimum(between, np.maximum(start, end))
    path: FloatArray = np.where(moves, between, start)
    path[0], path[-1] = start, np.where(moves, end, start)
    return path


def distinct(values: FloatArray) -> FloatArray:
    """Return values in order, from 0 on; of values that differ by rounding alone, the first."""
    ordered = np.sort(values)
    later = np.ones(len(ordered), dtype=np.bool_)
    later[1:] = ordered[1:] - ordered[:-1] > ROUNDING * ordered[-1]
    distinct: FloatArray = ordered[later]
    return distinct


@lru_cache(maxsize=8)
def _shares(steps: int) -> FloatArray:
    """Return evenly spaced shares from 0 to 1, shape (steps + 1,)."""
    shares = np.linspace(0.0, 1.0, steps + 1)
    shares.flags.writeable = False
    return shares


def closing_stages(hand: Hand, joints: tuple[int, ...], start: FloatArray, end: FloatArray) -> Iterator[FloatArray]:
    """Yield the stages of a finger: way-points of all joints, shape (n, J), of which only the finger's move."""
    q = start.copy()
    yield q[None].copy()
    followers = {c.follower for c in hand.couplings}
    for leader in joints:
        if leader in followers:
            continue
        group = [leader, *(j for j in hand.followers_of(leader) if j in joints)]
        path = closing_path(hand, group, q, end, np.ones(len(q)), STAGE_STEPS)
        yield path
        q = path[-1].copy()
    yield eased(q, end)


def eased(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return way-points, evenly spaced in time, that leave and arrive slowly, shape (n, J)."""
    s = np.linspace(0.0, 1.0, STAGE_STEPS + 1)[:, None]
    path: FloatArray = start + (s * s * (3.0 - 2.0 * s)) * (end - start)
    path[-1] = end
    return path
