"""The search over fingers finds what trying everything finds, and says whether it is sure."""

import itertools
import math

import numpy as np
import pytest

from clench.scoring.combinations import MOST_JUDGED, Ceilings, Combination, best_combination


class WorstDirection:
    """Judge like epsilon: the least over directions of the best that any finger's candidate gives there, plus sums.

    Args:
        supports: by finger, set and direction. sums: by finger and set. options: sets of every finger.
        limit: what the worst direction has to reach. told: whether ceilings are known.
    """

    criteria = 0

    def __init__(self, supports, sums, weight, options, *, limit=0.2, told=True):
        self.supports, self.sums, self.weight = supports, sums, weight
        self.options, self.limit, self.told = options, limit, told
        counts = [len(o) for o in options]
        self.unbeaten = np.full(counts, np.inf)

    def worst(self, sets):
        return np.max([s[i] for s, i in zip(self.supports, sets, strict=True)], axis=0)

    def __call__(self, sets):
        held = self.worst(sets).min()
        total = float(sum(t[i] for t, i in zip(self.sums, sets, strict=True)) + self.weight * held)
        return Combination(sets, {}, bool(held >= self.limit), total)

    def ceilings(self, places):
        if not self.told:
            return None
        direction = self.worst([o[p] for o, p in zip(self.options, places, strict=True)]).argmin()
        reach, total = np.array(-np.inf), np.array(0.0)
        for support, sums, own in zip(self.supports, self.sums, self.options, strict=True):
            reach = np.maximum.outer(reach, support[list(own), direction])
            total = np.add.outer(total, sums[list(own)])
        self.unbeaten = np.minimum(self.unbeaten, reach)
        return Ceilings(self.unbeaten >= self.limit, total + self.weight * self.unbeaten)


def random_judge(seed, fingers, sets, directions=40, **changes):
    """Make a case: adversarial ones have many directions, and sums that say little."""
    random = np.random.default_rng(seed)
    axes = random.normal(size=(directions, 6))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    wrenches = random.normal(size=(fingers, sets, 12, 6))
    supports = (wrenches @ axes.T).max(axis=2)
    options = [random.permutation(sets).tolist() for _ in range(fingers)]
    sums = random.normal(size=(fingers, sets)) * random.choice([0.3, 0.01])
    return WorstDirection(supports, sums, random.uniform(0.2, 3.0), options, **changes)


def exhaustive(judge):
    return max((judge(sets) for sets in itertools.product(*judge.options)), key=lambda c: c.rank)


@pytest.mark.parametrize("seed", range(300))
def test_it_equals_exhaustive_search_and_says_so(seed):
    random = np.random.default_rng(seed + 1000)
    fingers, sets = int(random.integers(1, 6)), int(random.integers(1, 6))
    judge = random_judge(seed, fingers, sets, directions=int(random.choice([40, 400])))
    found = best_combination(judge.options, judge)
    assert found.best.rank[0] == exhaustive(judge).allowed
    assert found.best.total == pytest.approx(exhaustive(judge).total, abs=2e-9)
    assert found.proved
    assert (found.second is None) == (fingers * sets == fingers)
    assert found.second is None or (
        found.second.rank <= found.best.rank and found.second.candidates != found.best.candidates
    )


@pytest.mark.parametrize("seed", range(100))
def test_without_ceilings_all_are_tried_while_they_are_few(seed):
    judge = random_judge(seed, 3, 6, told=False)
    found = best_combination(judge.options, judge)
    assert found.best == exhaustive(judge)
    assert found.proved
    assert found.tried == 6**3 <= MOST_JUDGED


def test_ceilings_prove_the_best_of_thousands_by_trying_few():
    for seed in range(8):
        judge = random_judge(seed, 5, 6)
        found = best_combination(judge.options, judge)
        assert found.best.total == pytest.approx(exhaustive(judge).total, abs=2e-9)
        assert found.proved
        assert found.tried <= 60  # of 7776


def test_what_is_not_proved_is_said_not_to_be():
    better = 0
    for seed in range(12):
        judge = random_judge(seed, 5, 6, told=False)
        found = best_combination(judge.options, judge)
        assert not found.proved
        assert found.tried < math.prod([6] * 5)
        better += found.best.rank == exhaustive(judge).rank
    assert better >= 6


def test_false_hopes_end_and_are_no_proof():
    """Ceilings that are far too high: the search gives up, and says that it did."""
    judge = random_judge(1, 5, 6)
    ceilings = judge.ceilings
    judge.ceilings = lambda places: ceilings(places)._replace(total=np.full((6,) * 5, 1e6))
    found = best_combination(judge.options, judge)
    assert not found.proved
    assert found.tried < 1500


class Plain(WorstDirection):
    """Judge by a function alone."""

    def __init__(self, rank):
        self.rank = rank

    def __call__(self, sets):
        return Combination(sets, {}, *self.rank(sets))

    def ceilings(self, places):
        return None


def test_of_equal_combinations_the_first_wins():
    found = best_combination([[2, 0], [1, 3]], Plain(lambda sets: (True, 1.0)))
    assert found.best.candidates == (2, 1)
    assert found.second.candidates == (2, 3)


def test_what_a_limit_forbids_comes_last():
    assert best_combination([[0, 1]], Plain(lambda sets: (sets[0] == 1, 5.0 - sets[0]))).best.candidates == (1,)


def test_the_same_question_gives_the_same_answer():
    first, again = (best_combination(j.options, j) for j in (random_judge(3, 5, 8), random_judge(3, 5, 8)))
    assert first == again
