"""The public names: what `__all__` promises is there, and nothing else."""

from __future__ import annotations

import ast
import importlib
import inspect
import pydoc
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import clench

SPACES = [clench, *(importlib.import_module(f"clench.{name}") for name in clench._NAMESPACES)]
LAZY = [*SPACES, clench.dataset]


@pytest.mark.parametrize("space", LAZY, ids=lambda space: space.__name__)
def test_dir_and_lazy_table_equal_all(space: ModuleType) -> None:
    assert set(dir(space)) == set(space.__all__)
    assert set(space._HOMES) == {*space.__all__} - {"__version__"}
    assert sorted(space.__all__) == space.__all__
    for name in space.__all__:
        assert getattr(space, name) is not None


@pytest.mark.parametrize("space", LAZY, ids=lambda space: space.__name__)
def test_names_for_type_checkers_equal_all(space: ModuleType) -> None:
    tree = ast.parse(Path(space.__file__ or "").read_text())
    (block,) = (n for n in tree.body if isinstance(n, ast.If))
    imported = {a.name: n.module for n in block.body if isinstance(n, ast.ImportFrom) for a in n.names}
    spaces = dict.fromkeys(clench._NAMESPACES, "clench")
    assert imported == (clench._HOMES | spaces if space is clench else space._HOMES)


def test_the_root_is_small_and_finds_the_names_of_namespaces() -> None:
    assert len(clench.__all__) <= 32
    for space in SPACES:
        for name in space._HOMES:
            assert getattr(clench, name) is getattr(space, name)
            assert space._HOMES[name] == clench._HOMES.get(name, space._HOMES[name])


def test_unknown_name_lists_what_exists() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'grasp_it'; it has: .*GraspSolution.*and the namespaces"):
        _ = clench.grasp_it
    with pytest.raises(AttributeError, match=r"'clench.formats' has no attribute 'urdf'; it has: GraspFormat"):
        _ = clench.formats.urdf
    with pytest.raises(AttributeError, match="it is called 'HardwareHand' now"):
        _ = clench.DrivenHand


def test_solve_is_a_function_whatever_was_imported_before() -> None:
    programs = [
        "import clench; f = clench.solve",
        "import clench.solver.solution, clench; f = clench.solve",
        "from clench import solve as f",
        "import clench; clench.solve; import clench.solver.analysis.record; f = clench.solve",
    ]
    for program in programs:
        run = subprocess.run(
            [sys.executable, "-c", program + "; import types; assert type(f) is types.FunctionType"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr


def test_help_shows_the_docstring_of_solve() -> None:
    text = pydoc.plain(pydoc.render_doc(clench.solve))
    assert "solve(hand" in text
    assert inspect.getdoc(clench.solve).splitlines()[0] in text


def test_every_error_is_a_clench_error() -> None:
    errors = [getattr(clench.errors, n) for n in clench.errors.__all__]
    assert len(errors) >= 6
    assert all(issubclass(e, clench.ClenchError) for e in errors)
