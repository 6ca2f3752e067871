"""Values, mappings and sequences that are made when they are first read.

A `functools.cached_property` cannot take their place. It is no field of a dataclass: the constructor, `fields`
and `replace` would not know it. The same classes are also made with all fields at once, from files and by callers. A
batch makes a solution in a tenth of a millisecond this way. Making all fields takes about ten times as long.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from threading import Lock
from typing import Any, ClassVar, Self, TypeVar

Value = TypeVar("Value")


class _Deferred:
    """A value that is made on first reading, because it costs more time than most readers want to wait.

    Args:
        make: returns the value; called once at most, unless two threads read it simultaneously for the first time.
    """

    #: Type of the made value, and of its copies.
    _kind: ClassVar[type[Any]]

    def __init__(self, make: Callable[[], Iterable[Any]]) -> None:
        self._make: Callable[[], Iterable[Any]] | None = make
        self._made: Any = None

    @property
    def is_made(self) -> bool:
        """Whether it has been read."""
        return self._make is None

    def _all(self) -> Any:
        make = self._make
        if make is not None:
            self._made = self._kind(make())
            self._make = None
        return self._made

    def __getitem__(self, key: Any) -> Any:
        return self._all()[key]

    def __len__(self) -> int:
        return len(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[type[Any], tuple[Any]]:
        """Copy and pickle as the value."""
        return self._kind, (self._all(),)


class DeferredMapping(_Deferred, Mapping[str, Any]):
    """A mapping that is made on first reading; it compares equal to its content, and its copies are plain."""

    _kind = dict

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())


class DeferredSequence(_Deferred, Sequence[Any]):
    """A sequence that is made when it is first read; its copies are plain tuples."""

    _kind = tuple


class LateFields:
    """A dataclass some of whose fields are made when they are first read; copies and pickles have them all."""

    __dataclass_fields__: ClassVar[dict[str, Any]]
    #: Names that are no part of the interface for users.
    _internal: ClassVar[frozenset[str]] = frozenset({"with_late", "with_known"})

    @classmethod
    def with_late(cls, make: Callable[[str], Any], **known: Any) -> Self:
        """Return an instance of which some fields are known.

        Args:
            make: returns the field of that name, always the same. known: at least the fields with a default value,
                which would else be read in their place.
        """
        instance = object.__new__(cls)
        instance.__dict__.update(known, _make_field=make)
        return instance

    def with_known(self, **known: Any) -> Self:
        """Return the same instance with other values of some fields; unmade values stay unmade."""
        instance = object.__new__(type(self))
        instance.__dict__.update(self.__dict__, **known)
        return instance

    def __getattr__(self, name: str) -> Any:
        make: Callable[[str], Any] | None = self.__dict__.get("_make_field")
        if make is None or name not in self.__dataclass_fields__:
            raise AttributeError(f"'{type(self).__name__}' has no attribute '{name}'", name=name, obj=self)
        value = self.__dict__[name] = make(name)
        return value

    def __dir__(self) -> list[str]:
        """Return the names of the interface for users."""
        known = {*object.__dir__(self), *self.__dataclass_fields__}
        return sorted(known - self._internal - {"_make_field"})

    def __getstate__(self) -> dict[str, Any]:
        """Return all fields, and nothing of how they are made."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def once(make: Callable[[], Value]) -> Callable[[], Value]:
    """Return a function that makes a value on its first call; concurrent callers get the same value."""
    waiting, made, lock = [make], list[Value](), Lock()

    def value() -> Value:
        if not made:
            with lock:
                if not made:
                    made.append(waiting[0]())
                    # The source data are no longer needed.
                    waiting.clear()
        return made[0]

    return value
