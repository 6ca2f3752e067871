"""Keep what a function found for arguments that are costly to compare or to hash: they are known by identity."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

Found = TypeVar("Found")
Arguments = ParamSpec("Arguments")


def kept_by_identity(size: int) -> Callable[[Callable[Arguments, Found]], Callable[Arguments, Found]]:
    """Return a decorator that computes a function once for the same arguments, which must not change.

    Arguments are positional. They are kept alive with what was found, so that their identity stays their own; equal
    ones that are not the same count as others.

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
