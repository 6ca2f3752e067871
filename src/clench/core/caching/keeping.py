"""Keep results: by identity for arguments that are costly to compare, and up to a number of bytes."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import cached_property, wraps
from threading import Lock
from typing import Any, ClassVar, Generic, ParamSpec, TypeVar

Found = TypeVar("Found")
Argument = TypeVar("Argument")
Arguments = ParamSpec("Arguments")


def kept_by_identity(size: int) -> Callable[[Callable[Arguments, Found]], Callable[Arguments, Found]]:
    """Return a decorator that computes a function once for the same arguments, which must not change.

    Arguments are positional. They are kept alive with their result, so that their identity stays unique; equal
    arguments with another identity count as different.

    Args:
        size: how many results are kept; the oldest goes first.
    """

    def decorate(function: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
        kept: OrderedDict[tuple[int, ...], tuple[tuple[object, ...], Found]] = OrderedDict()

        @wraps(function)
        def look_up(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Found:
            if kwargs:
                raise TypeError(f"{function.__name__}: expected positional arguments.")
            key = tuple(map(id, args))
            entry = kept.get(key)
            if entry is not None:
                return entry[1]
            found = function(*args, **kwargs)
            kept[key] = (args, found)
            while len(kept) > size:
                kept.popitem(last=False)
            return found

        return look_up

    return decorate


def kept_while_alive(function: Callable[[Argument], Found]) -> Callable[[Argument], Found]:
    """Return a function that computes once per argument, and forgets the result when the argument is freed.

    The argument is known by identity and must not change. The result must not refer to it, or neither is ever freed.
    """
    kept: dict[int, tuple[weakref.ref[Argument], Found]] = {}

    @wraps(function)
    def look_up(argument: Argument) -> Found:
        key = id(argument)
        entry = kept.get(key)
        if entry is not None and entry[0]() is argument:
            return entry[1]

        def forget(freed: weakref.ref[Argument]) -> None:
            # Another object may have the same address by now.
            if (entry := kept.get(key)) is not None and entry[0] is freed:
                kept.pop(key, None)

        found = function(argument)
        kept[key] = (weakref.ref(argument, forget), found)
        return found

    return look_up


class Keeper:
    """A frozen dataclass that keeps its derived values as long as it lives; copies and pickles start without them."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def kept(self, key: tuple[Hashable, ...], make: Callable[[], Found]) -> Found:
        """Return the value of a key, and make it the first time.

        Args:
            key: name of the value, and its dependencies. make: returns it.
        """
        if key not in self._kept:
            self._kept[key] = make()
        found: Found = self._kept[key]
        return found

    @cached_property
    def _kept(self) -> dict[tuple[Hashable, ...], Any]:
        return {}

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
