"""Ratios to another version, kept per commit: a file of comma-separated values that grows by a row per case."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from clench.core.exceptions import FileError


class Ratio(NamedTuple):
    """One case: time of a pose in a batch [ms], and the ratio to the other version's time [-]."""

    hand: str
    object: str
    order: str
    geometry: str
    processor_ms: float
    over_other: float


_HEADER = ("commit", *Ratio._fields)


def keep_ratios(file: Path, commit: str, rows: Iterable[Ratio]) -> None:
    """Append rows to a file, which is made with a header where there is none.

    Raises:
        FileError: the file cannot be written.
    """
    try:
        fresh = is_empty(file)
        with file.open("a", encoding="utf-8", newline="") as out:
            writer = csv.writer(out, lineterminator="\n")
            if fresh:
                writer.writerow(_HEADER)
            writer.writerows((commit, *row[:4], f"{row.processor_ms:.4g}", f"{row.over_other:.3g}") for row in rows)
    except OSError as error:
        raise FileError(file, f"cannot be written ({error.strerror}).") from error


def is_empty(file: Path) -> bool:
    """Say whether a file lacks its header."""
    return not file.exists() or file.stat().st_size == 0


def check_header(file: Path) -> None:
    """Refuse a file of something else, before anything is measured.

    Raises:
        FileError: with the header that was expected.
    """
    if is_empty(file):
        return
    with file.open(encoding="utf-8", newline="") as lines:
        found = next(csv.reader(lines), [])
    if tuple(found) != _HEADER:
        raise FileError(file, f"expected the header {','.join(_HEADER)}, got {','.join(found)[:80]}.")
