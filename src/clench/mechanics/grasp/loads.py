"""Load sets: the external wrenches that a grasp is asked to hold, as rows `(force, torque / length)` [N].

The resisted wrenches form a convex set: a grasp that holds the corners of a set holds everything between them.
"""

from __future__ import annotations

from functools import cache
from numbers import Real
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, checked_vector

#: Standard acceleration of gravity [m/s²].
GRAVITY: Final = 9.80665


def weight(mass: float, direction: ArrayLike) -> FloatArray:
    """Return the load of gravity on a mass, along a direction in the frame of the contacts, shape (1, 6).

    Raises:
        CommandError: a mass that is not finite and at least 0, a direction of no length.
    """
    d = checked_vector(direction, 3, "gravity", "[x, y, z]")
    norm = float(np.linalg.norm(d))
    if not (np.isfinite(norm) and norm > 0.0):
        raise CommandError(f"gravity: expected a direction [x, y, z] of some length, got {d.tolist()}.")
    load = np.zeros((1, 6))
    load[0, :3] = check_mass(mass) * GRAVITY * d / norm
    return load


def gravity_any_direction(mass: float) -> FloatArray:
    """Return 12 loads whose hull holds the weight of a mass in every direction, an icosahedron, shape (12, 6).

    Its corners are 26 % farther out than the weight itself.
    """
    loads = np.zeros((12, 6))
    corners, inner = _icosahedron()
    loads[:, :3] = check_mass(mass) * GRAVITY / inner * corners
    return loads


def six_pulls(force: float) -> FloatArray:
    """Return pulls at the centre of mass along ±x, ±y, ±z of the contacts' frame, shape (6, 6).

    Raises:
        CommandError: a force [N] that is not finite and above 0.
    """
    if not (np.isfinite(force) and force > 0.0):
        raise CommandError(f"pull: expected a force above 0 N, got {force!r}.")
    return np.hstack([np.vstack([np.eye(3), -np.eye(3)]) * force, np.zeros((6, 3))])


def six_pulls_and_twists(force: float) -> FloatArray:
    """Return `six_pulls` and torques of force times length scale about the same axes, shape (12, 6)."""
    pulls = six_pulls(force)
    return np.vstack([pulls, np.roll(pulls, 3, axis=1)])


def task_wrench(force: ArrayLike, torque: ArrayLike, length: float) -> FloatArray:
    """Return one load of a force [N] and a torque [Nm] about the centre of mass, shape (1, 6).

    Raises:
        CommandError: not three finite numbers each.
    """
    parts = [np.asarray(part, dtype=np.float64) for part in (force, torque)]
    for key, part in zip(("force", "torque"), parts, strict=True):
        if part.shape != (3,) or not np.isfinite(part).all():
            raise CommandError(f"task wrench: expected three finite numbers as {key}, got {part.tolist()}.")
    return np.concatenate([parts[0], parts[1] / length])[None]


def check_loads(loads: ArrayLike) -> FloatArray:
    """Return loads as rows of six, shape (N, 6).

    Raises:
        CommandError: none, another shape, or numbers that are not finite.
    """
    try:
        rows = np.atleast_2d(np.asarray(loads, dtype=np.float64))
    except (TypeError, ValueError):
        raise CommandError(f"loads: expected rows of six numbers (force, torque / length), got {loads!r}.") from None
    if rows.size == 0:
        raise CommandError("loads: the set is empty; expected at least one wrench to hold.")
    if rows.ndim != 2 or rows.shape[1] != 6:
        raise CommandError(f"loads: expected rows of six numbers (force, torque / length), got shape {rows.shape}.")
    if not np.isfinite(rows).all():
        raise CommandError("loads: expected finite numbers.")
    return rows


def check_mass(mass: float, key: str = "mass") -> float:
    """Return a mass [kg]; `key` names it in messages.

    Raises:
        CommandError: not finite, or below 0.
    """
    if not (isinstance(mass, Real) and np.isfinite(mass) and mass >= 0.0):
        raise CommandError(f"{key}: expected a finite number of at least 0 kg, got {mass!r}.")
    return float(mass)


def mass_range(mass: float | tuple[float, float], key: str = "mass") -> tuple[float, float]:
    """Return the lightest and the heaviest mass [kg] of a number, which is a range of one value, or of a pair.

    Raises:
        CommandError: not finite, below 0, or a range whose first mass is the larger one.
    """
    low, high = ends_of(mass, key)
    return check_mass(low, key), check_mass(high, key)


def ends_of(value: object, key: str) -> tuple[Any, Any]:
    """Return both ends of a range; a number is a range of one value.

    Raises:
        CommandError: not a number or a pair (least, largest) in this order.
    """
    if not isinstance(value, tuple):
        return value, value
    if len(value) != 2 or not all(isinstance(end, Real) for end in value) or value[0] > value[1]:
        raise CommandError(f"{key}: expected a number, or a range (least, largest), got {value!r}.")
    return value[0], value[1]


@cache
def _icosahedron() -> tuple[FloatArray, float]:
    """Return the corners of an icosahedron on the unit sphere, shape (12, 3), and the radius of the ball inside it."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = np.array([[0.0, a, b * golden] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    corners = np.vstack([np.roll(corners, k, axis=1) for k in range(3)])
    inner = golden**2 / np.sqrt(3.0) / np.sqrt(1.0 + golden**2)
    return corners / np.sqrt(1.0 + golden**2), float(inner)
