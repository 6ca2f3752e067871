"""Read the hand file: TOML that overrides the findings from a model, validated with the same care."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clench.core.exceptions import FileError, HandError, guessed
from clench.core.files.toml_files import read_toml
from clench.core.numbers import is_finite_number
from clench.models.hand.reading.tendons import TendonMap
from clench.models.shapes import CollisionSource

from .hand import JointRole


@dataclass(frozen=True)
class FingerOverride:
    """Override a finger: its own joints (palm side first), its tip link, whether it is a thumb."""

    joints: tuple[str, ...] | None = None
    tip: str | None = None
    thumb: bool | None = None


@dataclass(frozen=True)
class JointOverride:
    """Override a joint: role, direction, open value [rad], limits [rad], effort [Nm], and its leader (`""`: none)."""

    role: JointRole | None = None
    direction: int | None = None
    open_value: float | None = None
    limits: tuple[float, float] | None = None
    effort: float | None = None
    follows: str | None = None
    ratio: float = 1.0
    offset: float = 0.0
    breakaway: bool = False


@dataclass(frozen=True)
class LinkOverride:
    """Override a link: pad indentation [m], sliding friction [-]."""

    pad_indentation: float = 0.0
    friction: float | None = None


@dataclass(frozen=True)
class HandFile:
    """The overrides of a hand file; empty when there is none.

    Args:
        path: the file, or None.
        palm, collision_source: see `Hand.load`.
        fingers, joints, links: overrides by name. allowed_pairs: names of links that may overlap.
        tendons: see `TendonMap`.
    """

    path: Path | None = None
    palm: str | None = None
    collision_source: CollisionSource | None = None
    fingers: Mapping[str, FingerOverride] = field(default_factory=dict)
    joints: Mapping[str, JointOverride] = field(default_factory=dict)
    links: Mapping[str, LinkOverride] = field(default_factory=dict)
    allowed_pairs: tuple[tuple[str, str], ...] = ()
    tendons: TendonMap | None = None


def find_hand_file(model: Path | None, hand_file: str | Path | None) -> HandFile:
    """Read the named hand file, or `<model>.hand.toml` beside the model when it exists.

    Raises:
        FileError: missing or malformed, with the key.
    """
    if hand_file is not None:
        return read_hand_file(Path(hand_file))
    if model is not None:
        for name in (f"{model.stem}.hand.toml", f"{model.name}.hand.toml"):
            if (model.parent / name).is_file():
                return read_hand_file(model.parent / name)
    return HandFile()


def read_hand_file(path: Path) -> HandFile:
    """Read and validate a hand file; names of links and joints are checked against the model later.

    Raises:
        FileError: missing, not TOML, an unknown key or a value of another kind, with the key.
    """
    top = _Table(path, "", read_toml(path, "no hand file can be read here."))
    top.allow("palm", "collision_source", "fingers", "joints", "links", "allowed_pairs", "tendons")
    source = top.choice("collision_source", [str(s) for s in CollisionSource])
    return HandFile(
        path=path,
        palm=top.text("palm"),
        collision_source=None if source is None else CollisionSource(source),
        fingers={name: _finger(table) for name, table in top.tables("fingers")},
        joints={name: _joint(table) for name, table in top.tables("joints")},
        links={name: _link(table) for name, table in top.tables("links")},
        allowed_pairs=_pairs(top),
        tendons=_tendons(top),
    )


def _finger(table: _Table) -> FingerOverride:
    table.allow("joints", "tip", "thumb")
    return FingerOverride(joints=table.texts("joints"), tip=table.text("tip"), thumb=table.flag("thumb"))


def _joint(table: _Table) -> JointOverride:
    table.allow("role", "direction", "open", "limits", "effort", "follows", "ratio", "offset", "breakaway")
    role = table.choice("role", ["closing", "posture"])
    direction = table.number("direction")
    if direction is not None and direction not in (1.0, -1.0):
        raise table.error("direction", "1 or -1", table.data["direction"])
    follows = table.text("follows")
    for key in ("ratio", "offset", "breakaway"):
        if key in table.data and not follows:
            raise FileError(table.path, f"{table.key(key)}: has a meaning only together with 'follows'.")
    effort = table.number("effort")
    if effort is not None and effort <= 0.0:
        raise table.error("effort", "a torque above 0 [Nm]", effort)
    ratio = table.number("ratio")
    if ratio == 0.0:
        raise table.error("ratio", "a number other than 0", 0.0)
    return JointOverride(
        role=None if role is None else JointRole(role),
        direction=None if direction is None else int(direction),
        open_value=table.number("open"),
        limits=_limits(table),
        effort=effort,
        follows=follows,
        ratio=1.0 if ratio is None else ratio,
        offset=table.number("offset") or 0.0,
        breakaway=table.flag("breakaway") or False,
    )


def _limits(table: _Table) -> tuple[float, float] | None:
    value = table.data.get("limits")
    if "limits" not in table.data:
        return None
    if not (isinstance(value, list) and len(value) == 2 and all(map(is_finite_number, value)) and value[0] <= value[1]):
        raise table.error("limits", "two angles, the lower one first [rad]", value)
    return float(value[0]), float(value[1])


def _link(table: _Table) -> LinkOverride:
    table.allow("pad_indentation", "friction")
    values = {key: table.number(key) for key in ("pad_indentation", "friction")}
    for key, value in values.items():
        if value is not None and value < 0.0:
            raise table.error(key, "a number of at least 0", value)
    if values["friction"] == 0.0:
        raise table.error("friction", "a number above 0", 0.0)
    return LinkOverride(values["pad_indentation"] or 0.0, values["friction"])


def _pairs(top: _Table) -> tuple[tuple[str, str], ...]:
    value = top.data.get("allowed_pairs", [])
    ok = isinstance(value, list) and all(
        isinstance(pair, list) and len(pair) == 2 and all(isinstance(name, str) for name in pair) for pair in value
    )
    if not ok:
        raise top.error("allowed_pairs", 'a list of pairs of link names, e.g. [["a", "b"]]', value)
    return tuple((a, b) for a, b in value)


def _tendons(top: _Table) -> TendonMap | None:
    if "tendons" not in top.data:
        return None
    table = _Table(top.path, "tendons", top.data["tendons"])
    table.allow("joints", "moment_arms", "t_min", "t_max")
    joints = table.texts("joints") or ()
    rows = table.data.get("moment_arms")
    width = len(rows[0]) if isinstance(rows, list) and rows and isinstance(rows[0], list) else 0
    ok = isinstance(rows, list) and len(rows) == len(joints) > 0 and width > 0
    if not ok or not all(
        isinstance(r, list) and len(r) == width and all(is_finite_number(x) for x in r) for r in rows or []
    ):
        raise table.error("moment_arms", f"{len(joints)} rows (one a joint) of equally many numbers [m]", rows)
    low, high = (_tensions(table, key, missing, width) for key, missing in (("t_min", 0.0), ("t_max", math.inf)))
    arms = tuple(tuple(float(x) for x in row) for row in rows or [])
    try:
        return TendonMap(joints, arms, low, high)
    except HandError as error:
        raise FileError(top.path, str(error)) from None


def _tensions(table: _Table, key: str, missing: float, count: int) -> tuple[float, ...]:
    """Return one number for every tendon: the numbers of a list, or one number for all."""
    value = table.data.get(key, missing)
    if isinstance(value, list) and len(value) == count and all(map(is_finite_number, value)):
        return tuple(float(v) for v in value)
    if key in table.data and not is_finite_number(value):
        raise table.error(key, f"a finite number, or a list of {count} (one a tendon) [N]", value)
    return (float(value),) * count


@dataclass(frozen=True)
class _Table:
    """Read typed values of one TOML table; every message names file and key."""

    path: Path
    prefix: str
    data: Any

    def __post_init__(self) -> None:
        if not isinstance(self.data, dict):
            raise FileError(self.path, f"{self.prefix}: expected a table [{self.prefix}], got {self.data!r}.")

    def key(self, name: str) -> str:
        return f"{self.prefix}.{name}" if self.prefix else name

    def error(self, name: str, expected: str, value: object) -> FileError:
        return FileError(self.path, f"{self.key(name)}: expected {expected}, got {value!r}.")

    def allow(self, *names: str) -> None:
        for name in self.data:
            if name not in names:
                guess = guessed(name, names)
                raise FileError(self.path, f"{self.key(name)}: unknown key; expected one of {', '.join(names)}.{guess}")

    def tables(self, name: str) -> list[tuple[str, _Table]]:
        inner = _Table(self.path, name, self.data.get(name, {}))
        return [(k, _Table(self.path, f"{name}.{k}", v)) for k, v in inner.data.items()]

    def text(self, name: str) -> str | None:
        value = self._typed(name, "a text in quotes", lambda v: isinstance(v, str))
        return None if value is None else str(value)

    def flag(self, name: str) -> bool | None:
        value = self._typed(name, "true or false", lambda v: isinstance(v, bool))
        return None if value is None else bool(value)

    def texts(self, name: str) -> tuple[str, ...] | None:
        def check(value: Any) -> bool:
            return isinstance(value, list) and len(value) > 0 and all(isinstance(v, str) for v in value)

        value = self._typed(name, "a list of names", check)
        return None if value is None else tuple(value)

    def number(self, name: str) -> float | None:
        value = self._typed(name, "a finite number", is_finite_number)
        return None if value is None else float(value)

    def choice(self, name: str, allowed: list[str]) -> str | None:
        value = self.text(name)
        if value is not None and value not in allowed:
            raise self.error(name, f"one of {', '.join(allowed)}", value)
        return value

    def _typed(self, name: str, expected: str, check: Callable[[Any], bool]) -> Any:
        value = self.data.get(name)
        if name in self.data and not check(value):
            raise self.error(name, expected, value)
        return value
