"""The calibration: weights, scales and limits of the criteria, from a small commented TOML file or a preset."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import ClenchError, CommandError, FileError, UnknownNameError
from clench.core.files.toml_files import read_toml
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr

from .criterion_registry import check_numbers, find_criterion

#: The preset that is used when a command names no criteria.
DEFAULT_PRESET: Final = "balanced"
_PRESETS: Final = Path(__file__).parent / "presets"
_TABLES: Final = ("weights", "scales", "limits", "joints")


@dataclass(frozen=True)
class Calibration:
    """The weights, scales and limits of the criteria in the choice.

    Args:
        name: of the preset or file. weights: of the criteria in the sum, at least 0.
        scales: the value that counts as 1, above 0, if it differs from the criterion's own.
        limits: the least value if more is better, else the largest value; candidates beyond a limit come last.
        joints: weight of a joint in the range of motion, 1 where not named.
    """

    name: str = "weights"
    weights: Mapping[str, float] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)

    __repr__ = short_repr

    @property
    def criteria(self) -> tuple[str, ...]:
        """Names of the criteria with a weight above 0 or with a limit."""
        weighted = [name for name, weight in self.weights.items() if weight > 0.0]
        return tuple(dict.fromkeys([*weighted, *self.limits]))

    def scale(self, name: str) -> float:
        """Return the value of a criterion that counts as 1."""
        return self.scales.get(name) or find_criterion(name, self.name).scale

    def worth(self, name: str, value: float) -> float:
        """Return the contribution of a value to the weighted sum, in which more is better [-]."""
        sign = 1.0 if find_criterion(name, self.name).larger_is_better else -1.0
        return sign * self.weights.get(name, 0.0) * value / self.scale(name)

    def allows(self, name: str, value: float | None) -> bool:
        """Say whether a value is inside the criterion's limit; an unknown value is not."""
        if name not in self.limits:
            return True
        return value is not None and bool(self.inside(name, np.array(value)))

    def inside(self, name: str, values: FloatArray) -> NDArray[np.bool_]:
        """Say which values are inside the criterion's limit."""
        larger = find_criterion(name, self.name).larger_is_better
        limit = self.limits.get(name, -np.inf if larger else np.inf)
        return np.asarray(values >= limit if larger else values <= limit)


def calibration_of(criteria: Mapping[str, float] | Path | str | None) -> Calibration:
    """Return the calibration that a command asks for: weights, a preset by name, a file, or the default preset.

    Raises:
        FileError: a file that is missing or malformed. UnknownNameError: no such preset or criterion.
        CommandError: a number out of range, weights of which none is above 0.
    """
    if criteria is None:
        return load_preset(DEFAULT_PRESET)
    if isinstance(criteria, Mapping):
        calibration = Calibration("criteria", check_numbers(criteria, "criteria", 0.0, above=False))
        if not calibration.criteria:
            raise CommandError("criteria: nothing counts in the choice; expected a weight above 0.")
        return calibration
    if isinstance(criteria, str) and not set(criteria) & set("./\\~"):
        return load_preset(criteria)
    return load_calibration(Path(criteria))


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets that come with the package."""
    return tuple(sorted(path.stem for path in _PRESETS.glob("*.toml")))


@cache
def load_preset(name: str) -> Calibration:
    """Return a preset.

    Raises:
        UnknownNameError: there is none of this name.
    """
    if name not in preset_names():
        raise UnknownNameError(
            "preset", name, "clench's criteria presets (a file is named with its ending)", preset_names()
        )
    return load_calibration(_PRESETS / f"{name}.toml", name)


def load_calibration(path: Path, name: str | None = None) -> Calibration:
    """Read a calibration file: tables [weights], [scales], [limits] of numbers by criterion, [joints] by joint.

    Args:
        path: the file. name: name of the calibration; its path by default.

    Raises:
        FileError: the file is missing, is not TOML, has unknown keys, or has neither a weight above 0 nor a limit.
    """
    missing = f"no such calibration file; presets, by name alone: {', '.join(preset_names())}."
    data = read_toml(path, missing, "a calibration file in TOML")
    unknown = sorted(set(data) - set(_TABLES))
    if unknown:
        listed = ", ".join(f"[{table}]" for table in _TABLES)
        raise FileError(path, f"unknown key '{unknown[0]}'; expected tables {listed}.")
    tables = {table: _numbers(path, table, data.get(table, {})) for table in _TABLES}
    try:
        calibration = Calibration(
            name or str(path),
            check_numbers(tables["weights"], "weights", 0.0, above=False),
            check_numbers(tables["scales"], "scales", 0.0, above=True),
            check_numbers(tables["limits"], "limits", float("-inf"), above=False),
            _check_joints(tables["joints"]),
        )
    except ClenchError as error:
        raise FileError(path, str(error)) from None
    if not calibration.criteria:
        raise FileError(path, "nothing counts in the choice; expected a weight above 0 in [weights], or [limits].")
    return calibration


def calibration_to_toml(calibration: Calibration, comments: Mapping[str, str] | None = None) -> str:
    """Return the text of a calibration file, every criterion with its unit and direction as a comment.

    Args:
        calibration: the calibration to write. comments: a sentence before each table, by the table's name; "" is the
            head of the file.
    """
    said = comments or {}
    blocks = [f"# {said['']}\n"] if said.get("") else []
    for table in _TABLES:
        values: Mapping[str, float] = getattr(calibration, table)
        if values:
            head = f"# {said[table]}\n" if said.get(table) else ""
            rows = "".join(f"{_key(name)} = {value!r}{_remark(table, name)}\n" for name, value in values.items())
            blocks.append(f"{head}[{table}]\n{rows}")
    return "\n".join(blocks)


def _remark(table: str, name: str) -> str:
    if table == "joints":
        return ""
    criterion = find_criterion(name, table)
    return f"  # {criterion.unit}, {'more' if criterion.larger_is_better else 'less'} is better"


def _key(name: str) -> str:
    """Return a name as a key of TOML, quoted if necessary."""
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


def _numbers(path: Path, table: str, values: Any) -> dict[str, float]:
    if not isinstance(values, dict) or not all(_is_number(value) for value in values.values()):
        raise FileError(
            path, f"expected a table [{table}] of numbers by {'joint' if table == 'joints' else 'criterion'}."
        )
    return {name: float(value) for name, value in values.items()}


def _check_joints(values: Mapping[str, float]) -> dict[str, float]:
    """Refuse joint weights below 0; whether the joints exist is for the hand to say."""
    for name, value in values.items():
        if not 0.0 <= value < float("inf"):
            raise ClenchError(f"joints.{name}: expected a weight of at least 0, got {value!r}.")
    return dict(values)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
