"""Every command to hardware is checked before it is sent: numbers, joints, times, limits, speeds, fresh state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import DEFAULT_SPEED, Hand
from clench.models.hand.reading.tendons import TendonMap

from .driver import DriverLimits, HandState, JointPath, RefusedCommandError
from .joint_map import MappedJoint

#: Files, and conversions to other units, round: allowed excess over limits, as a fraction of their range [-].
ROUNDING = 1e-6
#: A joint may be found outside its limits by this much, and is only led back inside [rad].
MEASURED_OUTSIDE = 0.3
#: Times of a command rise by at least this [s]: messages count nanoseconds, and controllers refuse equal times.
SHORTEST = 1e-6


class NotFollowingError(RefusedCommandError):
    """Report that a joint is too far from its target.

    Args:
        sentence: one line. joint: the controller's name. told: targets of the joints. positions: their angles, by the
            controller's names and in its units.
    """

    def __init__(self, sentence: str, joint: str, told: float, positions: Mapping[str, float]) -> None:
        super().__init__(sentence)
        self.joint, self.told, self.positions = joint, told, positions


@dataclass(frozen=True)
class CommandLimits:
    """Limits of the commands to one joint, in the controller's units.

    Args:
        lower, upper: lowest and highest. velocity: largest speed [per second]. scale: units per radian, above 0.
        unit: its name.
    """

    lower: float
    upper: float
    velocity: float
    scale: float
    unit: str


def command_limits(hand: Hand, mapped: Mapping[str, MappedJoint], own: DriverLimits) -> dict[str, CommandLimits]:
    """Return the tightest limits of model, joint map and controller, by the controller's joint names.

    Args:
        hand: the model. mapped: its joints as the controller says them. own: the controller's limits.
    """
    found = {}
    for name, joint in mapped.items():
        model = hand.joints[hand.joint_index(name)]
        ends = sorted((joint.to_controller(model.lower), joint.to_controller(model.upper)))
        low, high = own.positions.get(joint.name, (-np.inf, np.inf))
        speed = (model.velocity or DEFAULT_SPEED) * abs(joint.scale)
        found[joint.name] = CommandLimits(
            lower=max(ends[0], low, -np.inf if joint.lower is None else joint.lower),
            upper=min(ends[1], high, np.inf if joint.upper is None else joint.upper),
            velocity=min(speed, own.velocities.get(joint.name, np.inf), joint.velocity or np.inf),
            scale=abs(joint.scale),
            unit=joint.unit,
        )
    return found


@dataclass(frozen=True)
class CommandCheck:
    """Check commands for a controller.

    Args:
        limits: of its joints, by its names. max_age: oldest state on which a command may be based [s].
        max_deviation: largest allowed distance of a joint from its target [rad].
    """

    limits: Mapping[str, CommandLimits]
    max_age: float
    max_deviation: float

    def state(self, state: HandState, expected: Mapping[str, float] | None = None) -> None:
        """Check that a state is fresh, complete, finite and near the targets.

        Raises:
            RefusedCommandError: a check fails; the message names it.
        """
        for name, limits in self.limits.items():
            age = state.age([name])
            if age < 0.0:
                raise RefusedCommandError(
                    f"The state of joint '{name}' is {age:.3g} s old, from the future; are its clock and ours the same?"
                )
            if not age <= self.max_age:
                raise RefusedCommandError(
                    f"The state of joint '{name}' is stale: {age:.2f} s old; at most {self.max_age:g} s is accepted."
                )
            if name not in state.positions:
                raise RefusedCommandError(f"The state of the hand says nothing of joint '{name}'.")
            value = state.positions[name]
            if not np.isfinite(value):
                raise RefusedCommandError(f"Joint '{name}' is said to be at {value} {limits.unit}.")
            if max(limits.lower - value, value - limits.upper) > MEASURED_OUTSIDE * limits.scale:
                raise RefusedCommandError(
                    f"Joint '{name}' is said to be at {value:.4g} {limits.unit}, far outside its limits "
                    f"[{limits.lower:.4g}, {limits.upper:.4g}] {limits.unit}; is the controller's unit right?"
                )
            if expected is not None and abs(value - expected[name]) > self.max_deviation * limits.scale:
                raise NotFollowingError(
                    f"Joint '{name}' does not follow: it is at {value:.4g} {limits.unit} and was told to be "
                    f"at {expected[name]:.4g} {limits.unit}.",
                    name,
                    expected[name],
                    state.positions,
                )

    def command(self, path: JointPath, start: Mapping[str, float]) -> None:
        """Check a path before it is sent.

        Args:
            path: the path to send. start: where the joints are told to be now.

        Raises:
            RefusedCommandError: a joint is unknown, a number is not finite, times do not rise, an angle is outside the
                limits, or a step is too fast; the message says which.
        """
        self._form(path)
        for j, name in enumerate(path.joints):
            limits = self.limits[name]
            margin = ROUNDING * (limits.upper - limits.lower) if np.isfinite(limits.upper - limits.lower) else 0.0
            column = path.positions[:, j]
            lower, upper = min(limits.lower, start[name]), max(limits.upper, start[name])
            outside = (column < lower - margin) | (column > upper + margin)
            if outside.any():
                raise RefusedCommandError(
                    f"Joint '{name}' would be told {column[outside][0]:.6g} {limits.unit}, outside its limits "
                    f"[{limits.lower:.6g}, {limits.upper:.6g}] {limits.unit}."
                )
            speed = _largest_speed(path.times, column, start[name])
            if speed > limits.velocity * (1.0 + ROUNDING) + ROUNDING:
                raise RefusedCommandError(
                    f"Joint '{name}' would be told to move at {speed:.4g} {limits.unit}/s; its limit is "
                    f"{limits.velocity:.4g} {limits.unit}/s."
                )

    def _form(self, path: JointPath) -> None:
        for name in path.joints:
            if name not in self.limits:
                known = ", ".join(self.limits)
                raise RefusedCommandError(f"Joint '{name}' is none of the controller's joints: {known}.")
        if path.positions.shape != (len(path.times), len(path.joints)) or not len(path.times):
            raise RefusedCommandError(f"A path of shape {path.positions.shape} does not fit its times and joints.")
        if not (np.isfinite(path.positions).all() and np.isfinite(path.times).all()):
            raise RefusedCommandError("A command holds a number that is not finite.")
        if (np.diff(path.times, prepend=0.0) < SHORTEST).any():
            raise RefusedCommandError("The times of a command do not rise from now on.")


def check_tensions(tensions: FloatArray, tendons: TendonMap) -> None:
    """Check tensions before they are sent.

    Args:
        tensions: [N], shape (T,). tendons: of the hand.

    Raises:
        RefusedCommandError: another number of tendons, a number that is not finite, or outside the limits.
    """
    if tensions.shape != (tendons.count,):
        raise RefusedCommandError(f"Expected {tendons.count} tensions, one a tendon, got shape {tensions.shape}.")
    for k, (tension, low, high) in enumerate(zip(tensions, tendons.t_min, tendons.t_max, strict=True)):
        # Written so that NaN fails.
        if not low - ROUNDING <= tension <= high + ROUNDING:
            raise RefusedCommandError(
                f"Tendon {k + 1} would be told {tension:.4g} N, outside its limits [{low:.4g}, {high:.4g}] N."
            )


def slowed_down(times: FloatArray, positions: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the times of way-points, stretched evenly where a joint would be faster than it may, shape (N,) [s].

    Args:
        times: shape (N,) [s]. positions: shape (N, J). speeds: largest of every joint, shape (J,).
    """
    if len(times) < 2:
        return times
    needed = np.abs(np.diff(positions, axis=0)) / np.diff(times)[:, None] / speeds
    return times * max(1.0, float(needed.max(initial=0.0)))


def _largest_speed(times: FloatArray, positions: FloatArray, start: float) -> float:
    steps = np.diff(positions, prepend=start) / np.diff(times, prepend=0.0)
    return float(np.abs(steps).max(initial=0.0))
