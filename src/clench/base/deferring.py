"""Mappings and sequences that are made when they are first read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any


class DeferredMapping(Mapping[str, Any]):
    """Hold a mapping that costs more to make than most readers want to wait for; it equals what it holds.

    Args:
        make: returns the mapping; called once at most, unless two threads read it at once for the first time.
    """

    def __init__(self, make: Callable[[], Mapping[str, Any]]) -> None:
        self._make: Callable[[], Mapping[str, Any]] | None = make
        self._made: dict[str, Any] = {}

    @property
    def is_made(self) -> bool:
        """Whether it has been read."""
        return self._make is None

    def _all(self) -> dict[str, Any]:
        make = self._make
        if make is not None:
            self._made = dict(make())
            self._make = None
        return self._made

    def __getitem__(self, key: str) -> Any:
        return self._all()[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        """Be copied and pickled as the plain mapping."""
        return dict, (self._all(),)


class DeferredSequence(Sequence[Any]):
    """Hold a sequence that costs more to make than most readers want to wait for.

    Args:
        make: returns the sequence; called once at most, unless two threads read it at once for the first time.
    """

    def __init__(self, make: Callable[[], Sequence[Any]]) -> None:
        self._make: Callable[[], Sequence[Any]] | None = make
        self._made: tuple[Any, ...] = ()

    @property
    def is_made(self) -> bool:
        """Whether it has been read."""
        return self._make is None

    def _all(self) -> tuple[Any, ...]:
        make = self._make
        if make is not None:
            self._made = tuple(make())
            self._make = None
        return self._made

    def __getitem__(self, index: Any) -> Any:
        return self._all()[index]

    def __len__(self) -> int:
        return len(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[type[tuple[Any, ...]], tuple[tuple[Any, ...]]]:
        """Be copied and pickled as the plain tuple."""
        return tuple, (self._all(),)
