"""The search over fingers finds what trying everything finds."""

import itertools

import numpy as np
import pytest

from clench.grasp import combinations
from clench.grasp.combinations import Combination, best_combination


def worst_direction(tables):
    """Judge like steadiness: the least over directions of the best that any finger's set gives there, plus sums."""
    supports, sums, weight = tables

    def judge(sets):
        held = np.max([s[i] for s, i in zip(supports, sets, strict=True)], axis=0)
        total = float(sum(t[i] for t, i in zip(sums, sets, strict=True)) + weight * held.min())
        return Combination(sets, {}, bool(held.min() >= 0.2), total)

    return judge


def random_tables(seed, fingers, sets, directions=40):
    random = np.random.default_rng(seed)
    axes = random.normal(size=(directions, 6))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    wrenches = random.normal(size=(fingers, sets, 12, 6))
    supports = (wrenches @ axes.T).max(axis=2)
    return supports, random.normal(size=(fingers, sets)) * 0.3, random.uniform(0.2, 3.0)


def exhaustive(options, judge):
    return max((judge(sets) for sets in itertools.product(*options)), key=lambda c: c.rank)


@pytest.mark.parametrize("seed", range(250))
def test_it_equals_exhaustive_search(seed):
    random = np.random.default_rng(seed + 1000)
    fingers, sets = int(random.integers(1, 6)), int(random.integers(1, 6))
    judge = worst_direction(random_tables(seed, fingers, sets))
    options = [random.permutation(sets).tolist() for _ in range(fingers)]
    best, second, tried = best_combination(options, judge)
    assert best.rank == exhaustive(options, judge).rank
    assert (second is None) == (tried == 1)
    assert second is None or (second.rank <= best.rank and second.sets != best.sets)


def test_the_ascent_alone_finds_the_best_of_thousands_by_trying_few(monkeypatch):
    monkeypatch.setattr(combinations, "EXHAUSTIVE", 0)
    for seed in range(4):
        judge = worst_direction(random_tables(seed, 5, 6))
        options = [range(6)] * 5
        best, _, tried = best_combination(options, judge)
        assert best.rank == exhaustive(options, judge).rank
        assert tried <= 1200  # of 7776


def test_of_equal_combinations_the_first_wins():
    best, second, _ = best_combination([[2, 0], [1, 3]], lambda sets: Combination(sets, {}, True, 1.0))
    assert best.sets == (2, 1)
    assert second.sets == (2, 3)


def test_what_a_limit_forbids_comes_last():
    def judge(sets):
        return Combination(sets, {}, sets[0] == 1, 5.0 - sets[0])

    assert best_combination([[0, 1]], judge)[0].sets == (1,)


def test_the_same_question_gives_the_same_answer():
    judge = worst_direction(random_tables(3, 5, 8))
    first, again = (best_combination([range(8)] * 5, judge) for _ in range(2))
    assert first == again
