"""Values are read as they were written, to the bit; what describes nothing known is refused."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import msgspec
import numpy as np
import pytest

from clench.core.caching.plain_values import as_arrays, from_arrays


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Leaf:
    numbers: np.ndarray[Any, Any]
    name: str = ""


@dataclass(frozen=True)
class Tree:
    leaves: tuple[Leaf, ...]
    by_colour: dict[Colour, tuple[Leaf, ...]]
    height: float

    def __post_init__(self) -> None:
        assert self.leaves, "the constructor is not asked again"


CLASSES = {kind.__name__: kind for kind in (Colour, Leaf, Tree)}


def again(value: Any) -> Any:
    return from_arrays(as_arrays(value, CLASSES), CLASSES)


def test_plain_values_keep_their_bits_and_types() -> None:
    values = (
        None,
        True,
        0,
        -(2**63),
        2**64 - 1,
        0.1,
        -0.0,
        math.inf,
        5e-324,
        "Ω\n\x1b",
        (),
        [],
        {},
        (1, [2, {3: "x"}]),
    )
    read = again(values)
    assert repr(read) == repr(values)
    assert [type(a) for a in read] == [type(a) for a in values]
    assert math.isnan(again(math.nan))


def test_objects_and_arrays_that_are_shared_stay_shared() -> None:
    fixed = np.array([1.0, -0.0])
    fixed.flags.writeable = False
    leaf, other = Leaf(fixed, "a"), Leaf(fixed)
    tree = Tree((leaf, other, leaf), {Colour.BLUE: (leaf,), Colour.RED: ()}, 2.0)
    read = again(tree)
    assert type(read) is Tree
    assert read.leaves[0] is read.leaves[2] is read.by_colour[Colour.BLUE][0]
    assert read.leaves[0] is not read.leaves[1]
    assert read.leaves[0].numbers is read.leaves[1].numbers
    assert list(read.by_colour) == [Colour.BLUE, Colour.RED]
    assert all(type(colour) is Colour for colour in read.by_colour)
    assert (read.leaves[0].name, read.leaves[1].name, read.height) == ("a", "", 2.0)
    assert read.leaves[0].numbers.tobytes() == fixed.tobytes()


def test_a_class_with_a_constructor_that_refuses_is_read_as_it_was() -> None:
    empty = object.__new__(Tree)
    empty.__dict__.update(leaves=(), by_colour={}, height=1.0)
    assert again(empty).leaves == ()


@pytest.mark.parametrize("value", [np.float64(1.0), {1}, b"x", object(), Tree, (1, complex(1))])
def test_other_types_are_refused(value: object) -> None:
    with pytest.raises(TypeError, match="expected plain values, arrays and known classes, got"):
        as_arrays(value, CLASSES)


@pytest.mark.parametrize("value", ["\udcff", 2**64, (1, -(2**63) - 1)])
def test_what_messagepack_does_not_have_is_refused(value: object) -> None:
    with pytest.raises(ValueError, match="cannot be written"):
        as_arrays(value, CLASSES)


@pytest.mark.parametrize(
    "row",
    [
        [5, "Other", 1],
        [5, "Leaf"],
        [5, "Leaf", [3, 0], "x", 1],
        [5],
        [4, "Colour", "green"],
        [4, "Leaf", "x"],
        [3, 1],
        [6, 0],
        [2, 1],
        [2, [1], 1],
        [99, 1],
        ["x"],
        [],
    ],
)
def test_rows_that_describe_nothing_known_are_refused(row: Any) -> None:
    arrays = [np.frombuffer(msgspec.msgpack.encode(row), np.uint8), np.zeros(2)]
    with pytest.raises(ValueError, match="describes no value"):
        from_arrays(arrays, CLASSES)


@pytest.mark.parametrize(("row", "depth"), [(b"\x92\x01", 100_000), (b"\x93\x04\xa6Colour", 800)])
def test_rows_that_are_nested_too_deep_are_refused(row: bytes, depth: int) -> None:
    """The parser refuses the one, and what turns rows to values the other."""
    described = np.frombuffer(row * depth + b"\xa3red", np.uint8)
    with pytest.raises(ValueError, match="describes no value"):
        from_arrays([described], CLASSES)


def test_no_arrays_and_cut_bytes_are_refused() -> None:
    with pytest.raises(ValueError, match="describes no value"):
        from_arrays([], CLASSES)
    described, *arrays = as_arrays((1.0, "text"), CLASSES)
    for length in range(len(described)):
        with pytest.raises(ValueError, match="describes no value"):
            from_arrays([described[:length], *arrays], CLASSES)
