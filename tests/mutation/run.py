"""Put mistakes into the sweep kernels, one at a time, and say which of them no test notices.

``cd tests && python -m mutation.run --files sweep_pairs leaving --count 30``. Kernels run uncompiled, so every mutant
takes as long as the tests named in `TESTS`: seconds. Which mutants are drawn follows from the seed.
"""

import argparse
import ast
import copy
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

SOURCE = Path(__file__).parents[2] / "src"
#: The tests that hold each kernel.
TESTS = {
    "sweep_pairs": ["kernels/test_sweep_pairs.py", "kernels/test_leaving.py"],
    "leaving": ["kernels/test_leaving.py", "kernels/test_sweep_pairs.py"],
    "core_motion": ["kernels/test_sweep_pairs.py", "kernels/test_leaving.py"],
    "closest": ["kernels/test_closest.py", "kernels/test_sweep_pairs.py"],
    "turning": ["kernels/test_turning.py"],
}
#: A mutant that takes longer never ends, which the tests notice [s].
PATIENCE = 300.0
_COMPARED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
_COMPUTED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Yield every mutant of a module: its line, what was changed, and the whole tree."""
    nodes = [node for body in tree.body if isinstance(body, ast.FunctionDef) for node in _body(body)]
    for number, node in enumerate(nodes):
        for kind in _kinds(node):
            changed = copy.deepcopy(tree)
            again = [n for body in changed.body if isinstance(body, ast.FunctionDef) for n in _body(body)]
            before = ast.unparse(again[number])
            _change(again[number], kind)
            yield again[number].lineno, f"{before}  ->  {ast.unparse(again[number])}", changed


def _body(function: ast.FunctionDef) -> list[ast.AST]:
    return [node for statement in function.body for node in ast.walk(statement)]


def _kinds(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _COMPARED:
        return ["bound"] if isinstance(node.ops[0], ast.Eq | ast.NotEq) else ["bound", "reverse"]
    if isinstance(node, ast.BinOp) and type(node.op) in _COMPUTED:
        return ["operator"]
    if isinstance(node, ast.BoolOp):
        return ["and or"]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return ["sign"]
    if isinstance(node, ast.Constant) and isinstance(node.value, float):
        return ["constant"]
    return []


def _change(node: ast.AST, kind: str) -> None:
    if isinstance(node, ast.Compare):
        if kind == "bound":
            node.ops[0] = _COMPARED[type(node.ops[0])]()
        else:
            node.left, node.comparators[0] = node.comparators[0], node.left
    elif isinstance(node, ast.BinOp):
        node.op = _COMPUTED[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd()
    elif isinstance(node, ast.Constant):
        node.value = 2.0 * float(node.value) if node.value else 1.0


def survives(name: str, tree: ast.Module) -> bool:
    """Say whether the tests pass with a mutant in place of a kernel."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(SOURCE, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.nb?", "__pycache__"))
        (Path(folder) / "clench" / "kernels" / f"{name}.py").write_text(ast.unparse(tree))
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-n0", "-p", "no:cacheprovider", *TESTS[name]]
        try:
            done = subprocess.run(
                command,
                cwd=Path(__file__).parents[1],
                env={**os.environ, "PYTHONPATH": folder, "NUMBA_DISABLE_JIT": "1"},
                capture_output=True,
                timeout=PATIENCE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0


def main() -> None:
    """Print the mutants that survive."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--files", nargs="*", default=list(TESTS), choices=list(TESTS))
    parser.add_argument("--count", type=int, default=None, help="mutants of each kernel; all if not given")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    for name in asked.files:
        tree = ast.parse((SOURCE / "clench" / "kernels" / f"{name}.py").read_text())
        if not survives(name, tree):
            raise SystemExit(f"{name}: its tests fail without a mistake in it.")
        found = list(mutants(tree))
        count = len(found) if asked.count is None else min(asked.count, len(found))
        drawn = sorted(np.random.default_rng(asked.seed).permutation(len(found))[:count])
        alive = 0
        for number in drawn:
            line, text, mutant = found[number]
            if survives(name, mutant):
                alive += 1
                print(f"{name}:{line}: {text}", flush=True)
        print(f"{name}: {alive} of {len(drawn)} mutants survive, of {len(found)} that there are", flush=True)


if __name__ == "__main__":
    main()
