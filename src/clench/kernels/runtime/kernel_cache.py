"""Keep compiled kernels on disk, and load them without what only a compiler needs.

Numba prepares its compiler before it loads a function: it imports a hundred modules, SciPy among them, and parses the
function's intermediate code. A loaded kernel only runs machine code. `KernelCache` loads that alone, and leaves the
rest until another kernel is compiled that calls this one. Nothing here is a public interface of Numba; the version
range of the dependency is bounded for it.

A kernel that stays apart (`symbols.py`) has its machine code in a file of its own. Where only other kernels call it,
this file is all that is read of it: neither the types of its arguments nor what describes it to a compiler.
"""

from __future__ import annotations

import itertools
import os
import pickle
import sys
from functools import cached_property
from typing import Any, Final, NamedTuple
from zlib import crc32

import numba
from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.environment import Environment, lookup_environment
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python  # type: ignore[attr-defined]

from .symbols import Needed, bring, keep_apart, needed_by

#: Errors of reading a damaged file, or one that names modules or classes which this version does not have.
_UNREADABLE = (ImportError, AttributeError, pickle.UnpicklingError, EOFError, TypeError, ValueError, IndexError)
#: The cache's folder of each folder with sources.
_FOLDERS: Final[dict[str, str]] = {}
#: What running machine code points to.
_POINTED_TO: Final[list[Any]] = []


class MachineCode(NamedTuple):
    """Machine code, and what it needs to run.

    Args:
        content: an object file. checksum: of the content, since the processor would run whatever a bad disk returns.
        needed: kernels that it calls by their symbols.
        environments: name, module and constants of each function in it. initializers: functions to call before.
    """

    content: bytes
    checksum: int
    needed: tuple[Needed, ...]
    environments: tuple[tuple[str, str, list[Any]], ...]
    initializers: tuple[Any, ...]

    def run(self, context: Any) -> bool:
        """Put it into the engine that holds all machine code; return whether it is whole, with all that it calls."""
        if crc32(self.content) != self.checksum or not bring(self.needed):
            return False
        if not self.content:
            return True
        if not _POINTED_TO:
            _name_memory_functions()
        for initialize in self.initializers:
            initialize()
        codegen = context.codegen()
        engine = codegen._engine
        engine._ee.add_object_file(binding.ObjectFileRef.from_data(self.content))
        engine.finalize_object()
        for name, module, constants in self.environments:
            environment = _environment(name, module, constants)
            _POINTED_TO.append(environment)
            codegen.set_env(name, environment)
        return True


def _name_memory_functions() -> None:
    """Tell the engine where the functions for memory are that kernels call; Numba's own way compiles some of them."""
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def _environment(name: str, module: str, constants: list[Any]) -> Any:
    """Return what a compiled function has of its module; the module itself stays unloaded, for only objects need it."""
    found: Any = lookup_environment(name)
    if found is None:
        loaded = sys.modules.get(module)
        found = Environment({"__name__": module} if loaded is None else vars(loaded))
        found.env_name, found.consts[:] = name, constants
        Environment._memo[name] = found
    return found


def keep_on_disk(dispatcher: Any, stamp: bytes) -> None:
    """Keep what a dispatcher compiles on disk.

    Args:
        dispatcher: of a function. stamp: digest that changes when the function has to be compiled again.
    """
    from_python = not dispatcher.targetoptions.get("no_cpython_wrapper")
    dispatcher._cache = KernelCache(dispatcher.py_func, stamp, from_python=from_python)


def index_of(dispatcher: Any) -> Any:
    """Return what Numba keeps of a kernel on disk: an `IndexDataCacheFile`, which it does not make public."""
    return dispatcher._cache._cache_file


class KernelCache(FunctionCache):
    """The files of one kernel; they are looked for when the kernel is first called.

    Args:
        function: of the kernel. stamp: see `keep_on_disk`. from_python: whether Python calls it.
    """

    def __init__(self, function: Any, stamp: bytes, *, from_python: bool) -> None:
        self._from_python = from_python
        self._name = repr(function)
        self._py_func = function
        self._stamp = stamp
        self._enabled = True

    @cached_property
    def _impl(self) -> CompileResultCacheImpl:
        return CompileResultCacheImpl(self._py_func)

    @property
    def _cache_path(self) -> str:
        sources = os.path.dirname(self._py_func.__code__.co_filename)
        if sources not in _FOLDERS:
            _FOLDERS[sources] = str(self._impl.locator.get_cache_path())
        return _FOLDERS[sources]

    @cached_property
    def _cache_file(self) -> _KernelIndex:
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
            code, described = content
        except _UNREADABLE:
            return None
        there = bring((code,)) if isinstance(code, Needed) else code.run(target_context)
        return _rebuilt(target_context, self._from_python, *described) if there else None

    def load_apart(self, needed: Needed) -> bool:
        """Load the machine code of this kernel that other kernels call by a symbol; return whether it is there."""
        context = cpu_target.target_context
        try:
            with open(os.path.join(self._cache_path, needed.file), "rb") as file:
                known, code = pickle.load(file)
            return known == _known_by(needed.symbol, context.codegen()) and bool(code.run(context))
        except (OSError, *_UNREADABLE):
            return False

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel on disk; from here on its callers refer to it if it is large."""
        library = data.library
        library._ensure_finalized()
        if library.runs:
            for environment in (data.environment, *data._find_referenced_environments()):
                data.codegen.set_env(environment.env_name, environment)
        if library.is_apart:
            # What is linked into callers is empty: they only declare the function.
            library._shared_module = binding.parse_assembly(str(data.codegen._create_empty_module(library.name)))
        with self._guard_against_spurious_io_errors():
            self._save_parts(sig, data, library.is_apart)

    def _save_parts(self, sig: Any, data: Any, apart: bool) -> None:
        if not self._impl.check_cachable(data):
            return
        self._impl.locator.ensure_cache_path()
        library, described, environment, *more, initializers, referenced = self._impl.reduce(data)
        name, _, (content, bitcode) = library
        pointed_to = {
            e.env_name: (e.env_name, e.globals.get("__name__", ""), list(e.consts)) for e in (environment, *referenced)
        }
        environments = tuple(pointed_to.values())
        ready = tuple(initializers or ())
        code = MachineCode(content, crc32(content), needed_by(data.library), environments, ready)
        parts = (name, bitcode, described, pointed_to[environment.env_name], *more)
        key = self._index_key(sig, data.codegen)
        if not apart:
            self._cache_file.save(key, (code, parts))
            return
        symbol, function = described.llvm_func_name, self._py_func
        needed = Needed(symbol, function.__module__, function.__name__, self._cache_file.name_of_code(key))
        self._cache_file._save_data(needed.file, (_known_by(symbol, data.codegen), code))
        self._cache_file.save(key, (needed, parts))
        keep_apart(needed)


def _known_by(symbol: str, codegen: Any) -> tuple[Any, ...]:
    """Return what tells machine code from that of other sources, versions and processors."""
    return symbol, numba.__version__, codegen.magic_tuple()


class _KernelIndex(IndexDataCacheFile):
    """The index of a kernel's files; where an older version left one that cannot be read, it counts as empty."""

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except _UNREADABLE:
            return {}

    def name_of_code(self, key: Any) -> str:
        """Return the name of the file for the machine code of a kernel that stays apart."""
        files = self._load_index()
        free = (name for name in map(self._data_name, itertools.count(1)) if name not in files.values())
        return f"{files.get(key) or next(free)}.code"


class LoadedLibrary(JITCodeLibrary):
    """What runs as machine code from disk. Its intermediate code is parsed when a compiled kernel needs it.

    Args:
        codegen: of Numba. name: of the library. bitcode: the intermediate code.
    """

    def __init__(self, codegen: Any, name: str, bitcode: bytes) -> None:
        super().__init__(codegen, name)
        self._bitcode = bitcode
        self._finalized = self._disable_inspection = True

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
    from_python: bool,
    name: str,
    bitcode: bytes,
    described: Any,
    pointed_to: tuple[str, str, list[Any]],
    signature: Any,
    objectmode: bool,
    lifted: Any,
    annotation: Any,
) -> Any:
    """Return a compile result, whose machine code runs, from what `KernelCache` wrote."""
    library: Any = LoadedLibrary(context.codegen(), name, bitcode)
    environment = _environment(*pointed_to)
    return compile_result(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=context.get_executable(library, described, environment) if from_python else object(),
        fndesc=described,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
    )
