"""Memory for large meshes."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from functools import cache
from typing import Final

#: A smaller mesh leaves too little behind to be worth a setting [bytes].
LARGE: Final = 4_000_000
#: Rows of an array that are worked on together.
AT_ONCE: Final = 16384
#: Blocks from this size on go back to the system when they are freed [bytes].
BLOCK: Final = 1 << 20
#: glibc's name for that size.
_M_MMAP_THRESHOLD: Final = -3


def expect(size: int) -> None:
    """Prepare for a mesh of this many bytes: memory freed after work on it returns to the system.

    glibc raises its threshold for returning memory to 32 MB by itself, and so keeps half a gigabyte after a mesh of a
    million triangles. Other C libraries are left alone.
    """
    if size >= LARGE:
        _give_back_blocks()


def in_parts(rows: int) -> Iterator[slice]:
    """Return slices that part an array's rows, so that work on them takes little memory however many there are."""
    return (slice(start, min(start + AT_ONCE, rows)) for start in range(0, rows, AT_ONCE))


@cache
def _give_back_blocks() -> bool:
    try:
        return bool(ctypes.CDLL("libc.so.6").mallopt(_M_MMAP_THRESHOLD, BLOCK))
    except (OSError, AttributeError):
        return False
