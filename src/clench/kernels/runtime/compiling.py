"""The decorators of all kernels: strict floating point, cached on disk, without the interpreter's lock."""

from __future__ import annotations

import hashlib
import inspect
import os
import re
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, TypeVar, overload

import numpy as np
from numba import njit
from numba.core.registry import CPUDispatcher

from clench.core import tolerances

from .by_reference import handed_on, type_of
from .kernel_cache import index_of, keep_on_disk
from .kernel_compiler import compiled, compiler_of

Kernel = TypeVar("Kernel", bound=Callable[..., object])

#: How modules import kernels: beside them, from a folder above, or from this package. A test allows no other way.
_IMPORTED: Final = re.compile(r"^\s*from (\.+|clench\.kernels\.)(\w[\w.]*) import ", re.MULTILINE)
#: The folder of all kernels.
_KERNELS: Final = os.path.dirname(os.path.dirname(__file__))


#: Marks of functions that take any number of arguments.
_TAKE_ANY: Final = inspect.CO_VARARGS | inspect.CO_VARKEYWORDS
#: What signatures have where no annotation is.
_NOTHING: Final = inspect.Parameter.empty


@overload
def kernel(function: Kernel) -> Kernel: ...


@overload
def kernel(*, allocates: bool) -> Callable[[Kernel], Kernel]: ...


def kernel(function: Any = None, *, allocates: bool = False) -> Any:
    """Compile a function that only other kernels call, on its first call; it keeps its signature.

    Without an entry from Python, a kernel compiles faster. A call from Python raises `TypeError`.

    Kernels that do not allocate count no references, which would be kept for every view of an array. Counting takes
    most of the time of a kernel that reads many rows. What such a kernel reads is alive as long as its caller holds it.

    Args:
        allocates: the function makes arrays. It may not keep an array that a kernel without this option returns.
    """
    if function is None:
        return partial(kernel, allocates=allocates)
    return _compiled(function, from_python=False, allocates=allocates)


@overload
def entry_kernel(function: Kernel) -> Kernel: ...


@overload
def entry_kernel(*, allocates: bool) -> Callable[[Kernel], Kernel]: ...


def entry_kernel(function: Any = None, *, allocates: bool = False) -> Any:
    """Compile a function that Python calls, and other kernels may; see `kernel`."""
    if function is None:
        return partial(entry_kernel, allocates=allocates)
    return _compiled(function, from_python=True, allocates=allocates)


@cache
def source_stamp(module: Path) -> bytes:
    """Return a digest of the sources that a module's kernels are compiled from, and of the numbers in them.

    A kernel on disk is good for as long as this digest is the same. Numba looks at the kernel's own file only, while a
    kernel contains the kernels that it calls. Thus the digest covers these decorators and the modules that the module
    imports, directly or over others.

    Args:
        module: file of the module, in any folder.
    """
    found, waiting = set[str](), [str(module), __file__, tolerances.__file__]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _read(path)[1]
    return hashlib.sha256(b"".join(_read(path)[0] for path in sorted(found))).digest()


@cache
def _read(path: str) -> tuple[bytes, tuple[str, ...]]:
    """Return the digest of a file, and the files with kernels that it imports."""
    with open(path, "rb") as file:
        content = file.read()
    files = (_file(path, start, name) for start, name in _IMPORTED.findall(content.decode()))
    return hashlib.sha256(content).digest(), tuple(files)


def _file(path: str, start: str, name: str) -> str:
    """Return the file of a module that a file imports by `from <start><name> import`."""
    folder = _KERNELS
    if start.startswith("."):
        folder = path
        for _ in start:
            folder = os.path.dirname(folder)
    return os.path.join(folder, *name.split(".")) + ".py"


def is_kept(function: Any) -> bool:
    """Say whether a kernel is on disk as it is now; true where NUMBA_DISABLE_JIT leaves functions as they are."""
    return not hasattr(function, "get_call_template") or bool(index_of(function)._load_index())


class CachedKernel(CPUDispatcher):
    """A kernel that other kernels hand tuples by pointer; Python calls it with values."""

    def typeof_pyval(self, val: Any) -> Any:
        """Return the type of an argument from Python."""
        return type_of(val) if isinstance(val, np.ndarray | tuple) else super().typeof_pyval(val)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how another kernel calls this one: once for all values and sizes of a whole number.

        Numba would compile it anew for every integer that the other kernel writes out in a call.
        """
        return super().get_call_template(tuple(map(handed_on, args)), {name: handed_on(a) for name, a in kws.items()})

    def compile(self, sig: Any) -> Any:
        """Compile for arguments, unless it is done or on disk; return what Python calls."""
        return compiled(self, sig)


class KernelForKernels(CachedKernel):
    """A kernel without an entry from Python; a call would end the process without a message."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Refuse to be called.

        Raises:
            TypeError: always.
        """
        raise TypeError(f"{self.py_func.__name__}: expected a call from a kernel; it has no entry from Python.")

    def add_overload(self, cres: Any) -> None:
        """Note a compiled kernel where other kernels find it."""
        self.overloads[tuple(cres.signature.args)] = cres


@cache
def _stamp_of(file: str) -> bytes:
    """Return the stamp of the kernels of a file."""
    return source_stamp(Path(file))


def _note_signature(function: Callable[..., Any]) -> None:
    """Keep the signature of a function with it: Numba asks for it twice, and asking takes longer than noting it."""
    code = function.__code__
    if function.__defaults__ or code.co_kwonlyargcount or code.co_flags & _TAKE_ANY:
        return
    noted = function.__annotations__
    parameters = [
        inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=noted.get(name, _NOTHING))
        for name in code.co_varnames[: code.co_argcount]
    ]
    kinds: Any = inspect.Signature
    function.__signature__ = kinds(  # type: ignore[attr-defined]
        parameters, return_annotation=noted.get("return", _NOTHING), __validate_parameters__=False
    )


def _compiled(function: Callable[..., Any], *, from_python: bool, allocates: bool) -> Any:
    """Return the kernel of a function, which is compiled or loaded on its first call."""
    stamp = _stamp_of(function.__code__.co_filename)
    _note_signature(function)
    settings: Any = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": allocates}
    if not from_python:
        settings["no_cpython_wrapper"] = True
    dispatcher: Any = njit(pipeline_class=compiler_of(stamp), **settings)(function)
    if not hasattr(dispatcher, "get_call_template"):  # NUMBA_DISABLE_JIT leaves the function as it is.
        return dispatcher
    dispatcher.__class__ = CachedKernel if from_python else KernelForKernels
    keep_on_disk(dispatcher, stamp)
    return dispatcher
