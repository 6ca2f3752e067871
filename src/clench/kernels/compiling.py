"""The decorators of all kernels: strict floating point, cached on disk, without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

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


def _compiled(function: Kernel, **options: bool) -> Kernel:
    """Compile a function on its first call, once for all values of a number.

    Numba would compile it anew for every integer that another kernel writes out in a call.
    """
    settings: Any = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, **options}
    dispatcher: Any = njit(**settings)(function)
    if not hasattr(dispatcher, "get_call_template"):  # NUMBA_DISABLE_JIT leaves the function as it is.
        return cast(Kernel, dispatcher)
    choose = dispatcher.get_call_template

    def choose_handed(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return choose(tuple(map(handed, args)), {name: handed(a) for name, a in kws.items()})

    dispatcher.get_call_template = choose_handed
    return cast(Kernel, dispatcher)
