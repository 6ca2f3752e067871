"""Refuse trajectories that no plan has, or that are for another hand or grasp; a hand would be told them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from clench.core.exceptions import CommandError, FileError
from clench.core.pose import FloatArray
from clench.models.hand.reading.extremes import LARGEST_ANGLE
from clench.solver.preshapes.named_angles import posture

if TYPE_CHECKING:
    from clench.models.hand.hand import Hand
    from clench.solver.solution import GraspSolution

    from .trajectory import Trajectory

#: Slowest and fastest limits of velocity [rad/s] and acceleration [rad/s²].
RATES: Final = (1e-6, 1e6)
#: The longest time from the first way-point to the last [s].
LONGEST: Final = 1e6
#: Files and sums of times round: allowed excess over limits, as a fraction of them [-].
ROUNDING: Final = 1e-6
#: A trajectory ends at the solution's touch but for this much [rad].
_SAME: Final = 1e-6


def check_rates(source: str, speed: float, acceleration: float, limits: Sequence[float]) -> None:
    """Check the numbers that say how fast a trajectory may be.

    Args:
        source: the file, for messages. speed: fraction of the limits [-]. acceleration: [rad/s²].
        limits: of the velocities [rad/s].

    Raises:
        FileError: names the key and the expected value.
    """
    _check(source, "speed", speed, RATES[0], 1.0)
    _check(source, "acceleration", acceleration, *RATES)
    for i, limit in enumerate(limits):
        _check(source, f"velocity_limits[{i}]", limit, *RATES)


def check_points(source: str, points: Iterable[tuple[float, Sequence[float]]]) -> None:
    """Check the times [s] and angles [rad] of way-points; `source` names the file.

    Raises:
        FileError: names the key and the expected value.
    """
    for i, (time, angles) in enumerate(points):
        _check(source, f"points[{i}].time", time, 0.0, LONGEST)
        for j, angle in enumerate(angles):
            _check(source, f"points[{i}].positions[{j}]", angle, -LARGEST_ANGLE, LARGEST_ANGLE)


def check_joints(source: str, joints: Sequence[str]) -> None:
    """Check that joints differ; `source` names the file.

    Raises:
        FileError: one is named twice.
    """
    twice = next((name for i, name in enumerate(joints) if name in joints[:i]), None)
    if twice is not None:
        raise FileError(source, f"joints: '{twice}' is named twice.")


def check_velocities(
    source: str, joints: Sequence[str], times: FloatArray, positions: FloatArray, limits: FloatArray
) -> None:
    """Check that no joint is faster between two way-points than its limit.

    Args:
        source: the file, for messages. joints: names. times: [s], shape (N,), rising. positions: [rad], shape (N, J).
        limits: [rad/s], shape (J,).

    Raises:
        FileError: with the way-point and the joint.
    """
    rates = np.abs(np.diff(positions, axis=0)) / np.diff(times)[:, None]
    # Written so that NaN fails.
    wrong = np.argwhere(~(rates <= limits * (1.0 + ROUNDING)))
    if len(wrong):
        i, j = wrong[0]
        raise FileError(
            source,
            f"points[{i + 1}].positions[{j}]: joint '{joints[j]}' would move at {rates[i, j]:.4g} rad/s; its limit is "
            f"{limits[j]:.4g} rad/s.",
        )


def check_for_hand(trajectory: Trajectory, solution: GraspSolution, hand: Hand) -> None:
    """Check that a hand may be told a trajectory: its joints, within its limits, to the touch of the solution.

    Raises:
        CommandError: it may not; the message names the joint and the way-point.
    """
    if trajectory.hand != hand.name or tuple(trajectory.joints) != tuple(hand.joint_names):
        raise CommandError(
            f"trajectory: it is for hand '{trajectory.hand}' with joints {', '.join(trajectory.joints)}; expected "
            f"hand '{hand.name}' with joints {', '.join(hand.joint_names)}."
        )
    parts = [trajectory.positions, *(phase.positions for phase in trajectory.after)]
    limits = np.array([(joint.lower, joint.upper) for joint in hand.joints]).reshape(-1, 2)
    margin = ROUNDING * np.ptp(limits, axis=1)
    told = np.vstack(parts)
    wrong = np.argwhere(~((told >= limits[:, 0] - margin) & (told <= limits[:, 1] + margin)))
    if len(wrong):
        i, j = wrong[0]
        raise CommandError(
            f"trajectory: way-point {i} would tell joint '{hand.joint_names[j]}' {told[i, j]:.6g} rad, outside its "
            f"limits [{limits[j, 0]:.6g}, {limits[j, 1]:.6g}] rad."
        )
    touch = posture(solution.joint_angles, hand, "joint_angles")
    off = np.abs(trajectory.positions[-1] - touch)
    if len(off) and not off.max() <= _SAME:
        j = int(np.argmax(off))
        raise CommandError(
            f"trajectory: it ends with joint '{hand.joint_names[j]}' at {trajectory.positions[-1, j]:.6g} rad; the "
            f"touch of the solution is at {touch[j]:.6g} rad."
        )


def _check(source: str, key: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise FileError(source, f"{key}: expected a number from {least:g} to {most:g}, got {value:g}.")
