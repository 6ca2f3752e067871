"""Shapes written as text: ``"cylinder:r=0.03,h=0.1"``."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from clench.core.exceptions import ObjectError, UnknownNameError
from clench.models.shapes import Shape, ShapeKind

_TEXT = re.compile(r"[A-Za-z]{2,}:[^/\\]*")


@dataclass(frozen=True)
class _Form:
    keys: tuple[str, ...]
    size: Callable[..., tuple[float, float, float]]
    example: str


_FORMS: Final[Mapping[ShapeKind, _Form]] = {
    ShapeKind.SPHERE: _Form(("r",), lambda r: (r, 0.0, 0.0), "sphere:r=0.03"),
    ShapeKind.CYLINDER: _Form(("r", "h"), lambda r, h: (r, h / 2.0, 0.0), "cylinder:r=0.03,h=0.1"),
    ShapeKind.CAPSULE: _Form(("r", "h"), lambda r, h: (r, h / 2.0, 0.0), "capsule:r=0.02,h=0.1"),
    ShapeKind.BOX: _Form(("x", "y", "z"), lambda x, y, z: (x / 2.0, y / 2.0, z / 2.0), "box:x=0.1,y=0.05,z=0.03"),
    ShapeKind.ELLIPSOID: _Form(("a", "b", "c"), lambda a, b, c: (a, b, c), "ellipsoid:a=0.03,b=0.02,c=0.05"),
}


def is_shape_text(text: str) -> bool:
    """Return whether a text has the form of a shape; a drive letter or a path does not."""
    return _TEXT.fullmatch(text) is not None


def parse_shape(text: str) -> Shape:
    """Read a shape from text, at the origin, its axis along z.

    Keys in metres: sphere `r`; cylinder `r`, `h`; capsule `r`, `h` (of the straight part); box `x`, `y`, `z` (full
    lengths); ellipsoid `a`, `b`, `c` (semi-axes).

    Raises:
        UnknownNameError: no such shape. ObjectError: unknown, missing or repeated key, or not a number above 0.
    """
    kind_text, _, rest = text.partition(":")
    kinds = {str(kind): kind for kind in _FORMS}
    if kind_text.lower() not in kinds:
        raise UnknownNameError("shape", kind_text, f"the shapes that can be written as text ('{text}')", kinds)
    kind = kinds[kind_text.lower()]
    form = _FORMS[kind]
    values: dict[str, float] = {}
    for part in filter(None, (p.strip() for p in rest.split(","))):
        key, equals, number = (p.strip() for p in part.partition("="))
        if not equals:
            raise ObjectError(f"{text}: expected key=number, got '{part}'; write it like {form.example}.")
        if key not in form.keys:
            raise ObjectError(f"{text}: unknown key '{key}'; expected {', '.join(form.keys)}, like {form.example}.")
        if key in values:
            raise ObjectError(f"{text}: '{key}' is given twice.")
        values[key] = _length(number, key, text)
    missing = [key for key in form.keys if key not in values]
    if missing:
        raise ObjectError(f"{text}: '{missing[0]}' is missing; write it like {form.example}.")
    return Shape(kind, form.size(**values), name=text)


def _length(number: str, key: str, text: str) -> float:
    try:
        value = float(number)
    except ValueError:
        raise ObjectError(f"{text}: {key}: expected a length in metres, got '{number}'.") from None
    if not (math.isfinite(value) and value > 0):
        raise ObjectError(f"{text}: {key}: expected a finite length above 0 m, got {number}.")
    return value
