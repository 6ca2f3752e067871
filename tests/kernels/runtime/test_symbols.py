"""Large kernels are compiled once: their callers refer to a symbol that is the same in every process."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kernels.runtime.forked_programs import ForkedPrograms, run_anew

Call = Callable[..., str]
#: A kernel that stays apart, one that is linked in, and a kernel that calls both.
MODULE = """
from clench.kernels.runtime.compiling import entry_kernel, kernel

@kernel
def large(x):
    return x * 2.0 + {offset}

@kernel
def small(x):
    return x + 1.0

@entry_kernel
def caller(x):
    return large(small(x))

@entry_kernel
def caller_of_caller(x):
    return caller(x) - 1.0
"""

#: Calls a kernel; prints the answer, how often each kernel was loaded from disk for Python or a compiler, how many
#: kinds of each there are now, and how many kernels are there by their symbol.
CALL = """
import sys
from clench.kernels.runtime import kernel_compiler, symbols
kernel_compiler.LARGE = 0 if "apart" in sys.argv else 10**9
import some_kernels as m
x = m.caller_of_caller(3.0)
kernels = (m.large, m.small, m.caller, m.caller_of_caller)
hits = (sum(k.stats.cache_hits.values()) for k in kernels)
print(x, *hits, *(len(k.overloads) for k in kernels), len(symbols._APART))
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "some_kernels.py").write_text(MODULE.format(offset="0.5"))
    return tmp_path


@pytest.fixture(scope="module")
def forked() -> Iterator[ForkedPrograms]:
    with ForkedPrograms() as programs:
        yield programs


@pytest.fixture
def call(folder: Path, forked: ForkedPrograms) -> Call:
    """Return a function that calls the kernels in a process of its own, and returns what it prints."""
    return lambda *words: forked.run(CALL, *words, folder=folder).strip()


def call_anew(folder: Path, *words: str) -> str:
    """Call the kernels in a new process, where hashes are others."""
    return run_anew(CALL, *words, folder=folder).strip()


def data_files(folder: Path, kernel: str) -> list[Path]:
    return sorted((folder / "cache").rglob(f"some_kernels.{kernel}-*.code"))


def load(file: Path) -> Any:
    """Return what is in a file of machine code; its symbols name modules in that folder."""
    return pickle.loads(file.read_bytes())


def test_kernels_that_are_linked_in_are_not_loaded_again(folder: Path) -> None:
    assert call_anew(folder) == "7.5 0 0 0 0 1 1 1 1 0"
    assert call_anew(folder) == "7.5 0 0 0 1 0 0 0 1 0"


def test_machine_code_brings_the_kernels_that_it_refers_to(folder: Path) -> None:
    assert call_anew(folder, "apart") == "7.5 0 0 0 0 1 1 1 1 4"
    assert call_anew(folder, "apart") == "7.5 0 0 0 1 0 0 0 1 4"


@pytest.mark.parametrize("lost", ["large", "caller"])
def test_a_lost_kernel_is_compiled_anew_under_the_same_symbol(folder: Path, call: Call, lost: str) -> None:
    call("apart")
    for path in data_files(folder, lost):
        path.unlink()
    first = call("apart").split()
    assert first[0] == "7.5"
    assert first[5:] == ["1", "1", "1", "1", "4"], "what calls the lost kernel is compiled with it"
    assert data_files(folder, lost), "it is on disk again"
    assert call("apart") == "7.5 0 0 0 1 0 0 0 1 4"


@pytest.mark.parametrize("what", ["symbol", "version", "processor"])
def test_machine_code_for_something_else_is_compiled_anew(folder: Path, call: Call, what: str) -> None:
    call("apart")
    (large,), (small,) = data_files(folder, "large"), data_files(folder, "small")
    if what == "symbol":
        large.write_bytes(small.read_bytes())
    else:
        (symbol, version, processor), code = load(large)
        other = (symbol, "0.1", processor) if what == "version" else (symbol, version, ("x", "y", "z"))
        large.write_bytes(pickle.dumps((other, code)))
    assert call("apart").split()[:6] == ["7.5", "0", "1", "0", "0", "1"]
    assert call("apart") == "7.5 0 0 0 1 0 0 0 1 4"


def test_a_damaged_file_of_machine_code_is_written_anew(folder: Path, call: Call) -> None:
    call("apart")
    (large,) = data_files(folder, "large")
    whole = large.stat().st_size
    for size in (0, 100, whole // 2):
        large.write_bytes(large.read_bytes()[:size])
        assert call("apart").startswith("7.5 ")
        assert large.stat().st_size == whole


@pytest.mark.parametrize("name", ["large", "caller"])
def test_machine_code_with_a_wrong_bit_is_compiled_anew(folder: Path, call: Call, name: str) -> None:
    call("apart")
    for path in data_files(folder, name):
        whole = bytearray(path.read_bytes())
        start = whole.index(b"\x7fELF") if b"\x7fELF" in whole else len(whole) // 3
        for place in range(start + 100, start + 400, 60):
            damaged = whole.copy()
            damaged[place] ^= 4
            path.write_bytes(damaged)
            assert call("apart").startswith("7.5 ")


def test_a_change_of_the_source_changes_the_symbols(folder: Path, call: Call) -> None:
    call("apart")
    (folder / "some_kernels.py").write_text(MODULE.format(offset="10.5"))
    assert call("apart").startswith("17.5 0 0 0 0")


def test_a_kernel_that_was_linked_in_may_stay_apart_later(folder: Path, call: Call) -> None:
    call()
    for path in data_files(folder, "caller_of_caller"):
        path.unlink()
    assert call("apart").startswith("7.5 ")
    assert call().startswith("7.5 ")


def test_processes_that_compile_at_once_refer_to_the_same_symbols(folder: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    running = [
        subprocess.Popen([sys.executable, "-c", CALL, "apart"], stdout=subprocess.PIPE, text=True, env=environment)
        for _ in range(4)
    ]
    assert all(process.communicate()[0].startswith("7.5 ") and process.returncode == 0 for process in running)
    assert call_anew(folder, "apart") == "7.5 0 0 0 1 0 0 0 1 4"


#: Two functions of one name, and two tuples of one name with other fields, given to one kernel.
TWINS = """
from collections import namedtuple
from clench.kernels.runtime.compiling import entry_kernel, kernel
import numpy as np

One = namedtuple("Pair", ("a", "b", "x"))
Two = namedtuple("Pair", ("b", "a", "x"))

@kernel
def f(x):
    return x + 100.0

first = f

@kernel
def f(x):
    return 2.0 * x

@kernel
def of_pair(p):
    return p.a - 10.0 * p.b

@entry_kernel
def both(x):
    z = np.zeros(1)
    return first(x) + f(x) + 1000.0 * of_pair(One(x, 3.0, z)) + of_pair(Two(x, 3.0, z))
"""


@pytest.mark.parametrize("way", ["apart", "linked"])
def test_functions_and_tuples_of_one_name_have_symbols_of_their_own(tmp_path: Path, way: str) -> None:
    (tmp_path / "some_kernels.py").write_text(TWINS.replace("@entry_kernel\ndef", "@entry_kernel(allocates=True)\ndef"))
    program = CALL.split("import some_kernels")[0] + "import some_kernels as m; print(m.both(2.0))"
    for _ in range(2):
        assert float(run_anew(program, way, folder=tmp_path)) == 102.0 + 4.0 + 1000.0 * (2.0 - 30.0) + (3.0 - 20.0)
