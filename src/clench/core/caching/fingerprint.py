"""A fingerprint of values: the same in every process, and another one for other values."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Final

import numpy as np

#: Texts that read as another value does. A mark tells them from it; all others have none, as in files of earlier days.
_SPELLED: Final = re.compile(r"None|True|False|-?[0-9]+")


def fingerprint(*values: Any) -> str:
    """Return a SHA-256 over plain values, arrays, sequences, mappings and dataclasses of these, hexadecimal.

    Numbers count to the bit, and a text is never a number. The order of a mapping's keys plays no part. NumPy's scalars
    count as Python's, and a list counts as a tuple.

    Raises:
        TypeError: a value of another type.
    """
    digest = hashlib.sha256()
    for value in values:
        _add(digest, value)
    return digest.hexdigest()


def _add(digest: hashlib._Hash, value: Any) -> None:
    if isinstance(value, str):
        mark = "t" if _SPELLED.fullmatch(value) else ""
        digest.update(f"|{mark}{len(value)}:{value}".encode("utf-8", "surrogatepass"))
    elif value is None or isinstance(value, int | np.integer | np.bool_):
        text = repr(value.item() if isinstance(value, np.generic) else value)
        digest.update(f"|{len(text)}:{text}".encode())
    elif isinstance(value, float | np.floating):
        digest.update(b"|f" + np.float64(value).tobytes())
    elif isinstance(value, np.ndarray):
        digest.update(f"|a{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        digest.update(f"|m{len(value)}".encode())
        for key in sorted(value, key=lambda key: (str(key), isinstance(key, str))):
            _add(digest, key)
            _add(digest, value[key])
    elif isinstance(value, list | tuple):
        digest.update(f"|s{len(value)}".encode())
        for each in value:
            _add(digest, each)
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(f"|d{type(value).__name__}".encode())
        for field in fields(value):
            _add(digest, getattr(value, field.name))
    else:
        raise TypeError(f"fingerprint: expected plain values, arrays and dataclasses, got {type(value).__name__}.")
