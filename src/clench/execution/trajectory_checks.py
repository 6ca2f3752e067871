"""Refuse numbers in a trajectory file that no plan has; a hand would be told them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from clench.base.errors import FileError
from clench.models.hand.extremes import LARGEST_ANGLE

#: Slowest and fastest limits of velocity [rad/s] and acceleration [rad/s²].
RATES: Final = (1e-6, 1e6)
#: The longest time from the first way-point to the last [s].
LONGEST: Final = 1e6


def check_rates(source: str, speed: float, acceleration: float, limits: Sequence[float]) -> None:
    """Check the numbers that say how fast a trajectory may be.

    Args:
        source: the file, for messages. speed: fraction of the limits [-]. acceleration: [rad/s²].
        limits: of the velocities [rad/s].

    Raises:
        FileError: with the key, and what was expected.
    """
    _check(source, "speed", speed, RATES[0], 1.0)
    _check(source, "acceleration", acceleration, *RATES)
    for i, limit in enumerate(limits):
        _check(source, f"velocity_limits[{i}]", limit, *RATES)


def check_points(source: str, points: Iterable[tuple[float, Sequence[float]]]) -> None:
    """Check the times [s] and angles [rad] of way-points; `source` names the file.

    Raises:
        FileError: with the key, and what was expected.
    """
    for i, (time, angles) in enumerate(points):
        _check(source, f"points[{i}].time", time, 0.0, LONGEST)
        for j, angle in enumerate(angles):
            _check(source, f"points[{i}].positions[{j}]", angle, -LARGEST_ANGLE, LARGEST_ANGLE)


def _check(source: str, key: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise FileError(source, f"{key}: expected a number from {least:g} to {most:g}, got {value:g}.")
