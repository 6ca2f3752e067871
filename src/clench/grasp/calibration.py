"""Read the weights of the criteria from a small TOML file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

from clench.base.errors import ClenchError, FileError

from .criteria import DEFAULT_WEIGHTS, check_weights


def weights_of(criteria: Mapping[str, float] | Path | str | None) -> dict[str, float]:
    """Return the weights that a command asks for: given ones, those of a file, or the default.

    Raises:
        FileError: a file that is missing or malformed. UnknownNameError, CommandError: see `check_weights`.
    """
    if criteria is None:
        return dict(DEFAULT_WEIGHTS)
    if isinstance(criteria, Mapping):
        return check_weights(criteria, "criteria")
    return load_calibration(Path(criteria))


def load_calibration(path: Path) -> dict[str, float]:
    """Read `[weights]` of a calibration file: `criterion = number`.

    Raises:
        FileError: missing, not TOML, or with other keys.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileError(path, "no such calibration file.") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FileError(path, f"not a calibration file in TOML: {error}.") from None
    unknown = sorted(set(data) - {"weights"})
    if unknown:
        raise FileError(path, f"unknown key '{unknown[0]}'; expected a table [weights].")
    weights = data.get("weights", {})
    if not isinstance(weights, dict) or not all(_is_number(w) for w in weights.values()):
        raise FileError(path, "expected a table [weights] of numbers by criterion.")
    try:
        return check_weights({name: float(w) for name, w in weights.items()}, "weights")
    except ClenchError as error:
        raise FileError(path, str(error)) from None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
