"""The public names: what `__all__` promises is there, and nothing else."""

from __future__ import annotations

import ast
import inspect
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import clench


@pytest.mark.parametrize("name", clench.__all__)
def test_every_public_name_resolves(name: str) -> None:
    assert getattr(clench, name) is not None


def test_dir_and_lazy_table_equal_all() -> None:
    assert set(dir(clench)) == set(clench.__all__)
    assert {*clench._HOMES, "__version__"} == set(clench.__all__)
    assert clench.__all__ == sorted(clench.__all__)


def test_names_for_type_checkers_equal_all() -> None:
    tree = ast.parse(Path(clench.__file__).read_text())
    (block,) = (n for n in tree.body if isinstance(n, ast.If))
    imported = {a.name: n.module for n in block.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert imported == clench._HOMES


def test_unknown_name_lists_what_exists() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'grasp_it'; it has: .*GraspSolution"):
        _ = clench.grasp_it


def test_solve_is_a_function_whatever_was_imported_before() -> None:
    programs = [
        "import clench; f = clench.solve",
        "import clench.solver.solution, clench; f = clench.solve",
        "from clench import solve as f",
        "import clench; clench.solve; import clench.solver.record; f = clench.solve",
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
    errors = [getattr(clench, n) for n in clench.__all__ if n.endswith("Error")]
    assert len(errors) >= 6
    assert all(issubclass(e, clench.ClenchError) for e in errors)
