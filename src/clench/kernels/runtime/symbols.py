"""Call large kernels by their symbol, so that each is compiled once.

Numba links a kernel into every kernel that calls it, and optimizes and translates it there again. That makes short
kernels fast, which become part of their callers. A large kernel stays a call in any case, and each level above it
compiled it anew: two thirds of the time of a first solve.

A kernel whose machine code takes `LARGE` bytes or more is therefore not linked. Its callers refer to its symbol, and
the engine that holds all machine code of a process joins them. For this the symbol has the same name in every process.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any, Final, NamedTuple

from .by_reference import ByReference


class Needed(NamedTuple):
    """A kernel that the machine code of another one calls by its symbol."""

    symbol: str
    module: str
    name: str
    #: Name of the file with its machine code, in the cache's folder of the module.
    file: str


#: The kernels of this process that stay apart, by symbol.
_APART: Final[dict[str, Needed]] = {}


def has_a_fixed_symbol(function: Callable[..., Any]) -> bool:
    """Say whether a function's module has it under its name; one within a function, or without a name, is not there."""
    return bool(function.__qualname__.isidentifier() and function.__closure__ is None)


def described(kind: Any) -> str:
    """Return what tells a type from all others; the name of a tuple's type leaves out its class and its fields."""
    if isinstance(kind, ByReference):
        return f"&{described(kind.content)}"
    if not hasattr(kind, "types"):
        return str(kind)
    parts = ",".join(described(part) for part in kind.types)
    made = getattr(kind, "instance_class", tuple)
    return f"{made.__module__}.{made.__qualname__}{getattr(kind, 'fields', '')}({parts})"


def name_symbols(identity: Any, kinds: Iterable[Any], stamp: bytes) -> None:
    """Name a function's symbols by the function and by its sources, equal in all processes; Numba's names count.

    Args:
        identity: of the function, as Numba has it. kinds: types of its arguments.
        stamp: digest that changes when the function has to be compiled again.
    """
    source = identity.func.__code__
    text = f"{identity.modname} {source.co_firstlineno} {','.join(map(described, kinds))}".encode()
    digest = hashlib.sha256(stamp + text + source.co_code).hexdigest()[:16]
    identity.unique_id = digest
    identity.unique_name = f"{identity.func_qualname}${digest}"


def needed_by(library: Any) -> tuple[Needed, ...]:
    """Return the kernels that the machine code of a library calls by their symbols."""
    declared = (f.name for f in library._final_module.functions if f.is_declaration)
    return tuple(_APART[name] for name in declared if name in _APART)


def keep_apart(needed: Needed) -> None:
    """Note that the callers of a kernel refer to its symbol; its machine code is there."""
    _APART[needed.symbol] = needed


def bring(kernels: Iterable[Needed]) -> bool:
    """Load kernels that machine code refers to; return whether all their symbols are there now."""
    for needed in kernels:
        if needed.symbol not in _APART:
            try:
                load = getattr(import_module(needed.module), needed.name)._cache.load_apart
            except (ImportError, AttributeError):
                return False
            if not load(needed):
                return False
            _APART[needed.symbol] = needed
    return True
