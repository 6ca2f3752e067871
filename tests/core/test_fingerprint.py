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
    (-12, "-12", False, "False", "- 12"),
    (0.0, -0.0, 5e-324, float("nan")),
    (0.1, float(np.float32(0.1)), "0.1"),
    (["ab"], ["a", "b"], "ab", [["a"], "b"], ["a", ["b"]]),
    ([1, 2], [12], [2, 1]),
    ({1: "x"}, {"1": "x"}, {None: "x"}, {"None": "x"}, {1: "y"}, [1, "x"]),
    (Point(1.0), Place(1.0), Point(1.0, "a"), [1.0, ""]),
]


@pytest.mark.parametrize("values", OTHERS)
def test_other_values_have_another_fingerprint(values: tuple[Any, ...]) -> None:
    found = [fingerprint(value) for value in values]
    assert len(set(found)) == len(found)


def test_several_values_are_not_one_that_holds_them() -> None:
    """Without its length, a text could hold what separates two, and a sequence or a mapping what follows it."""
    groups: list[list[tuple[Any, ...]]] = [
        [("a", "b"), ("a|b",), ("a|tb",), ("a|t:b",), ("a|t1:b",), ("ab",)],
        [([1, 2],), ([1], 2), ([], 1, 2), ([[1], 2],), ([[1, 2]],)],
        [({"a": 1, "b": 2},), ({"a": 1}, "b", 2), ({"b": 2}, "a", 1)],
    ]
    for group in groups:
        assert len({fingerprint(*values) for values in group}) == len(group)


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


def test_fingerprints_stay_as_kept_files_have_them() -> None:
    """Batches, datasets and preshapes on disk are found by these: they must never change."""
    value = {"b": [1, -2, True, None], "a": (0.5, "text"), 3: np.arange(3.0)}
    assert fingerprint("schema/1", value, Point(1.0, "p"))[:16] == "86e65af5236f47d6"
