"""The mutants themselves, and the list of files and of tests that must notice them."""

from __future__ import annotations

import ast

import pytest

from mutation.mistakes import mutants
from mutation.nearest import STEPS, TESTS
from mutation.run import TESTS_FOLDER, source_of

SOURCE = """
class Box:
    def fill(self, x, y):
        if x is None:
            return 0
        self.parts[x] = np.minimum(x, 2.0)
        self.keep(y)
        return x + y
"""


def test_every_kind_of_mistake_is_made_once() -> None:
    assert sorted(text for _, text, _ in mutants(ast.parse(SOURCE))) == [
        "2.0  ->  4.0",
        "if x is None:  ->  if False:",
        "np.minimum(x, 2.0)  ->  np.maximum(x, 2.0)",
        "self.keep(y)  ->  None",
        "self.parts[x] = np.minimum(x, 2.0)  ->  _ = np.minimum(x, 2.0)",
        "x + y  ->  x - y",
        "x is None  ->  x is not None",
    ]


@pytest.mark.parametrize("name", TESTS)
def test_files_and_their_tests_exist(name: str) -> None:
    assert source_of(name).is_file()
    assert [test for test in TESTS[name] if not (TESTS_FOLDER / test).is_file()] == []


@pytest.mark.parametrize("name", STEPS)
def test_every_mutant_can_be_compiled(name: str) -> None:
    found = list(mutants(ast.parse(source_of(name).read_text())))
    assert len(found) > 5
    for _, _, tree in found:
        compile(ast.fix_missing_locations(tree), name, "exec")
