"""What is kept is found once per object, not per value; and not for ever."""

import numpy as np
import pytest

from clench.base.keeping import kept_by_identity


def test_found_once_per_object() -> None:
    asked = []

    @kept_by_identity(2)
    def total(numbers: np.ndarray, power: np.ndarray) -> float:
        asked.append(numbers)
        return float((numbers**power).sum())

    one, equal, power = np.ones(3), np.ones(3), np.array(2)
    assert total(one, power) == total(one, power) == 3.0
    assert len(asked) == 1
    assert total(equal, power) == 3.0
    assert asked[1] is equal
    total(np.zeros(1), power)
    total(equal, power)
    assert len(asked) == 3
    total(one, power)
    assert len(asked) == 4


def test_an_identity_is_not_taken_over_by_another_object() -> None:
    @kept_by_identity(4)
    def first(numbers: list[int]) -> int:
        return numbers[0]

    # Each list is gone before the next is made; without keeping it, its address would be used again.
    assert [first([k]) for k in range(100)] == list(range(100))


def test_arguments_by_name_are_refused() -> None:
    @kept_by_identity(1)
    def same(numbers: list[int]) -> list[int]:
        return numbers

    with pytest.raises(TypeError, match="same: expected positional arguments"):
        same(numbers=[1])
