"""Convert values of a document that was read; a refusal names the file and the key."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NoReturn, TypeVar

import msgspec
import numpy as np

from clench.core.exceptions import ClenchError, FileError
from clench.core.pose import Pose

_T = TypeVar("_T")


def read_numbers(
    value: Mapping[str, Any], key: str, source: str, least: float = -math.inf, most: float = math.inf
) -> dict[str, float]:
    """Return numbers by name, each from `least` to `most`."""
    found = {name: convert(v, float, source, f"{key}.{name}") for name, v in value.items()}
    for name, number in found.items():
        if not least <= number <= most:
            raise FileError(source, f"{key}.{name}: expected a number from {least:g} to {most:g}, got {number:g}.")
    return found


def read_limits(value: Any, source: str, key: str) -> tuple[float, float]:
    """Return a lower and an upper limit."""
    low, high = convert(value, tuple[float, float], source, key)
    if low > high:
        raise FileError(source, f"{key}: expected the lower limit first, got [{low:g}, {high:g}].")
    return low, high


def check_said(value: dict[str, Any] | None, keys: tuple[str, ...], source: str, where: str) -> None:
    """Refuse a free-form value that lacks one of some texts, which messages and tables print."""
    for key in () if value is None else keys:
        if value is not None and not isinstance(value.get(key), str):
            raise FileError(source, f"{where}.{key}: {'expected text' if key in value else 'missing'}.")


def read_pose(data: Any, source: str, key: str) -> Pose:
    """Return a pose with the quaternion exactly as written, to the last bit, if it is a unit quaternion."""
    try:
        pose = Pose.from_dict(data, key)
    except ClenchError as error:
        raise FileError(source, str(error)) from None
    written = np.array(data.get("wxyz", pose.wxyz), dtype=np.float64)
    if np.allclose(written, pose.wxyz, rtol=0.0, atol=4e-16):
        # Normalising a unit quaternion again may change its last bit: keep the written one.
        exact = np.concatenate([written, pose.position])
        exact.flags.writeable = False
        object.__setattr__(pose, "wxyz_xyz", exact)
    return pose


def convert(value: Any, kind: type[_T], source: str, key: str) -> _T:
    """Return the value as the type that the schema states."""
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        _refuse(str(error), source, key)


def _refuse(message: str, source: str, key: str) -> NoReturn:
    """Turn "Expected `float`, got `str` - at `$.gap`" into a sentence that starts with the whole key."""
    problem, _, place = message.partition(" - at `$")
    path = (key + place.rstrip("`")).lstrip(".")
    problem = problem[:1].lower() + problem[1:].replace("`", "'")
    raise FileError(source, f"{path}: {problem}." if path else f"{problem}.")
