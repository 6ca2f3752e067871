"""Equal values have one fingerprint, and all others have others."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from clench.core.caching.fingerprint import fingerprint


@dataclass(frozen=True)
class Point:
    x: float
    name: str = ""


@dataclass(frozen=True)
class Place:
    x: float
    name: str = ""


def numbers(*values: float, kind: Any = np.float64) -> np.ndarray[Any, Any]:
    return np.array(values, dtype=kind)


OTHERS: list[tuple[Any, ...]] = [
    (None, "None", 0, "", False, [], {}),
    (1, "1", 1.0, True, "True", [1]),
    (0.0, -0.0, 5e-324, float("nan")),
    (0.1, float(np.float32(0.1)), "0.1"),
    (["ab"], ["a", "b"], "ab", [["a"], "b"], ["a", ["b"]]),
    # Without the lengths of texts, one text could hold what separates two.
    (["a", "b"], ["a|b"], ["a|tb"], ["a|t:b"], ["a|t1:b"], ["a|1:b"]),
    ([1, 2], [12], [2, 1]),
    ({1: "x"}, {"1": "x"}, {None: "x"}, {"None": "x"}, {1: "y"}, [1, "x"]),
    (Point(1.0), Place(1.0), Point(1.0, "a"), [1.0, ""]),
]


@pytest.mark.parametrize("values", OTHERS)
def test_other_values_have_another_fingerprint(values: tuple[Any, ...]) -> None:
    found = [fingerprint(value) for value in values]
    assert len(set(found)) == len(found)


def test_arrays_differ_by_numbers_types_and_shapes() -> None:
    zeros = [np.zeros(4), np.zeros((2, 2)), np.zeros((4, 1)), np.zeros(4, np.int64), np.zeros(8, np.float32)]
    found = [fingerprint(each) for each in (*zeros, numbers(0, 0, 0, -0.0), numbers(0, 0, 0, kind=">f8"))]
    assert len(set(found)) == len(found)
    square = np.arange(4.0).reshape(2, 2)
    assert fingerprint(square) == fingerprint(np.asfortranarray(square)) != fingerprint(square.T)


def test_equal_values_have_one_fingerprint() -> None:
    assert fingerprint({"a": 1, "b": 2, 3: None}) == fingerprint({3: None, "b": 2, "a": 1})
    assert fingerprint([1, "x"]) == fingerprint((1, "x")) != fingerprint(1, "x")
    for ours, theirs in ((3, np.int32(3)), (True, np.True_), (0.5, np.float64(0.5))):
        assert fingerprint(ours) == fingerprint(theirs)


def test_another_process_finds_the_same() -> None:
    program = "from clench.core.caching.fingerprint import fingerprint; print(fingerprint({'a': 1, 'b': None}, 'c'))"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == fingerprint({"a": 1, "b": None}, "c")


@pytest.mark.parametrize("value", [b"x", {1}, object(), Point, 1j])
def test_other_types_are_refused(value: object) -> None:
    with pytest.raises(TypeError, match="expected plain values, arrays and dataclasses"):
        fingerprint(value)
