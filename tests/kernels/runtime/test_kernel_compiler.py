"""Kernels compile with less than Numba does, to the same types, sizes and answers."""

import gc
import itertools
import operator
import os
import subprocess
import sys
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from numba import types
from numba.core import event
from numba.core.compiler import Compiler, Flags
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target

from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.runtime.kernel_cache import KernelCache
from clench.kernels.runtime.kernel_compiler import NEEDLESS, KernelPipeline, KernelTyping, measure_once

NUMBERS = (
    *(types.int64, types.int32, types.uint8, types.float64, types.float32, types.boolean),
    *(types.literal(0), types.literal(3), types.literal(-1)),
)
TUPLES = (types.UniTuple(types.int64, 2), types.Tuple((types.int64, types.float64)))
ARRAYS = (types.float64[::1], types.float64[:, ::1], types.int64[:])
OPERATORS = (
    *(operator.add, operator.sub, operator.mul, operator.truediv, operator.floordiv, operator.mod, operator.pow),
    *(operator.lt, operator.le, operator.eq, operator.ne, operator.and_, operator.or_, operator.lshift),
    *(operator.getitem, operator.iadd),
)

#: Kernels of which one is linked into its caller, and one is called by its symbol.
MODULE = """
from clench.kernels.runtime.compiling import entry_kernel, kernel

@kernel
def leaf(x):
    if x < 0.0:
        raise ValueError("below zero")
    return x + 1.0

@kernel
def middle(x):
    return 2.0 * leaf(x)

@entry_kernel
def top(x):
    return middle(x) - 1.0
"""

#: Calls the kernels; prints answers, and which kernels of this process became machine code.
CALL = """
import some_kernels as m
from clench.kernels.runtime.kernel_compiler import KernelLibrary
x = m.top(3.0)
try:
    m.top(-1.0)
except ValueError as error:
    print(error)
libraries = [c.library for k in (m.leaf, m.middle, m.top) for c in k.overloads.values()]
print(x, [each.runs for each in libraries if isinstance(each, KernelLibrary)])
"""


def resolved(context, operation, kinds):
    """Return the signature of an operation, or that there is none."""
    try:
        found = context.resolve_function_type(context.resolve_value_type(operation), kinds, {})
    except (NumbaError, AttributeError):  # Numba fails for a sum of an array and a tuple in place.
        return None
    return found and (found.args, found.return_type)


@pytest.mark.parametrize("operation", OPERATORS, ids=lambda operation: operation.__name__)
def test_operations_have_the_types_that_numba_finds(operation):
    known = cpu_target.typing_context
    known.refresh()
    remembering, kinds = KernelTyping(known), (*NUMBERS, *TUPLES, *ARRAYS)
    found = 0
    for pair in itertools.product(kinds, kinds):
        expected = resolved(known, operation, pair)
        assert resolved(remembering, operation, pair) == expected, pair
        assert resolved(remembering, operation, pair) == expected, "the second time"
        found += expected is not None
    assert found > 5


def test_sizes_and_alignments_are_those_of_numba():
    plain = cpu_target.target_context
    measured = plain.subtarget()
    measure_once(measured)
    for kind in (*NUMBERS, *TUPLES, *ARRAYS, types.Tuple((types.boolean, types.float64, types.uint8))):
        of_value = plain.get_value_type(kind)
        for each in (of_value, of_value.as_pointer(), plain.get_data_type(kind)):
            for _ in range(2):
                assert measured.get_abi_sizeof(each) == plain.get_abi_sizeof(each)
                assert measured.get_abi_alignment(each) == plain.get_abi_alignment(each)


def names_of(pipeline):
    return [step.__name__ for step, _ in pipeline.passes]


def test_steps_are_those_of_numba_without_the_needless_ones():
    (numbas,) = Compiler.define_pipelines(SimpleNamespace(state=state_of_no_function()))
    kept = names_of(KernelPipeline(numbas))
    assert set(names_of(numbas)) >= NEEDLESS, "each of them is a step of this version"
    assert kept == [name for name in names_of(numbas) if name not in NEEDLESS]


def state_of_no_function():
    """Return what the choice of steps depends on."""
    flags = Flags()
    return SimpleNamespace(flags=flags, func_ir=None)


def combined(a, b, scale):
    c = a * scale + b
    c[0] = -c[1]
    return (c - a).sum() + a[2] * scale


def test_expressions_of_arrays_have_the_bits_of_numba():
    a, b = np.random.default_rng(3).normal(size=(2, 40))
    ours = entry_kernel(allocates=True)(combined)
    assert ours(a, b, 0.3) == numba.njit(combined)(a, b, 0.3)


@entry_kernel
def with_a_closure(x):
    def inner(y):
        return y + x

    return inner(x)


@entry_kernel(allocates=True)
def with_a_generator(x):
    return sum(i * x for i in range(3))


@pytest.mark.parametrize("unfit", [with_a_closure, with_a_generator])
def test_what_the_needless_steps_look_for_does_not_compile(unfit):
    with pytest.raises(NumbaError):
        unfit(1.0)


@kernel
def larger(x, y):
    return max(x, y)


@entry_kernel
def first_user(x):
    return larger(x, 1.0) + max(2.0, x)


@entry_kernel
def second_user(x):
    return max(x, 3.0)


@pytest.fixture
def nothing_on_disk(monkeypatch):
    """Let kernels be compiled, whatever is on disk."""
    monkeypatch.setattr(KernelCache, "load_overload", lambda *_: None)


def test_kernels_share_what_numba_makes_of_a_function(nothing_on_disk):
    first_user(0.5)
    with event.install_recorder("numba:compile") as made:
        assert second_user(0.5) == 3.0
    assert sum(second_user.stats.cache_misses.values()) == 1, "it was compiled here"
    assert [each.data["dispatcher"].py_func.__qualname__ for _, each in made.buffer] == [], "of Numba, nothing was"


@kernel
def twice(n):
    return 2 * n


@entry_kernel
def of_each_size(rows, few):
    return twice(rows[0]) + twice(few[0]) + twice(rows.shape[0]) + twice(np.uint8(250)) + twice(-few[0])


def test_a_kernel_is_compiled_once_for_whole_numbers_of_any_size(nothing_on_disk):
    rows, few = np.array([2**40, 1]), np.array([-7], dtype=np.int32)
    assert of_each_size(rows, few) == 2 * (2**40 - 7 + 2 + 250 + 7)
    assert list(twice.overloads) == [(types.int64,)]


def test_the_collector_runs_again_after_a_compilation():
    @entry_kernel
    def sound(x):
        return x + 1.0

    @entry_kernel
    def unsound(x):
        return x.nothing

    assert sound(1.0) == 2.0
    assert gc.isenabled()
    with pytest.raises(NumbaError):
        unsound(1.0)
    assert gc.isenabled()
    gc.disable()
    try:
        sound(np.float32(1.0))
        assert not gc.isenabled(), "it stays off where it was"
    finally:
        gc.enable()


def test_a_kernel_that_is_linked_becomes_no_machine_code(tmp_path):
    (tmp_path / "some_kernels.py").write_text(MODULE)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def call():
        command = [sys.executable, "-c", CALL]
        return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout

    assert call() == "below zero\n7.0 [False, False, True]\n"
    assert call() == "below zero\n7.0 []\n", "all from disk"
    for path in (tmp_path / "cache").rglob("some_kernels.top-*"):
        path.unlink()
    assert call() == "below zero\n7.0 [True]\n", "linked kernels from disk become part of the one that is compiled"
    for path in (tmp_path / "cache").rglob("some_kernels.middle-*"):
        path.unlink()
    for path in (tmp_path / "cache").rglob("some_kernels.top-*"):
        path.unlink()
    assert call() == "below zero\n7.0 [False, True]\n"
