"""Read TOML files: hand files, calibrations, joint maps."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import FileError

from .file_bytes import read_text
from .file_limits import DOCUMENT_DEPTH, TOML_BYTES
from .nesting import TOO_DEEP, is_too_deep

#: A key of too many parts, for which the parser would take minutes.
_LONG_KEY: Final = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+)""" + f"{{{DOCUMENT_DEPTH}}}"
)


def read_toml(path: str | Path, missing: str = "no such file.", kind: str = "TOML") -> dict[str, Any]:
    """Return the tables of a TOML file.

    Args:
        path: the file. missing: message for a missing file. kind: expected kind of the file, for messages.

    Raises:
        FileError: missing, unreadable, too large, or not TOML.
    """
    text = read_text(path, TOML_BYTES, missing)
    if _LONG_KEY.search(text):
        raise FileError(path, f"not {kind}: a key has more than {DOCUMENT_DEPTH} parts.")
    try:
        data = tomllib.loads(text)
    except ValueError as error:  # wrong TOML, and numbers of too many digits
        raise FileError(path, f"not {kind}: {error}.") from None
    except RecursionError:
        raise FileError(path, f"not {kind}: {TOO_DEEP}.") from None
    if is_too_deep(data):
        raise FileError(path, f"not {kind}: {TOO_DEEP}.")
    return data
