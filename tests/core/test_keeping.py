"""What is kept is found once per object, not per value; and not for ever."""

import gc
import threading
import weakref

import numpy as np
import pytest

from clench.core.caching.keeping import KeptBySize, kept_by_identity, kept_while_alive


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


def test_what_is_kept_while_alive_goes_with_its_argument() -> None:
    asked = []

    @kept_while_alive
    def total(numbers: np.ndarray) -> list[float]:
        asked.append(len(numbers))
        return [float(numbers.sum())]

    one, two = np.ones(3), np.ones(2)
    found = total(one)
    assert total(one) is found
    assert total(two) == [2.0]
    assert asked == [3, 2]
    # Each array is gone before the next is made, so that addresses are used again.
    assert [total(np.full(1, k))[0] for k in range(100)] == list(range(100))

    class Found:
        pass

    @kept_while_alive
    def made(numbers: np.ndarray) -> Found:
        return Found()

    kept = weakref.ref(made(one))
    assert kept() is not None
    del one
    gc.collect()
    assert kept() is None


def test_kept_by_size_forgets_what_was_asked_for_longest_ago() -> None:
    made: list[str] = []

    def make(text: str) -> str:
        made.append(text)
        return text

    kept = KeptBySize(6, len)
    for text in ("aaa", "bb", "aaa", "c", "dd", "aaa"):
        assert kept.get(text, lambda text=text: make(text)) == text
    assert made == ["aaa", "bb", "c", "dd"]
    assert kept.size == 6
    kept.get("eeeeeeee", lambda: make("eeeeeeee"))
    assert kept.size == 8
    kept.get("eeeeeeee", lambda: make("again"))
    kept.resize(100)
    kept.get("bb", lambda: make("bb"))
    assert made[4:] == ["eeeeeeee", "bb"]
    assert kept.size == 10


def test_threads_that_make_the_same_get_the_same() -> None:
    kept, together, found = KeptBySize(100, len), threading.Barrier(4), []

    def make() -> list[int]:
        together.wait()
        return [1, 2]

    threads = [threading.Thread(target=lambda: found.append(kept.get("key", make))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(each is found[0] for each in found)
    assert kept.size == 2
