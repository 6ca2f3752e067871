"""A controller's joints in a small file: names, units, offsets, limits (TOML, schema in docs/controllers.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.core.files.toml_files import read_toml
from clench.core.numbers import is_finite_number
from clench.core.showing.short_repr import short_repr
from clench.models.hand.hand import Hand

#: Units of a controller by name: how many of them one radian is.
UNITS: Final[Mapping[str, float]] = {"rad": 1.0, "deg": 180.0 / math.pi, "turn": 0.5 / math.pi}
_KEYS: Final = ("name", "unit", "scale", "direction", "offset", "lower", "upper", "velocity")


@dataclass(frozen=True)
class MappedJoint:
    """Tell how a controller says a joint's angle: `value = scale * angle + offset`.

    Args:
        name: the controller's name. scale: units of the controller per radian, negative when it turns the other way.
        offset: the controller's value at 0 rad. lower, upper: limits of the controller's value, None: only the hand's
            limits.
        velocity: largest speed [units per second], None: only the hand's. unit: names the unit in messages.
    """

    name: str
    scale: float = 1.0
    offset: float = 0.0
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    unit: str = "rad"

    def to_controller(self, angle: float) -> float:
        """Return the controller's value for an angle [rad]."""
        return self.scale * angle + self.offset

    def to_angle(self, value: float) -> float:
        """Return the angle [rad] for the controller's value."""
        return (value - self.offset) / self.scale


@dataclass(frozen=True)
class JointMap:
    """Map the joints of a hand's model to those of a controller.

    Args:
        joints: by the model's names; None: the controller has the model's names and radians.
        source: names the file in messages.
    """

    joints: Mapping[str, MappedJoint] | None = None
    source: str = "joint map"

    __repr__ = short_repr

    @classmethod
    def load(cls, path: str | Path) -> JointMap:
        """Read a joint map (TOML).

        Raises:
            FileError: missing, not TOML, or a malformed key, which the message names.
        """
        return joint_map_from_dict(read_toml(path), str(path))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], source: str = "joint map") -> JointMap:
        """Read the form of a joint map; `source` names it in messages.

        Raises:
            FileError: unknown, missing or malformed key.
        """
        return joint_map_from_dict(data, source)

    def of(self, hand: Hand) -> dict[str, MappedJoint]:
        """Return the mapping of every joint that the controller may move, by the model's names.

        Followers are left out unless the map names them: the mechanism moves them.

        Raises:
            UnknownNameError: the map names a joint that the hand does not have.
            CommandError: the map leaves out a joint that follows no other one.
        """
        followers = {hand.joints[c.follower].name for c in hand.couplings}
        if self.joints is None:
            return {name: MappedJoint(name) for name in hand.joint_names if name not in followers}
        for name in self.joints:
            if name not in hand.joint_names:
                raise UnknownNameError("joint", name, f"hand '{hand.name}' ({self.source})", hand.joint_names)
        missing = [n for n in hand.joint_names if n not in self.joints and n not in followers]
        if missing:
            raise CommandError(f"{self.source}: joints.{missing[0]}: missing; every joint of '{hand.name}' is needed.")
        return {name: self.joints[name] for name in hand.joint_names if name in self.joints}


def joint_map_from_dict(data: Any, source: str = "joint map") -> JointMap:
    """Read the form of a joint map.

    Raises:
        FileError: unknown, missing or malformed key.
    """
    for key in data:
        if key not in ("unit", "joints"):
            raise FileError(source, f"{key}: unknown key; expected 'unit' or 'joints'.")
    unit = data.get("unit", "rad")
    _scale(unit, "unit", source)
    tables = data.get("joints")
    if not isinstance(tables, dict) or not tables:
        raise FileError(source, "joints: expected a table [joints.NAME] for every joint.")
    joints = {name: _joint(name, table, unit, source) for name, table in tables.items()}
    names = [joint.name for joint in joints.values()]
    for name in names:
        if names.count(name) > 1:
            raise FileError(source, f"joints: two joints have the controller's name '{name}'.")
    return JointMap(joints, source)


def _joint(name: str, table: Any, unit: str, source: str) -> MappedJoint:
    key = f"joints.{name}"
    if not isinstance(table, dict):
        raise FileError(source, f"{key}: expected a table, got {table!r}.")
    for part in table:
        if part not in _KEYS:
            raise FileError(source, f"{key}.{part}: unknown key; expected one of {', '.join(_KEYS)}.")
    numbers = _Numbers(table, key, source)
    if "scale" in table and "unit" in table:
        raise FileError(source, f"{key}: 'unit' and 'scale' say the same; give one of them.")
    own = table.get("unit", unit)
    scale = numbers.read("scale", _scale(own, f"{key}.unit", source))
    direction = numbers.read("direction", 1.0)
    if abs(direction) != 1.0:
        raise FileError(source, f"{key}.direction: expected 1 or -1, got {direction:g}.")
    if scale == 0.0:
        raise FileError(source, f"{key}.scale: expected units per radian other than 0.")
    called = table.get("name", name)
    if not isinstance(called, str) or not called:
        raise FileError(source, f"{key}.name: expected the controller's name, got {called!r}.")
    lower, upper, velocity = numbers.optional("lower"), numbers.optional("upper"), numbers.optional("velocity")
    if lower is not None and upper is not None and lower >= upper:
        raise FileError(source, f"{key}.lower: expected less than upper ({upper:g}), got {lower:g}.")
    if velocity is not None and velocity <= 0.0:
        raise FileError(source, f"{key}.velocity: expected more than 0, got {velocity:g}.")
    unit = "units" if "scale" in table else own
    return MappedJoint(called, scale * direction, numbers.read("offset", 0.0), lower, upper, velocity, unit)


@dataclass(frozen=True)
class _Numbers:
    table: Mapping[str, Any] = field(default_factory=dict)
    key: str = ""
    source: str = ""

    def optional(self, name: str) -> float | None:
        if name not in self.table:
            return None
        value = self.table[name]
        if not is_finite_number(value):
            raise FileError(self.source, f"{self.key}.{name}: expected a finite number, got {value!r}.")
        return float(value)

    def read(self, name: str, default: float) -> float:
        value = self.optional(name)
        return default if value is None else value


def _scale(value: Any, key: str, source: str) -> float:
    if not isinstance(value, str) or value not in UNITS:
        raise FileError(source, f"{key}: expected one of {', '.join(UNITS)}, got {value!r}.")
    return UNITS[value]
