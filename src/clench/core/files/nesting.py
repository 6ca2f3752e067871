"""Measure how deeply values are nested: recursion into deeply nested values would end the program."""

from __future__ import annotations

from typing import Any

from .file_limits import DOCUMENT_DEPTH

TOO_DEEP = f"it has more than {DOCUMENT_DEPTH} lists and objects inside each other"


def is_too_deep(value: Any) -> bool:
    """Return whether plain values have more than `DOCUMENT_DEPTH` lists and dictionaries inside each other."""
    level = [value] if isinstance(value, dict | list) else []
    for _ in range(DOCUMENT_DEPTH):
        level = [
            item
            for holder in level
            for item in (holder.values() if isinstance(holder, dict) else holder)
            if isinstance(item, dict | list)
        ]
        if not level:
            return False
    return bool(level)
