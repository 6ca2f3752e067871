"""Keep compiled kernels on disk, and load them without what only a compiler needs.

Numba prepares its compiler before it loads a function: it imports a hundred modules, SciPy among them, and parses the
function's intermediate code. A loaded kernel only runs machine code. `KernelCache` loads that alone, and leaves the
rest until another kernel is compiled that calls this one. Nothing here is a public interface of Numba; the version
range of the dependency is bounded for it.
"""

from __future__ import annotations

import pickle
from functools import cached_property
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.runtime.nrt import rtsys

#: Errors of reading a damaged file, or one that names modules or classes which this version does not have.
_UNREADABLE = (ImportError, AttributeError, pickle.UnpicklingError, EOFError, TypeError, ValueError, IndexError)


def keep_on_disk(dispatcher: Any, stamp: bytes) -> None:
    """Keep what a dispatcher compiles on disk.

    Args:
        dispatcher: of a function. stamp: digest that changes when the function has to be compiled again.
    """
    dispatcher._cache = KernelCache(dispatcher.py_func, stamp)


def index_of(dispatcher: Any) -> Any:
    """Return what Numba keeps of a kernel on disk: an `IndexDataCacheFile`, which it does not make public."""
    return dispatcher._cache._cache_file


class KernelCache(FunctionCache):
    """The files of one kernel; they are looked for when the kernel is first called.

    Args:
        function: of the kernel. stamp: see `keep_on_disk`.
    """

    def __init__(self, function: Any, stamp: bytes) -> None:
        self._name = repr(function)
        self._py_func = function
        self._stamp = stamp
        self._enabled = True

    @cached_property
    def _impl(self) -> CompileResultCacheImpl:
        return CompileResultCacheImpl(self._py_func)

    @property
    def _cache_path(self) -> str:
        return str(self._impl.locator.get_cache_path())

    @cached_property
    def _cache_file(self) -> IndexDataCacheFile:
        return _KernelIndex(self._cache_path, self._impl.filename_base, self._stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return a kernel from disk, or None without one that can be read; the compiler stays unprepared."""
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        if not self._enabled:
            return None
        try:
            content = self._cache_file.load(self._index_key(sig, target_context.codegen()))
        except _UNREADABLE:
            return None
        return None if content is None else _rebuilt(target_context, *content)


class _KernelIndex(IndexDataCacheFile):
    """The index of a kernel's files; where an older version left one that cannot be read, it counts as empty."""

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except _UNREADABLE:
            return {}


class LoadedLibrary(JITCodeLibrary):
    """Machine code from disk. The intermediate code that comes with it is parsed when a compiled kernel needs it.

    Args:
        codegen: of Numba. name: of the library. machine_code, bitcode: what `serialize_using_object_code` returned.
    """

    def __init__(self, codegen: Any, name: str, machine_code: bytes, bitcode: bytes) -> None:
        super().__init__(codegen, name)
        self._bitcode = bitcode
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 if this library has none of the name."""
        return int(self._codegen._engine.get_function_address(name))

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = binding.parse_bitcode(self._bitcode)
            self._codegen._engine._load_defined_symbols(self._shared_module)
            self._bitcode = b""
        return self._shared_module


def _rebuilt(
    context: Any,
    library_data: Any,
    described: Any,
    environment: Any,
    signature: Any,
    objectmode: bool,
    lifted: Any,
    annotation: Any,
    initializers: Any,
    referenced: Any,
) -> Any:
    """Return a compile result from what Numba's `CompileResult._reduce` wrote."""
    for initialize in initializers or ():
        initialize()
    # Kernels that make arrays call the functions for memory.
    rtsys.initialize(context)
    name, kind, data = library_data
    codegen = context.codegen()
    if kind == "object":
        library: Any = LoadedLibrary(codegen, name, *data)
    else:
        library = codegen.unserialize_library(library_data)
    result = compile_result(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=context.get_executable(library, described, environment),
        fndesc=described,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        reload_init=initializers,
        referenced_envs=referenced,
    )
    for referred in referenced:
        codegen.set_env(referred.env_name, referred)
    return result
