"""The kernels that Numba keeps on disk, and files there that an older version of this package wrote."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

#: Errors of reading a damaged file, or one that names modules or classes which this version does not have.
_UNREADABLE = (ImportError, AttributeError, pickle.UnpicklingError, EOFError, TypeError, ValueError, IndexError)


def index_of(dispatcher: Any) -> Any:
    """Return what Numba keeps of a kernel on disk: an `IndexDataCacheFile`, which it does not make public."""
    return dispatcher._cache._cache_file


def forgive_unreadable(dispatcher: Any) -> None:
    """Let a kernel be compiled anew where its index on disk cannot be read; Numba would raise what reading raises."""
    index = index_of(dispatcher)
    index._load_index = _forgiving(index._load_index)


def _forgiving(load: Callable[[], Any]) -> Callable[[], Any]:
    def load_or_forget() -> Any:
        try:
            return load()
        except _UNREADABLE:
            return {}

    return load_or_forget
