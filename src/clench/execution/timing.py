"""Time straight pieces of a joint path under velocity and acceleration limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray

#: Default largest acceleration of a joint [rad/s²]: models do not state one.
ACCELERATION: Final = 10.0
#: Two directions whose unit vectors differ by less are one straight line [-].
_STRAIGHT: Final = 1e-9
#: Larger angles [rad] and longer motions [s] are mistakes in a file.
_FARTHEST: Final = 1e6
_LONGEST: Final = 3600.0
#: Way-points of a timed path are this far apart, and at every corner [s].
SAMPLE: Final = 0.02


@dataclass(frozen=True)
class Profile:
    """The fastest motion from 0 to 1, at rest at both ends, under a largest speed v and a largest acceleration a.

    The speed grows with a for a time r = v / a, stays at v, and falls with a. If half the way is too short to reach v,
    the speed falls after it has grown; then r = 1 / √a.

    Args:
        speed: that is reached [1/s]. ramp: r [s]. duration: of the motion [s].
    """

    speed: float
    ramp: float
    duration: float

    @classmethod
    def fastest(cls, velocity: float, acceleration: float) -> Profile:
        """Return the profile for a largest speed [1/s] and a largest acceleration [1/s²]."""
        ramp, half = velocity / acceleration, acceleration**-0.5
        if ramp < half:
            return cls(velocity, ramp, 1.0 / velocity + ramp)
        return cls(acceleration * half, half, 2.0 * half)

    def at(self, times: ArrayLike) -> FloatArray:
        """Return how far the motion is at times [s], from 0 to 1, with their shape."""
        time = np.asarray(times, dtype=np.float64)
        left = self.duration - time
        nearest = np.minimum(time, left)
        part = 0.5 * self.speed / self.ramp * (nearest * nearest)
        way = np.where(time < left, part, 1.0 - part)
        way = np.where(nearest >= self.ramp, self.speed * (time - 0.5 * self.ramp), way)
        return np.where(left <= 0.0, 1.0, np.where(time <= 0.0, 0.0, way))


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A timed path of straight lines in joint space.

    The joints go through each line from rest to rest, as fast as the limits allow.

    Args:
        corners: ends of the lines [rad], shape (N, J). times: when they are reached [s], shape (N,), from 0.
        profiles: how far along every line the joints are [-], N - 1 profiles.
    """

    corners: FloatArray
    times: FloatArray
    profiles: tuple[Profile, ...]

    @property
    def duration(self) -> float:
        """Time from the first corner to the last [s]."""
        return float(self.times[-1])

    def at(self, times: FloatArray) -> FloatArray:
        """Return the angles at times [s], shape (N, J); before the start the first, after the end the last."""
        line = np.searchsorted(self.times, times, side="right") - 1
        angles = self.corners[np.where(line < 0, 0, -1)]
        for k, profile in enumerate(self.profiles):
            on = line == k
            part = profile.at(times[on] - self.times[k])[:, None]
            angles[on] = self.corners[k] + part * (self.corners[k + 1] - self.corners[k])
        return angles

    def samples(self, duration: float) -> FloatArray:
        """Return times [s] at which the path, stretched to a duration [s], is looked at; corners among them."""
        if not self.duration > 0.0:
            return np.zeros(1)
        count = max(1, int(np.ceil(duration / SAMPLE)))
        return np.concatenate([self.times * (duration / self.duration), np.linspace(0.0, duration, count + 1)])

    def stretched_at(self, times: FloatArray, duration: float) -> FloatArray:
        """Return the angles at times [s] of the path slowed down evenly to a duration [s], shape (N, J)."""
        return self.at(times * (self.duration / duration) if duration > 0.0 else np.zeros(len(times)))


def time_path(stages: Sequence[FloatArray], velocity: FloatArray, acceleration: FloatArray) -> TimedPath:
    """Time the lines that stages consist of.

    A joint that changes its speed at a corner stands still there: on an exact path any other speed would need an
    infinite acceleration.

    Args:
        stages: way-points that follow each other [rad], each of shape (n, J).
        velocity: largest of every joint [rad/s], shape (J,). acceleration: the same [rad/s²].

    Raises:
        CommandError: an angle that no joint reaches, or a motion that takes more than an hour.
    """
    points = np.vstack(list(stages))
    farthest = float(np.abs(points).max(initial=0.0))
    if not farthest <= _FARTHEST:
        raise CommandError(
            f"Cannot time a motion to a joint angle of {farthest:.3g} rad; expected up to {_FARTHEST:g}."
        )
    corners = _corners(points)
    profiles = tuple(_profile(b - a, velocity, acceleration) for a, b in pairwise(corners))
    times = np.concatenate([np.zeros(1), np.cumsum([profile.duration for profile in profiles])])
    return TimedPath(corners, times, profiles)


def _corners(points: FloatArray) -> FloatArray:
    """Return the ends of the straight lines of a path, shape (N, J); points that repeat are one."""
    kept = [points[0]]
    for point in points[1:]:
        step = point - kept[-1]
        length = float(np.linalg.norm(step))
        if length == 0.0:
            continue
        if len(kept) > 1:
            before = kept[-1] - kept[-2]
            if np.abs(step / length - before / np.linalg.norm(before)).max() <= _STRAIGHT:
                kept[-1] = point
                continue
        kept.append(point)
    return np.array(kept)


def _profile(step: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> Profile:
    """Return the fastest motion from 0 to 1 along a line, at rest at both ends."""
    moved = np.abs(step)
    moving = moved > 0.0
    fastest = float((velocity[moving] / moved[moving]).min())
    hardest = float((acceleration[moving] / moved[moving]).min())
    least = max(1.0 / fastest if fastest > 0.0 else np.inf, hardest**-0.5 if hardest > 0.0 else np.inf)
    if not least <= _LONGEST:
        raise CommandError(
            f"The motion would take {least:.3g} s, more than {_LONGEST:g} s; expected smaller joint angles, "
            f"or higher speeds (joint velocities of the hand, speed, acceleration)."
        )
    return Profile.fastest(fastest, hardest)
