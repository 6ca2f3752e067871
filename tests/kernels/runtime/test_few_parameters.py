"""Kernels take few parameters: what belongs together is a bundle."""

import ast
from pathlib import Path

import clench.kernels

MOST = 10
FOLDER = Path(clench.kernels.__path__[0])


def kernels(path):
    """Return the functions of a file that a decorator makes a kernel."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef):
            called = [d.func if isinstance(d, ast.Call) else d for d in node.decorator_list]
            if any(isinstance(d, ast.Name) and d.id in ("kernel", "entry_kernel") for d in called):
                yield node


def test_no_kernel_has_more_than_ten_parameters() -> None:
    found = [(path.stem, node.name, len(node.args.args)) for path in FOLDER.rglob("*.py") for node in kernels(path)]
    assert len(found) > 500
    assert [row for row in found if row[2] > MOST] == []
