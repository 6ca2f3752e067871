"""Values of known classes as arrays of numbers, and back: what `kept_arrays` keeps of more than arrays.

The first array holds everything but the arrays of the value, as bytes of MessagePack. Objects and arrays that are
shared inside the value stay shared. A class is written by its name, and read only if the reader knows the name: no code
is named in the bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, Final

import msgspec
import numpy as np

from .kept_arrays import Arrays

Classes = Mapping[str, type[Any]]

#: Types that MessagePack gives back as they were.
_PLAIN: Final = (type(None), bool, int, float, str)
#: What is at the beginning of a row: the kind of value that the rest of the row makes.
_TUPLE, _LIST, _MAPPING, _ARRAY, _MEMBER, _OBJECT, _AGAIN = range(7)


def as_arrays(value: Any, classes: Classes) -> Arrays:
    """Return a value as arrays, the first of which describes it.

    Args:
        value: plain values, arrays, tuples, lists, dictionaries, members of enumerations, dataclasses.
        classes: the enumerations and dataclasses, by name.

    Raises:
        TypeError: a value of another type. ValueError: a text or a number that MessagePack does not have.
    """
    writer = _Writer(classes)
    try:
        described = msgspec.msgpack.encode(writer.row(value))
    except (OverflowError, UnicodeError) as error:
        raise ValueError(f"cannot be written ({error}).") from None
    return [np.frombuffer(described, dtype=np.uint8), *writer.arrays]


def from_arrays(arrays: Arrays, classes: Classes) -> Any:
    """Return the value that `as_arrays` wrote.

    Raises:
        ValueError: the arrays describe no value of these classes.
    """
    try:
        return _Reader(classes, arrays[1:]).value(msgspec.msgpack.decode(arrays[0].tobytes()))
    except (msgspec.DecodeError, LookupError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"describes no value of the known classes ({error}).") from None


class _Writer:
    """Turn values to rows; arrays and objects that were met before are named by their number."""

    def __init__(self, classes: Classes) -> None:
        self.arrays: Arrays = []
        self._names = {kind: name for name, kind in classes.items()}
        self._numbers: dict[int, int] = {}

    def row(self, value: Any) -> Any:
        kind = type(value)
        if kind in _PLAIN:
            return value
        if kind is tuple:
            return [_TUPLE, *map(self.row, value)]
        if kind is list:
            return [_LIST, *map(self.row, value)]
        if kind is dict:
            return [_MAPPING, *(self.row(part) for pair in value.items() for part in pair)]
        if id(value) in self._numbers:
            return [_AGAIN, self._numbers[id(value)]]
        row = self._new_row(value, kind)
        self._numbers[id(value)] = len(self._numbers)
        return row

    def _new_row(self, value: Any, kind: type[Any]) -> list[Any]:
        if kind is np.ndarray:
            self.arrays.append(value)
            return [_ARRAY, len(self.arrays) - 1]
        if kind not in self._names:
            raise TypeError(f"expected plain values, arrays and known classes, got {kind.__name__}.")
        if isinstance(value, Enum):
            return [_MEMBER, self._names[kind], self.row(value.value)]
        if not is_dataclass(value):
            raise TypeError(f"expected a dataclass or an enumeration, got {kind.__name__}.")
        return [_OBJECT, self._names[kind], *(self.row(getattr(value, field.name)) for field in fields(value))]


class _Reader:
    """Turn rows to values again."""

    def __init__(self, classes: Classes, arrays: Arrays) -> None:
        self._classes = classes
        self._arrays = arrays
        self._met: list[Any] = []

    def value(self, row: Any) -> Any:
        if type(row) is not list:
            return row
        kind, *rest = row
        if kind == _TUPLE:
            return tuple(map(self.value, rest))
        if kind == _LIST:
            return list(map(self.value, rest))
        if kind == _MAPPING:
            parts = list(map(self.value, rest))
            return dict(zip(parts[::2], parts[1::2], strict=True))
        if kind == _AGAIN:
            return self._met[rest[0]]
        made = self._made(kind, rest)
        self._met.append(made)
        return made

    def _made(self, kind: int, rest: list[Any]) -> Any:
        if kind == _ARRAY:
            return self._arrays[rest[0]]
        known, *parts = rest
        found = self._classes[known]
        if (kind == _MEMBER) != issubclass(found, Enum):
            raise ValueError(f"{known} is of another kind")
        if kind == _MEMBER:
            return found(self.value(parts[0]))
        names = [field.name for field in fields(found)]
        # The constructor would check and copy again what it has made.
        made = object.__new__(found)
        made.__dict__.update(zip(names, map(self.value, parts), strict=True))
        return made
