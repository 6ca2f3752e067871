"""What is compiled is kept on disk for as long as nothing that went into it has changed."""

import ast
import importlib.util
import inspect
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from benchmarks.peers.kernels import stepped_closing
from clench.kernels.closing import close_candidate
from clench.kernels.runtime import compiling, warming
from clench.kernels.runtime.kernel_compiler import compiler_of

KERNELS = Path(compiling.__file__).parents[1]


def test_every_kernel_is_kept_by_the_sources_that_it_is_compiled_from():
    for kernel in warming.JOBS:
        module = Path(sys.modules[kernel.py_func.__module__].__file__)
        assert compiling.index_of(kernel)._source_stamp == compiling.source_stamp(module)


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """A copy of the decorators in a folder of its own, with three modules: the first one imports the second."""
    runtime = tmp_path / "runtime"
    runtime.mkdir()
    copy = shutil.copy(compiling.__file__, runtime)
    for name in ("by_reference", "claims", "kernel_cache", "kernel_compiler", "symbols"):
        Path(runtime, f"{name}.py").write_text("HANDED = 1\n")
    spec = importlib.util.spec_from_file_location("clench.kernels.runtime.copied", copy)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    Path(tmp_path, "caller.py").write_text("def late():\n    from .called import STEPS\n")
    Path(tmp_path, "called.py").write_text("STEPS = 8\n")
    Path(tmp_path, "other.py").write_text("STEPS = 8\n")
    numbers = Path(tmp_path, "tolerances.py")
    numbers.write_text("TOUCH = 1\n")
    monkeypatch.setattr(module.tolerances, "__file__", str(numbers))
    return module


def stamps(module) -> dict[str, bytes]:
    module.source_stamp.cache_clear()
    module._read.cache_clear()
    folder = Path(module.__file__).parents[1]
    return {name: module.source_stamp(folder / f"{name}.py") for name in ("caller", "called", "other")}


def test_a_change_of_a_kernel_changes_its_stamp_and_those_of_its_callers_only(copied):
    before = stamps(copied)
    Path(copied.__file__).parents[1].joinpath("called.py").write_text("STEPS = 9\n")
    after = stamps(copied)
    assert after["called"] != before["called"]
    assert after["caller"] != before["caller"]
    assert after["other"] == before["other"]


@pytest.mark.parametrize("name", ["runtime/compiling", "runtime/by_reference", "tolerances"])
def test_a_change_of_the_decorators_or_of_the_numbers_changes_every_stamp(copied, name):
    before = stamps(copied)
    # The copy of the decorators counts under the name that it was loaded from.
    with Path(copied.__file__).parents[1].joinpath(f"{name}.py").open("a") as file:
        file.write("# changed\n")
    after = stamps(copied)
    assert all(after[module] != before[module] for module in before)


@pytest.mark.parametrize("statement", ["from clench.kernels.called import STEPS", "from .beside import STEPS"])
def test_a_kernel_of_another_folder_is_kept_by_the_kernels_that_it_imports(copied, statement):
    folder = Path(copied.__file__).parents[1] / "elsewhere"
    folder.mkdir()
    folder.joinpath("beside.py").write_text("from ..called import STEPS\n")
    outside = folder / "outside.py"
    outside.write_text(f"{statement}\n")
    before = copied.source_stamp(outside)
    Path(copied.__file__).parents[1].joinpath("other.py").write_text("STEPS = 9\n")
    stamps(copied)
    assert copied.source_stamp(outside) == before
    Path(copied.__file__).parents[1].joinpath("called.py").write_text("STEPS = 9\n")
    stamps(copied)
    assert copied.source_stamp(outside) != before


def imported_files(path: Path) -> set[Path]:
    """Return the files with kernels that a file imports, as Python does."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            found.add(path.parents[node.level - 1].joinpath(*node.module.split(".")).with_suffix(".py"))
        elif isinstance(node, ast.ImportFrom) and node.module.startswith("clench.kernels"):
            found.add(KERNELS.joinpath(*node.module.split(".")[2:]).with_suffix(".py"))
    return found


@pytest.mark.parametrize("folder", [KERNELS, Path(stepped_closing.__file__).parent])
def test_modules_of_kernels_import_each_other_and_numbers_only_as_the_stamp_expects(folder):
    outside, files = set(), sorted(folder.rglob("*.py"))
    assert len(files) > 2
    for path in files:
        assert imported_files(path) == set(map(Path, compiling._read(str(path))[1])), path
        assert all(file.is_file() for file in imported_files(path)), path
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                outside |= {alias.name for alias in node.names if alias.name.startswith("clench")}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module.startswith("clench"):
                outside.add(node.module)
    # Only numbers of `tolerances` are compiled in; functions that Python runs call the others.
    keys = {"clench.core.caching.fingerprint", "clench.core.caching.number_code"}
    called = {"clench.core.memory", "clench.core.threads", *keys}
    allowed = {"clench.core", "clench.core.tolerances", *called}
    assert {module for module in outside if not module.startswith("clench.kernels.")} <= allowed


def test_a_kernel_without_an_entry_refuses_a_call_from_python() -> None:
    with pytest.raises(TypeError, match="close_dof: expected a call from a kernel"):
        close_candidate.close_dof(1.0)


def test_an_index_of_another_version_on_disk_is_no_index(tmp_path, monkeypatch) -> None:
    index = compiling.index_of(warming.solve_poses)
    stamp = pickle.dumps((index._source_stamp, {})).replace(b".", b"")
    path = tmp_path / "old.nbi"
    path.write_bytes(pickle.dumps(numba.__version__) + b"cclench.kernels.no_such_module\nArrays\n." + stamp)
    monkeypatch.setattr(index, "_index_path", str(path))
    assert index._load_index() == {}
    path.unlink()
    assert index._load_index() == {}


def test_kernels_run_as_plain_python_with_the_plugin() -> None:
    tests = Path(__file__).parents[2]
    code = "import interpreted; from clench.kernels.toi.core_motion import move_core; print(type(move_core).__name__)"
    run = subprocess.run([sys.executable, "-c", code], cwd=tests, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "function"


def test_a_kernel_has_the_signature_of_its_function_and_asks_for_it_once(monkeypatch):
    def plain(a: float, b) -> int: ...
    def with_default(a: float, b: int = 2) -> None: ...
    def with_any(a, *more, key=1, **others): ...

    for function in (plain, with_default, with_any, lambda: 0):
        before = inspect.signature(function)
        compiling._note_signature(function)
        assert inspect.signature(function) == before
    assert plain.__signature__ is inspect.signature(plain)

    # Looking at a function's code, which Numba did twice for each of 500 kernels, takes ten times as long.
    looked_at = []
    look = inspect._signature_from_function
    monkeypatch.setattr(inspect, "_signature_from_function", lambda *a, **k: looked_at.append(a) or look(*a, **k))
    assert numba.njit(plain).py_func is plain
    assert not looked_at
    numba.njit(with_default)
    assert looked_at


def test_kernels_of_one_module_share_their_compiler():
    assert compiler_of(b"one") is compiler_of(b"one")
    assert compiler_of(b"one") is not compiler_of(b"other")
