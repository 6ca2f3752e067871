"""Put mistakes into kernels and steps, one at a time, and say which of them no test notices.

``cd tests && python -m mutation.run --files toi_pairs closing/feasibility --count 30``. Kernels run as plain Python;
the oracles that judge them stay compiled. Everything else runs with compiled kernels. A mutant takes as long as the
tests that `nearest` names for its file, which end at the first that fails: seconds. Which mutants are drawn follows
from the seed.
"""

import argparse
import ast
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import multiprocessing
import os
import sys
import time
from pathlib import Path
from types import CodeType

import numpy as np

from mutation.mistakes import mutants
from mutation.nearest import KERNELS, TESTS

TESTS_FOLDER = Path(__file__).parents[1]
PACKAGE = TESTS_FOLDER.parent / "src" / "clench"
#: A mutant that takes this many times as long as the file without a mistake never ends, which the tests notice.
PATIENCE = 5.0
#: And what it may take besides [s].
AT_LEAST = 20.0


class Mutant(importlib.machinery.SourceFileLoader, importlib.abc.MetaPathFinder):
    """Load one module from a changed tree."""

    def __init__(self, name: str, tree: ast.Module) -> None:
        path = str(source_of(name))
        super().__init__(f"clench.{name.removesuffix('/__init__').replace('/', '.')}", path)
        self.code: CodeType = compile(ast.fix_missing_locations(tree), path, "exec")

    def find_spec(self, fullname: str, path: object, target: object = None) -> importlib.machinery.ModuleSpec | None:
        """Answer for the module alone."""
        found = fullname == self.name
        return importlib.util.spec_from_file_location(fullname, self.path, loader=self) if found else None

    def get_code(self, fullname: str) -> CodeType:
        """Return the changed code."""
        return self.code


def source_of(name: str) -> Path:
    """Return the source of a file that `nearest` names."""
    return PACKAGE / f"{name}.py"


def _run_tests(name: str, tree: ast.Module) -> None:
    """Run a file's tests on a mutant; the exit code says whether they pass."""
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
    options = ["-q", "-x", "-n0", "-p", "no:cacheprovider", *(["-p", "interpreted"] if name in KERNELS else [])]
    # No time for Python to tidy up: the parent waits.
    os._exit(pytest.main([*options, *TESTS[name]]))


def outcome(name: str, tree: ast.Module, patience: float) -> tuple[bool, float]:
    """Say whether the tests pass with a mutant in place of a file, and how long they took [s]."""
    began = time.monotonic()
    child = multiprocessing.get_context("fork").Process(target=_run_tests, args=(name, tree))
    child.start()
    child.join(patience)
    if child.is_alive():
        child.kill()
        child.join()
    return child.exitcode == 0, time.monotonic() - began


def preload() -> None:
    """Import what no mutant changes, once for all of them; nothing of it imports this package."""
    for name in ("fcl", "hypothesis", "mujoco", "numba", "pytest", "scipy.optimize", "scipy.spatial", "trimesh"):
        importlib.import_module(name)


def survivors(name: str, count: int | None = None, seed: int = 0) -> tuple[list[str], int, int]:
    """Return the mutants of a file that its tests do not notice, how many were tried, and how many there are.

    Args:
        name: see `nearest`. count: how many to draw; None: all. seed: of the draw.

    Raises:
        ValueError: the tests fail without a mistake.
    """
    tree = ast.parse(source_of(name).read_text())
    passes, seconds = outcome(name, tree, 600.0)
    if not passes:
        raise ValueError(f"{name}: its tests fail without a mistake in it.")
    found = list(mutants(tree))
    drawn = sorted(np.random.default_rng(seed).permutation(len(found))[:count])
    alive = []
    for number in drawn:
        line, text, mutant = found[number]
        if outcome(name, mutant, PATIENCE * seconds + AT_LEAST)[0]:
            alive.append(f"{name}:{line}: {text}")
            print(alive[-1], flush=True)
    return alive, len(drawn), len(found)


def named(text: str) -> str:
    """Return the file that a whole name, or the end of one, stands for."""
    found = [name for name in TESTS if f"/{name}".endswith(f"/{text}")]
    if len(found) != 1:
        raise argparse.ArgumentTypeError(f"'{text}' is no file with tests; there are: {', '.join(TESTS)}")
    return found[0]


def main() -> None:
    """Print the mutants that survive."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--files", nargs="*", type=named, default=list(TESTS), help="as closing/feasibility or reach")
    parser.add_argument("--count", type=int, default=None, help="mutants of each file; all if not given")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    preload()
    for name in asked.files:
        try:
            alive, tried, there = survivors(name, asked.count, asked.seed)
        except ValueError as error:
            raise SystemExit(str(error)) from None
        print(f"{name}: {len(alive)} of {tried} mutants survive, of {there} that there are", flush=True)


if __name__ == "__main__":
    main()
