"""Print objects in a few lines: names and numbers as they are, and of arrays and long lists only the size."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from enum import Enum
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.pose import Pose

#: The longest text has so many lines of so many characters.
_LINES: Final = 5
_WIDTH: Final = 110
#: Sequences and mappings with more items are shown by their number.
_ITEMS: Final = 6
_LONGEST_TEXT: Final = 160
_PLAIN: Final = str | bool | int | float | None


def short_repr(value: Any) -> str:
    """Return the fields of a dataclass that differ from their defaults, in one to five lines.

    A class uses this function by ``__repr__ = short_repr``.
    """
    shown = {}
    for field in fields(value):
        default = field.default if field.default_factory is MISSING else field.default_factory()
        each = getattr(value, field.name)
        if field.repr and not field.name.startswith("_") and not _same(each, default):
            shown[field.name] = each
    return described(value, **shown)


def described(value: object, **shown: Any) -> str:
    """Return the name of an object's class with some values, in one to five lines."""
    text = f"{type(value).__name__}({', '.join(f'{name}={_brief(each)}' for name, each in shown.items())})"
    lines = textwrap.wrap(" ".join(text.split()), _WIDTH, subsequent_indent="    ", break_on_hyphens=False)
    if len(lines) > _LINES:
        lines = [*lines[: _LINES - 1], lines[_LINES - 1][: _WIDTH - 5] + " ...)"]
    return "\n".join(lines)


def _same(value: Any, default: Any) -> bool:
    if isinstance(value, _PLAIN | tuple | dict) and type(value) is type(default):
        return bool(value == default)
    return value is default


def _brief(value: Any) -> str:
    """Return a value in less than a line."""
    if isinstance(value, Enum):
        return _brief(value.value)
    if isinstance(value, str | Path):
        text = str(value)
        return repr(text if len(text) <= _LONGEST_TEXT else f"{text[: _LONGEST_TEXT - 4]} ...")
    if isinstance(value, bool | int | np.integer | np.bool_ | None):
        return str(value)
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    if isinstance(value, np.ndarray):
        few = value.ndim == 1 and value.size <= _ITEMS
        return _brief(value.tolist()) if few else f"array{value.shape}"
    if isinstance(value, Pose):
        return f"Pose({_brief(value.position)}, wxyz={_brief(value.wxyz)})"
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>"
    if isinstance(value, Mapping):
        return _brief_mapping(value)
    if isinstance(value, Sequence):
        return _brief_sequence(value)
    name = getattr(value, "name", None)
    return f"{type(value).__name__}({name!r})" if isinstance(name, str) else f"{type(value).__name__}(...)"


def _brief_mapping(items: Mapping[Any, Any]) -> str:
    if len(items) > _ITEMS or not all(isinstance(each, _PLAIN | np.floating) for each in items.values()):
        return f"{{{len(items)} items}}"
    return f"{{{', '.join(f'{_brief(key)}: {_brief(each)}' for key, each in items.items())}}}"


def _brief_sequence(items: Sequence[Any]) -> str:
    if len(items) <= _ITEMS and all(isinstance(each, _PLAIN | np.floating | Path) for each in items):
        return f"[{', '.join(map(_brief, items))}]"
    kinds = sorted({type(each).__name__ for each in items})
    return f"[{len(items)} {' or '.join(kinds)}]"
