"""The folder in which clench keeps results that take long to compute, and the bounds of what it keeps."""

from __future__ import annotations

import math
import os
import re
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

from clench.core.exceptions import ClenchError
from clench.core.files.json_files import write_atomically

#: A file in use gets a new time at most this often [s].
RENEWED_AFTER: Final = 3600.0


def cache_folder() -> Path | None:
    """Return the user's cache folder for this program: `CLENCH_CACHE_DIR`, else the platform's.

    None means that nothing is kept: the user has no home folder, as in some containers.
    """
    named = os.environ.get("CLENCH_CACHE_DIR")
    if named:
        return Path(named)
    try:
        return _platforms_folder() / "clench"
    except RuntimeError:
        return None


def _platforms_folder() -> Path:
    """Return the user's folder for the caches of all programs.

    Raises:
        RuntimeError: the user has no home folder.
    """
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base)


def keep_file(path: Path, content: bytes, most_files: int, most_together: float = math.inf) -> None:
    """Write a file, and remove the oldest of its kind beyond the bounds; if that cannot be done, nothing is kept.

    Args:
        path, most_files, most_together: see `remove_oldest`; the ending of the name tells the kind.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)
        remove_oldest(path.parent, path.suffix.removeprefix("."), most_files, most_together)
    except (ClenchError, OSError):
        return


def note_use(file: Path, written: float) -> None:
    """Give a file that was read the present time, so that it stays longer than files that nobody reads.

    Args:
        written: its time so far [s]; a recent one stays. A file of another user keeps its time.
    """
    if time.time() - written > RENEWED_AFTER:
        with suppress(OSError):
            os.utime(file)


def remove_oldest(folder: Path, ending: str, most_files: int, most_together: float = math.inf) -> None:
    """Remove the files of a kind beyond the bounds, those first that were not used for longest.

    Another process may remove them at the same time.

    Args:
        folder: with the files, whose names are a hash of 64 digits and the ending. most_together: size of all [bytes];
            the newest file stays in any case.

    Raises:
        OSError: the folder cannot be read, or a file cannot be removed.
    """
    own, found = re.compile(rf"[0-9a-f]{{64}}\.{re.escape(ending)}"), []
    for file in folder.iterdir():
        if own.fullmatch(file.name):
            try:
                state = file.stat()
            except FileNotFoundError:
                continue
            found.append((state.st_mtime, state.st_size, file))
    together = 0
    for n, (_, size, file) in enumerate(sorted(found, reverse=True)):
        together += size
        if n >= most_files or (n > 0 and together > most_together):
            file.unlink(missing_ok=True)
