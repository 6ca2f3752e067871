"""Preshapes on disk: found once per hand, and read in later processes.

A file is plain JSON in `preshapes` in the cache folder (see `cache_folder`). Its name is the hash of everything that
the preshapes depend on. A file that is damaged, or of something else, counts as missing.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import msgspec

from clench.core.caching.cache_folder import cache_folder, keep_file, note_use
from clench.core.caching.fingerprint import fingerprint
from clench.core.exceptions import ClenchError
from clench.core.files.json_files import read_json
from clench.models.hand.hand import Hand

#: The value of this environment variable that switches the files off is "0".
SWITCH: Final = "CLENCH_PRESHAPE_CACHE"
SCHEMA: Final = "clench.preshapes/1"
#: Number of the method that finds preshapes: raised when it finds others.
METHOD: Final = 2
#: Numbers of a zone.
ZONE: Final = 11
#: Files that are kept, and the largest of them [bytes].
MOST_FILES: Final = 64
MOST_BYTES: Final = 1_000_000
#: Attributes of a hand that do not affect its preshapes.
_UNUSED: Final = frozenset({"path", "findings", "warnings", "spec_xml", "assets"})


class Entry(msgspec.Struct, frozen=True):
    """Describe one preshape: its angles by joint [rad], and its zones as rows.

    A zone is [center x, y, z, axis x, y, z, row x, y, z, aperture, quality].
    """

    angles: dict[str, float]
    zones: list[list[float]]


class _File(msgspec.Struct):
    schema: str
    key: str
    digest: str
    preshapes: list[Entry]


def cache_key(hand: Hand, fingers: tuple[str, ...]) -> str:
    """Return the hash of everything that the preshapes of some fingers of a hand depend on, hexadecimal."""
    from clench import __version__

    values = [getattr(hand, f.name) for f in fields(hand) if f.name not in _UNUSED]
    return fingerprint(SCHEMA, METHOD, __version__, values, fingers)


def read_preshapes(key: str, joints: Sequence[str]) -> list[Entry] | None:
    """Return the entry of a key, or None if it is missing or unusable.

    Args:
        key: see `cache_key`. joints: names of the hand's joints.
    """
    path = _path(key)
    if path is None:
        return None
    try:
        state = path.stat()
        if state.st_size > MOST_BYTES:
            return None
        found = msgspec.convert(read_json(path), _File)
    except (ClenchError, msgspec.ValidationError, OSError):
        return None
    whole = (found.schema, found.key, found.digest) == (SCHEMA, key, _digest(found.preshapes))
    known = all(name in joints for entry in found.preshapes for name in entry.angles)
    fits = all(len(zone) == ZONE for entry in found.preshapes for zone in entry.zones)
    if not (whole and known and fits):
        return None
    note_use(path, state.st_mtime)
    return found.preshapes


def keep_preshapes(key: str, preshapes: Sequence[Entry]) -> None:
    """Write preshapes under a key, and remove the oldest files beyond `MOST_FILES`.

    If the cache cannot be written, nothing is kept.
    """
    path = _path(key)
    if path is None:
        return
    content = msgspec.json.encode(_File(SCHEMA, key, _digest(preshapes), list(preshapes)))
    if len(content) <= MOST_BYTES:
        keep_file(path, content, MOST_FILES)


def _path(key: str) -> Path | None:
    """Return the file of a key, or None where nothing is kept."""
    folder = cache_folder()
    if folder is None or os.environ.get(SWITCH, "1") == "0":
        return None
    return folder / "preshapes" / f"{key}.json"


def _digest(preshapes: Sequence[Entry]) -> str:
    plain: list[Any] = list(preshapes)
    return hashlib.sha256(msgspec.json.encode(plain)).hexdigest()
