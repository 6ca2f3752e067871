"""Read whole files; every failure becomes one sentence."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from clench.core.exceptions import CommandError, FileError


def read_file(path: str | Path, most: int, missing: str = "no such file.") -> bytes:
    """Return the content of a file.

    Args:
        path: the file. most: the largest size that is read [bytes], see `file_limits`.
        missing: message for a missing file.

    Raises:
        FileError: missing, a folder, a pipe or a device, too large, or unreadable.
    """
    try:
        state = os.stat(path)
        mode = state.st_mode
        if stat.S_ISDIR(mode):
            raise FileError(path, "cannot be read: it is a folder, expected a file.")
        if not stat.S_ISREG(mode):
            # Reading a pipe or a device may never end.
            raise FileError(path, "cannot be read: it is a pipe or a device, expected a file.")
        if state.st_size > most:
            raise FileError(path, _too_large(state.st_size, most))
        with open(path, "rb") as file:
            data = file.read(most + 1)  # a file may grow while it is read
        if len(data) > most:
            raise FileError(path, _too_large(len(data), most))
        return data
    except FileNotFoundError:
        raise FileError(path, missing) from None
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None
    except FileError:
        raise
    except ValueError as error:
        raise FileError(path, f"is no path of a file ({error}).") from None


def expanded(path: str | Path) -> Path:
    """Return a path with the home folder in place of its `~`, where that is known.

    Raises:
        CommandError: the value is neither text nor a path.
    """
    if not isinstance(path, str | os.PathLike):
        raise CommandError(f"path: expected text or a pathlib.Path, got {type(path).__name__}.")
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def read_text(path: str | Path, most: int, missing: str = "no such file.") -> str:
    """Return the text of a file in UTF-8; see `read_file`.

    Raises:
        FileError: as `read_file`, or not UTF-8.
    """
    try:
        return read_file(path, most, missing).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(path, f"not text in UTF-8 ({error.reason} at byte {error.start}).") from None


def _too_large(size: int, most: int) -> str:
    return f"is too large: it has {size / 2**20:.4g} MB; expected up to {most / 2**20:.4g} MB (docs/security.md)."


def make_folder(path: str | Path) -> Path:
    """Create a folder, with its parents, if it is missing; return its path.

    Raises:
        FileError: it cannot be made. CommandError: the value is neither text nor a path.
    """
    folder = expanded(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(path, f"cannot be made a folder ({error.strerror or error}).") from None
    return folder
