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

from .symbols import LARGE, Needed, bring, has_a_fixed_symbol, keep_apart, needed_by

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
            if content is None:
                return None
            apart, needed, parts = content
        except _UNREADABLE:
            return None
        if not bring(needed):
            return None
        result = _rebuilt(target_context, *parts)
        if apart is not None:
            keep_apart(apart)
        return result

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel on disk; from here on its callers refer to it if it is large."""
        library, apart = data.library, None
        if len(library._get_compiled_object()) >= LARGE and has_a_fixed_symbol(self._py_func):
            apart = Needed(data.fndesc.llvm_func_name, self._py_func.__module__, self._py_func.__name__, sig)
            # What is linked into callers is empty: they only declare the function.
            library._shared_module = binding.parse_assembly(str(data.codegen._create_empty_module(library.name)))
            keep_apart(apart)
        with self._guard_against_spurious_io_errors():
            self._save_parts(sig, data, apart)

    def _save_parts(self, sig: Any, data: Any, apart: Needed | None) -> None:
        if not self._impl.check_cachable(data):
            return
        self._impl.locator.ensure_cache_path()
        parts = self._impl.reduce(data)
        self._cache_file.save(self._index_key(sig, data.codegen), (apart, needed_by(data.library), parts))


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
