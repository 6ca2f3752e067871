"""The one decorator of all kernels: strict floating point, cached on disk, without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def inner_kernel(function: Kernel) -> Kernel:
    """Compile a function that only other kernels call: without an entry from Python, it compiles faster.

    A call from Python would end the process without a word; a test holds that there is none.
    """
    options: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(Kernel, njit(cache=True, nogil=True, error_model="numpy", **options)(function))


def kernel(function: Kernel) -> Kernel:
    """Compile a function on its first call; it keeps its signature."""
    return cast(Kernel, njit(cache=True, nogil=True, error_model="numpy")(function))
