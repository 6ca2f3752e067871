"""Arrays on disk: computed once, and read in later processes.

A file is in `arrays` in the cache folder (see `cache_folder`). Its name is the hash of everything that the arrays
depend on. It starts with a line of JSON: schema, key, checksum, and kind and shape of each array. The numbers follow.
A file that is damaged, or of something else, counts as missing.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from .cache_folder import cache_folder, keep_file, note_use

Arrays = list[np.ndarray[Any, Any]]

#: The value of this environment variable that switches the files off is "0".
SWITCH: Final = "CLENCH_ARRAY_CACHE"
SCHEMA: Final = "clench.arrays/1"
#: Files that are kept, the largest of them, and all of them together [bytes].
MOST_FILES: Final = 64
MOST_BYTES: Final = 32_000_000
MOST_TOGETHER: Final = 256_000_000
#: Each array begins at a multiple of this number of bytes.
_ALIGNED: Final = 64
_KINDS: Final = re.compile(r"<[fiu][1248]|\|[biu]1")


def arrays_of(key: str, make: Callable[[], Sequence[np.ndarray[Any, Any]]]) -> Arrays:
    """Return the arrays of a key: those on disk, or else new ones, which are then written.

    What is read is equal to what was made: bits, types, order in memory, and whether it can be written to.

    Args:
        key: hash of everything that the arrays depend on, 64 hexadecimal digits. make: returns them.
    """
    folder = cache_folder()
    if folder is None or os.environ.get(SWITCH, "1") == "0":
        return list(make())
    path = folder / "arrays" / f"{key}.arrays"
    found = _read(path, key)
    if found is None:
        found = list(make())
        _keep(path, key, found)
    return found


def _read(path: Path, key: str) -> Arrays | None:
    """Return the arrays of a file, or None if it is missing or unusable."""
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            state = os.fstat(file.fileno())
            if not stat.S_ISREG(state.st_mode) or state.st_size > MOST_BYTES:
                return None
            content = bytearray(state.st_size)
            if file.readinto(content) != len(content):
                return None
        end = content.index(b"\n") + 1
        head = json.loads(content[:end])
        digest = _digest(head["arrays"], memoryview(content)[end:])
        if (head["schema"], head["key"], head["digest"]) != (SCHEMA, key, digest):
            return None
        note_use(path, state.st_mtime)
        return _arrays(head["arrays"], content, end)
    except (OSError, ValueError, TypeError, LookupError, RecursionError, OverflowError):
        return None


def _without_waiting(name: str, flags: int) -> int:
    """Open a file; a pipe opens at once, too, where it would wait for a writer."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _arrays(rows: list[Any], content: bytearray, at: int) -> Arrays | None:
    """Return arrays that share the content, from a place on; None if the content is too short or too long for them."""
    found = []
    for kind, shape, order, written in rows:
        if not _KINDS.fullmatch(kind):
            return None
        at += -at % _ALIGNED
        array = np.ndarray(tuple(shape), np.dtype(kind), content, at, order=order)
        array.flags.writeable = written
        at += array.nbytes
        found.append(array)
    return found if at == len(content) else None


def _keep(path: Path, key: str, arrays: Arrays) -> None:
    """Write arrays, and remove the oldest files beyond the bounds; if that cannot be done, nothing is kept."""
    if not all(_KINDS.fullmatch(a.dtype.str) and (a.flags.c_contiguous or a.flags.f_contiguous) for a in arrays):
        return
    rows = [[a.dtype.str, a.shape, "C" if a.flags.c_contiguous else "F", a.flags.writeable] for a in arrays]
    # The line has the same length with any checksum, so it says where the numbers begin.
    start = len(_head(key, "0" * 64, rows))
    body = bytearray()
    for a in arrays:
        body += bytes(-(start + len(body)) % _ALIGNED) + a.tobytes("A")
    if start + len(body) > MOST_BYTES:
        return
    keep_file(path, _head(key, _digest(rows, body), rows) + bytes(body), MOST_FILES, MOST_TOGETHER)


def _head(key: str, digest: str, rows: list[Any]) -> bytes:
    return json.dumps({"schema": SCHEMA, "key": key, "digest": digest, "arrays": rows}).encode() + b"\n"


def _digest(rows: list[Any], body: bytearray | memoryview) -> str:
    digest = hashlib.sha256(json.dumps(rows).encode())
    digest.update(body)
    return digest.hexdigest()
