"""Put mistakes into the sweep kernels, one at a time, and say which of them no test notices.

``cd tests && python -m mutation.run --files sweep_pairs leaving --count 30``. Kernels run as plain Python; the oracles
that judge them stay compiled. A mutant takes as long as the tests named in `TESTS`, which end at the first that fails:
seconds. Which mutants are drawn follows from the seed.
"""

import argparse
import ast
import copy
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, ModuleType

import numpy as np

TESTS_FOLDER = Path(__file__).parents[1]
KERNELS = TESTS_FOLDER.parent / "src" / "clench" / "kernels"
PLANAR = "mutation/few_planar.py"
WIDTH = "mutation/few_width.py"
TWO_SIDED = "kernels/test_two_sided_outlines.py"
ROUND = "kernels/test_round_sections_stop.py"
RATES = "kernels/test_rates_and_starts.py"
TOUCHING = "kernels/test_touching.py"
#: The tests that hold each kernel, the quickest first.
TESTS = {
    "turning": ["kernels/test_turning.py", PLANAR],
    "turning_pairs": ["kernels/test_turning_pairs.py", RATES, PLANAR, TWO_SIDED],
    "coupled": ["kernels/test_coupled.py", PLANAR],
    "coupled_pairs": ["kernels/test_coupled_pairs.py", PLANAR, TWO_SIDED],
    "outline_sweep": ["kernels/test_outline_sweep.py", PLANAR, ROUND],
    "outline_gap": ["kernels/test_outline_gap.py", ROUND, TOUCHING, "kernels/test_overlap.py"],
    "touching": [ROUND, TOUCHING],
    "segments": ["kernels/test_segments.py"],
    "closest": ["kernels/test_closest.py", "kernels/test_sweep_pairs.py"],
    "core_motion": ["kernels/test_core_motion.py", "kernels/test_spatial_motion.py"],
    "sweep_pairs": ["kernels/test_sweep_pairs.py", "kernels/test_leaving.py"],
    "leaving": ["kernels/test_leaving.py", "kernels/test_sweep_pairs.py"],
    "earliest": ["kernels/test_earliest.py", "kernels/test_spatial_sweep.py"],
    "spatial_motion": ["kernels/test_spatial_motion.py", "kernels/test_spatial_sweep.py"],
    "sweeping": ["kernels/test_nearness.py", "grasp/test_boxes.py", WIDTH],
    "translation": ["kernels/test_translation.py"],
    "body_sweep": ["kernels/test_body_sweep.py"],
    "parting": ["kernels/test_body_sweep.py"],
    "pair_queue": ["kernels/test_body_sweep.py"],
    "slabs": ["kernels/test_slabs.py", "grasp/test_boxes.py"],
    "apart": ["kernels/test_apart.py"],
    "family_section": ["kernels/test_section_circles.py", PLANAR],
}
#: A mutant that takes this many times as long as the kernel without a mistake never ends, which the tests notice.
PATIENCE = 5.0
#: And what it may take besides [s].
AT_LEAST = 20.0
_COMPARED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
_COMPUTED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
_CHOSEN = {"min": "max", "max": "min"}


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
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _CHOSEN:
        return ["choice"]
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
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        node.func.id = _CHOSEN[node.func.id]


class Mutant(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Load one kernel from a changed tree."""

    def __init__(self, name: str, tree: ast.Module) -> None:
        self.module = f"clench.kernels.{name}"
        self.code: CodeType = compile(ast.fix_missing_locations(tree), str(KERNELS / f"{name}.py"), "exec")

    def find_spec(self, fullname: str, path: object, target: object = None) -> importlib.machinery.ModuleSpec | None:
        """Answer for the kernel alone."""
        return importlib.util.spec_from_loader(fullname, self) if fullname == self.module else None

    def get_code(self, fullname: str) -> CodeType:
        """Return the changed code."""
        return self.code

    def get_source(self, fullname: str) -> None:
        """Return nothing: it is no file's."""

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        """Leave it to Python."""
        return None


def _run_tests(name: str, tree: ast.Module) -> None:
    """Run a kernel's tests on a mutant; the exit code says whether they pass."""
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    os.chdir(TESTS_FOLDER)
    sys.meta_path.insert(0, Mutant(name, tree))

    import hypothesis
    import pytest

    # The same examples for every mutant, and no search for the smallest one that fails.
    quick = [hypothesis.Phase.explicit, hypothesis.Phase.generate]
    hypothesis.settings.register_profile("mutation", derandomize=True, database=None, phases=quick)
    hypothesis.settings.load_profile("mutation")
    options = ["-q", "-x", "-n0", "-p", "no:cacheprovider", "-p", "interpreted"]
    # No time for Python to tidy up: the parent waits.
    os._exit(pytest.main([*options, *TESTS[name]]))


def outcome(name: str, tree: ast.Module, patience: float) -> tuple[bool, float]:
    """Say whether the tests pass with a mutant in place of a kernel, and how long they took [s]."""
    began = time.monotonic()
    child = multiprocessing.get_context("fork").Process(target=_run_tests, args=(name, tree))
    child.start()
    child.join(patience)
    if child.is_alive():
        child.kill()
        child.join()
    return child.exitcode == 0, time.monotonic() - began


def preload() -> None:
    """Import what no mutant changes, once for all of them; nothing of it imports a kernel."""
    for name in ("fcl", "hypothesis", "mujoco", "numba", "pytest", "scipy.optimize", "scipy.spatial", "trimesh"):
        importlib.import_module(name)


def main() -> None:
    """Print the mutants that survive."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--files", nargs="*", default=list(TESTS), choices=list(TESTS))
    parser.add_argument("--count", type=int, default=None, help="mutants of each kernel; all if not given")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    preload()
    for name in asked.files:
        tree = ast.parse((KERNELS / f"{name}.py").read_text())
        passes, seconds = outcome(name, tree, 600.0)
        if not passes:
            raise SystemExit(f"{name}: its tests fail without a mistake in it.")
        found = list(mutants(tree))
        count = len(found) if asked.count is None else min(asked.count, len(found))
        drawn = sorted(np.random.default_rng(asked.seed).permutation(len(found))[:count])
        alive = 0
        for number in drawn:
            line, text, mutant = found[number]
            if outcome(name, mutant, PATIENCE * seconds + AT_LEAST)[0]:
                alive += 1
                print(f"{name}:{line}: {text}", flush=True)
        print(f"{name}: {alive} of {len(drawn)} mutants survive, of {len(found)} that there are", flush=True)


if __name__ == "__main__":
    main()
