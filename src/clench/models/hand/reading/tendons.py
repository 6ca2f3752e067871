"""Tendons of a hand: which joints they pull, with which moment arms, and how hard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clench.core.exceptions import HandError
from clench.core.pose import FloatArray


@dataclass(frozen=True)
class TendonMap:
    """State tendon tensions: torques of `joints` are `moment_arms` times tensions.

    Args:
        joints: names of the joints that tendons pull.
        moment_arms: [m], one row a joint, one column a tendon; positive where tension turns the joint to larger angles.
        t_min, t_max: least and largest tension of every tendon [N].

    Raises:
        HandError: rows do not fit the joints, numbers are not finite, or tensions have no range.
    """

    joints: tuple[str, ...]
    moment_arms: tuple[tuple[float, ...], ...]
    t_min: tuple[float, ...]
    t_max: tuple[float, ...]

    def __post_init__(self) -> None:
        lengths = [len(row) for row in self.moment_arms]
        if len(lengths) != len(self.joints) or len(set(lengths)) != 1 or lengths[0] == 0:
            raise HandError(
                f"tendons.moment_arms: expected {len(self.joints)} rows (one a joint) of equally many numbers [m], "
                f"got {len(lengths)} rows of {lengths} numbers."
            )
        if not all(math.isfinite(arm) for row in self.moment_arms for arm in row):
            raise HandError("tendons.moment_arms: expected finite numbers [m].")
        for key, values in (("t_min", self.t_min), ("t_max", self.t_max)):
            if len(values) != lengths[0]:
                raise HandError(f"tendons.{key}: expected {lengths[0]} numbers, one a tendon, got {len(values)}.")
        for low, high in zip(self.t_min, self.t_max, strict=True):
            if not (math.isfinite(low) and 0.0 <= low < high):
                raise HandError(f"tendons: expected 0 <= t_min < t_max, got {low:g} N and {high:g} N.")

    @property
    def count(self) -> int:
        """Number of tendons."""
        return len(self.t_min)

    @property
    def bounded(self) -> tuple[str, ...]:
        """Names of the joints whose tendons all have a largest tension."""
        endless = np.isinf(self.t_max) & (np.array(self.moment_arms) != 0.0)
        return tuple(name for name, row in zip(self.joints, endless, strict=True) if not row.any())

    def arms_of(self, joint_names: Sequence[str]) -> FloatArray:
        """Return the moment arms of all joints of a hand, zero where no tendon pulls, shape (J, T) [m]."""
        arms = np.zeros((len(joint_names), self.count))
        for name, row in zip(self.joints, self.moment_arms, strict=True):
            arms[list(joint_names).index(name)] = row
        return arms


def model_tendons(model: Any, joint_of_model: dict[int, str]) -> TendonMap | None:
    """Return the fixed tendons of a model that actuators pull, None when there are none.

    A tendon whose actuator may pull both ways is two tendons, one each way (a loop around a pulley). Tendons of joints
    outside the hand, and spatial tendons, whose moment arms change with the posture, are left out.

    Args:
        model: `mujoco.MjModel`. joint_of_model: name of the hand's joints by MuJoCo's joint number.
    """
    import mujoco

    from .kinematics import actuator_forces, fixed_tendon

    columns: list[dict[str, float]] = []
    most: list[float] = []
    for a in range(model.nu):
        if model.actuator_trntype[a] != mujoco.mjtTrn.mjTRN_TENDON:
            continue
        terms = fixed_tendon(model, int(model.actuator_trnid[a, 0]))
        if not terms or any(j not in joint_of_model for j, _ in terms):
            continue
        gear = float(model.actuator_gear[a, 0])
        for force in actuator_forces(model, a):
            if force != 0.0:
                columns.append({joint_of_model[j]: math.copysign(1.0, force) * gear * c for j, c in terms})
                most.append(abs(force))
    if not columns:
        return None
    joints = tuple(name for name in joint_of_model.values() if any(name in column for column in columns))
    arms = tuple(tuple(column.get(name, 0.0) for column in columns) for name in joints)
    return TendonMap(joints, arms, (0.0,) * len(columns), tuple(most))
