"""Compile kernels without what Numba does beyond that for functions of all kinds.

Half of the time of a first solve is Python: Numba asks again what it knows, and reports to nobody. The other half is
LLVM: it optimizes kernels before they are linked, and translates kernels that run as parts of others only. None of it
changes what a kernel computes.
"""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from typing import Any, Final

from numba import types
from numba.core import ir
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.sigutils import normalize_signature
from numba.core.typed_passes import NopythonRewrites
from numba.core.typing.context import Context

from .claims import CLAIMS
from .symbols import described, has_a_fixed_symbol, name_symbols

#: Intermediate code from this size on stays apart [bytes]. A smaller one compiles less, and loads more files.
LARGE: Final = 40_000
#: Steps of Numba that look for what kernels do not have: closures, comprehensions, `with`, functions that are inlined
#: before types are known, `literally`, messages that are put together, notes for a reader. Where a kernel has one of
#: them nevertheless, it does not compile.
NEEDLESS: Final = frozenset(
    (
        *("WithLifting", "InlineClosureLikes", "MakeFunctionToJitFunction", "InlineInlinables", "InlineOverloads"),
        *("FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "RewriteDynamicRaises"),
        *("AnnotateTypes", "DumpParforDiagnostics"),
    )
)
#: Sizes and alignments of types [bytes], by their names.
_MEASURED: Final[dict[Any, int]] = {}
#: The steps that all kernels share, once they are made.
_PIPELINES: Final[list[Any]] = []
#: What operators return, by operator and types.
_OPERATIONS: Final[dict[Any, Any]] = {}


class KernelLibrary(JITCodeLibrary):
    """The code of a kernel on its way from Numba to the processor.

    Args:
        codegen: of Numba. name: of the kernel. called: whether Python calls it. fixed: whether its symbol is the same
            in every process.
    """

    def __init__(self, codegen: Any, name: str, *, called: bool, fixed: bool) -> None:
        super().__init__(codegen, name)
        self._called, self._fixed = called, fixed
        self.enable_object_caching()

    @cached_property
    def is_apart(self) -> bool:
        """Say whether callers refer to its symbol; else they link it."""
        return self._fixed and len(self._final_module.as_bitcode()) >= LARGE

    @property
    def runs(self) -> bool:
        """Say whether it becomes machine code: other kernels than those that are linked into their callers."""
        return self._called or self.is_apart

    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave it to the optimization of the whole, which repeats all of this."""
        ll_module.data_layout = self._codegen._data_layout

    def _finalize_final_module(self) -> None:
        if self.runs:
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_compiled_object(self) -> bytes:
        return super()._get_compiled_object() if self.runs else b""


@cache
def compiler_of(stamp: bytes) -> type[Compiler]:
    """Return the compiler of kernels, the same for all kernels of a module.

    Args:
        stamp: digest that changes when the function has to be compiled again.
    """

    class KernelCompiler(Compiler):
        """Numba's compiler, with names of symbols that are equal in all processes."""

        def define_pipelines(self) -> Any:
            """Return the steps; they are the same for all kernels."""
            if not _PIPELINES:
                _PIPELINES.extend(map(KernelPipeline, super().define_pipelines()))
            return _PIPELINES

        def _compile_bytecode(self) -> Any:
            state = self.state
            fixed, called = has_a_fixed_symbol(state.func_id.func), not state.flags.no_cpython_wrapper
            if fixed:
                name_symbols(state.func_id, state.args, stamp)
            state.library = KernelLibrary(
                state.targetctx.codegen(), state.func_id.func_qualname, called=called, fixed=fixed
            )
            state.flags.no_compile = not called
            measure_once(state.targetctx)
            state.typingctx = typing_of(state.typingctx)
            compiled: Any = super()._compile_bytecode()
            return compiled if called else compiled._replace(entry_point=object())

    return KernelCompiler


class KernelPipeline(PassManager):
    """The steps of another pipeline that kernels need, without a report of each.

    Args:
        other: pipeline.
    """

    def __init__(self, other: PassManager) -> None:
        super().__init__(other.pipeline_name)
        self.passes = [(step, said) for step, said in other.passes if step.__name__ not in NEEDLESS]
        self.finalize()

    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        if isinstance(pss, NopythonRewrites) and not makes_an_array(internal_state):
            return
        pss.analysis = self._analysis
        for step in (pss.run_initialization, pss.run_pass, pss.run_finalizer):
            step(internal_state)


def makes_an_array(state: Any) -> bool:
    """Say whether an expression of a function is an array, such as a sum of arrays; Numba makes one loop of those."""
    assigned = (each for block in state.func_ir.blocks.values() for each in block.find_insts(ir.Assign))
    return any(
        isinstance(each.value, ir.Expr)
        and each.value.op not in ("getitem", "static_getitem", "getattr", "cast")
        and isinstance(state.typemap[each.target.name], types.Array)
        for each in assigned
    )


class KernelTyping(Context):
    """Numba's knowledge of types, which remembers what operators return: it tries NumPy's rules for every sum.

    Args:
        known: context that this one shares all with.
    """

    def __init__(self, known: Context) -> None:
        self.__dict__ = known.__dict__

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        if kws or getattr(getattr(func, "typing_key", None), "__module__", None) != "_operator":
            return super().resolve_function_type(func, args, kws)
        key = func, tuple(args)
        if key not in _OPERATIONS:
            _OPERATIONS[key] = super().resolve_function_type(func, args, kws)
        return _OPERATIONS[key]


@cache
def typing_of(known: Context) -> KernelTyping:
    """Return the one context of all kernels: Numba compiles `max` and `min` anew for every context."""
    return KernelTyping(known)


def measure_once(context: Any) -> None:
    """Let a context remember the sizes of types; llvmlite writes and parses a module for each question."""
    for name in ("get_abi_sizeof", "get_abi_alignment"):
        setattr(context, name, _remembered(name, getattr(context, name)))


def _remembered(name: str, measure: Callable[[Any], int]) -> Callable[[Any], int]:
    def measured(kind: Any) -> int:
        key = name, str(kind)
        if key not in _MEASURED:
            _MEASURED[key] = measure(kind)
        return _MEASURED[key]

    return measured


def compiled(kernel: Any, sig: Any) -> Any:
    """Return the result of compiling a kernel for arguments, or what is on disk.

    Numba's own way measures how long each kernel takes, for nobody: every kernel on the way to a leaf hears of each
    call of LLVM.
    """
    with global_compiler_lock, kernel._compiling_counter, _without_collector():
        args, return_type = normalize_signature(sig)
        found = kernel.overloads.get(tuple(args)) or _loaded(kernel, sig)
        if found is None:
            with CLAIMS.alone(claim_of(kernel, args)):
                found = _loaded(kernel, sig) if CLAIMS.folder else None
                if found is None:
                    kernel._cache_misses[sig] += 1
                    found = _ready(kernel, kernel._compiler.compile(args, return_type))
                    kernel._cache.save_overload(sig, found)
        return found.entry_point


def claim_of(kernel: Any, kinds: Iterable[Any]) -> str:
    """Return a name that a kernel for arguments has in all processes.

    Args:
        kernel: of which. kinds: types of its arguments.
    """
    source = kernel.py_func.__code__
    text = f"{source.co_filename} {source.co_firstlineno} {','.join(map(described, kinds))}"
    return hashlib.sha256(text.encode()).hexdigest()


def _loaded(kernel: Any, sig: Any) -> Any:
    """Return a kernel from disk, ready for others to call, or None."""
    found = kernel._cache.load_overload(sig, kernel.targetctx)
    if found is not None:
        kernel._cache_hits[sig] += 1
        _ready(kernel, found)
    return found


def _ready(kernel: Any, found: Any) -> Any:
    """Return a compiled kernel that other kernels find from here on."""
    kernel.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
    kernel.add_overload(found)
    return found


@contextmanager
def _without_collector() -> Iterator[None]:
    """Compile without the garbage collector: what a compiler builds stays in use, and looking for more takes long."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
