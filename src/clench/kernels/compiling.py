"""The decorators of all kernels: strict floating point, cached on disk, without the interpreter's lock."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

from clench.base import tolerances

from .handing import handed

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def kernel(function: Kernel) -> Kernel:
    """Compile a function on its first call; it keeps its signature. It may not allocate.

    Without counts of references, which would be kept for every view of an array: counting takes most of the time
    of a kernel that reads many rows. What such a kernel reads is alive as long as its caller holds it.
    """
    return _compiled(function, _nrt=False)


def inner_kernel(function: Kernel) -> Kernel:
    """Compile a function that only other kernels call: without an entry from Python, it compiles faster.

    A call from Python would end the process without a word; a test holds that there is none.
    """
    return _compiled(function, _nrt=False, no_cpython_wrapper=True)


def allocating_kernel(function: Kernel) -> Kernel:
    """Compile a function that allocates. It may not keep an array that a kernel which does not allocate returns."""
    return _compiled(function, _nrt=True)


def inner_allocating_kernel(function: Kernel) -> Kernel:
    """Compile a function that allocates, and that only other kernels call."""
    return _compiled(function, _nrt=True, no_cpython_wrapper=True)


@cache
def source_stamp() -> bytes:
    """Return a digest of the source of all kernels, and of the numbers that are compiled into them.

    What is kept on disk is good for as long as it is the same. Numba asks no other file than the kernel's own, while
    every kernel has those that it calls inside: after an update old ones would stay in use.
    """
    digest = hashlib.sha256()
    for path in [*sorted(Path(__file__).parent.glob("*.py")), Path(tolerances.__file__)]:
        digest.update(path.read_bytes())
    return digest.digest()


def index_of(dispatcher: Any) -> Any:
    """Return what Numba keeps of a kernel on disk: an `IndexDataCacheFile`, which it does not make public."""
    return dispatcher._cache._cache_file


def is_kept(function: Any) -> bool:
    """Say whether a kernel is on disk as it is now; true where NUMBA_DISABLE_JIT leaves functions as they are."""
    return not hasattr(function, "get_call_template") or bool(index_of(function)._load_index())


def _compiled(function: Kernel, **options: bool) -> Kernel:
    """Compile a function on its first call, once for all values of a number.

    Numba would compile it anew for every integer that another kernel writes out in a call.
    """
    settings: Any = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, **options}
    dispatcher: Any = njit(**settings)(function)
    if not hasattr(dispatcher, "get_call_template"):  # NUMBA_DISABLE_JIT leaves the function as it is.
        return cast(Kernel, dispatcher)
    index_of(dispatcher)._source_stamp = source_stamp()
    choose = dispatcher.get_call_template

    def choose_handed(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return choose(tuple(map(handed, args)), {name: handed(a) for name, a in kws.items()})

    dispatcher.get_call_template = choose_handed
    return cast(Kernel, dispatcher)
