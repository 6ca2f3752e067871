"""Keep derived values: on the object that they are derived from, or by key up to a number of bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, ClassVar, Generic, TypeVar

Found = TypeVar("Found")


class Keeper:
    """A frozen dataclass that keeps its derived values as long as it lives; copies and pickles start without them."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def kept(self, key: tuple[Hashable, ...], make: Callable[[], Found]) -> Found:
        """Return the value of a key, and make it the first time; all threads get the same.

        Args:
            key: name of the value, and its dependencies. make: returns it. The value must not refer to this object, or
                neither is freed before a garbage collection.
        """
        values: dict[tuple[Hashable, ...], Any] = self.__dict__.setdefault("_kept", {})
        if key not in values:
            values.setdefault(key, make())
        found: Found = values[key]
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone."""
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}


class KeptBySize(Generic[Found]):
    """Keep results by key, up to a number of bytes; the latest result stays.

    Threads may share it. The latest stays however large it is.

    Args:
        limit: [bytes]. measure: returns the size of a result [bytes].
    """

    def __init__(self, limit: int, measure: Callable[[Found], int]) -> None:
        self.limit = limit
        self._measure = measure
        self._kept: OrderedDict[Hashable, tuple[Found, int]] = OrderedDict()
        self._lock = Lock()
        self.size = 0

    def get(self, key: Hashable, make: Callable[[], Found]) -> Found:
        """Return the value of a key, or make and keep it."""
        with self._lock:
            entry = self._kept.get(key)
            if entry is not None:
                self._kept.move_to_end(key)
                return entry[0]
        made = make()
        size = self._measure(made)
        with self._lock:
            # Another thread may have made it in the meantime.
            found, size = self._kept.setdefault(key, (made, size))
            if found is made:
                self.size += size
            self._shrink()
        return found

    def resize(self, limit: int) -> None:
        """Set the limit [bytes], and drop values beyond it."""
        with self._lock:
            self.limit = limit
            self._shrink()

    def _shrink(self) -> None:
        while self.size > self.limit and len(self._kept) > 1:
            _, (_, size) = self._kept.popitem(last=False)
            self.size -= size
