"""Fitted weights agree with closed forms, come back from examples made with them, and are judged on others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import CommandError
from clench.scoring.fitting import Examples, fit_weights, likeliest, told_right


def examples(better=(), worse=(), outcomes=(), held=(), names=("a",)):
    size = len(names)
    return Examples(
        tuple(names),
        np.array(better, dtype=float).reshape(-1, size),
        np.array(worse, dtype=float).reshape(-1, size),
        np.array(outcomes, dtype=float).reshape(-1, size),
        np.array(held, dtype=bool),
    )


@settings(deadline=None)  # loading SciPy takes a second
@given(st.integers(1, 30), st.integers(1, 30))
def test_one_criterion_gives_the_logarithm_of_the_odds(wins, losses):
    """With differences of one, the likeliest weight is ln(wins / losses), 0 when that is negative."""
    pairs = examples([[1.0]] * wins + [[0.0]] * losses, [[0.0]] * wins + [[1.0]] * losses)
    weights, _ = likeliest(pairs, 1e-12)
    assert weights[0] == pytest.approx(max(np.log(wins / losses), 0.0), abs=1e-4)


def test_outcomes_give_the_logistic_intercept():
    """At x = 0 three of four are held, at x = 1 nine of ten: b = ln 3, w = ln 9 - ln 3."""
    rows = [[0.0]] * 4 + [[1.0]] * 10
    weights, intercept = likeliest(examples(outcomes=rows, held=[1, 1, 1, 0] + [1] * 9 + [0]), 1e-12)
    assert intercept == pytest.approx(np.log(3.0), abs=1e-4)
    assert weights[0] == pytest.approx(np.log(3.0), abs=1e-4)


def test_weights_come_back_from_examples_made_with_them():
    random = np.random.default_rng(5)
    true = np.array([2.0, 0.0, 4.0])
    one, other = random.normal(size=(2, 3000, 3))
    wins = random.random(3000) < 1.0 / (1.0 + np.exp(-(one - other) @ true))
    better, worse = np.where(wins[:, None], one, other), np.where(wins[:, None], other, one)
    fit = fit_weights(examples(better, worse, names=("a", "b", "c")))
    np.testing.assert_allclose(fit.weights, [0.5, 0.0, 1.0], atol=0.05)
    assert fit.held_out == pytest.approx(fit.accuracy, abs=0.01)
    assert fit.held_out == pytest.approx(wins_told(one, other, wins, true), abs=0.02)


def wins_told(one, other, wins, true):
    return float((((one - other) @ true > 0.0) == wins).mean())


def test_accuracy_that_is_only_learnt_by_heart_is_not_held_out():
    random = np.random.default_rng(2)
    sides = random.normal(size=(2, 30, 12))
    fit = fit_weights(examples(*sides, names=tuple("abcdefghijkl")))
    assert fit.held_out < fit.accuracy


def test_ties_count_half():
    same = examples([[1.0], [1.0]], [[1.0], [0.0]])
    assert told_right(same, np.ones(1), None) == 0.75


def test_pairs_and_outcomes_count_together():
    both = examples([[1.0]] * 3, [[0.0]] * 3, [[2.0], [0.0]], [True, False])
    fit = fit_weights(both)
    assert (fit.pairs, fit.outcomes, fit.folds) == (3, 2, 5)
    assert fit.accuracy == 1.0


def test_too_few_examples_and_criteria_that_do_not_tell():
    with pytest.raises(CommandError, match="at least 4 pairs and outcomes, got 1"):
        fit_weights(examples([[1.0]], [[0.0]]))
    with pytest.raises(CommandError, match=r"no criterion \(a\) tells better from worse"):
        fit_weights(examples([[0.0]] * 5, [[1.0]] * 5))


def test_the_same_examples_give_the_same_fit():
    random = np.random.default_rng(1)
    made = examples(*random.normal(size=(2, 20, 2)) + np.array([0.5, 0.2])[None] * [[[1]], [[0]]], names=("a", "b"))
    one, again = fit_weights(made), fit_weights(made)
    assert one.weights.tobytes() == again.weights.tobytes()
    assert one.held_out == again.held_out


@pytest.mark.parametrize("held", [True, False])
def test_outcomes_that_are_all_the_same_tell_nothing(held):
    many = [[float(n)] for n in range(3, 11)]
    with pytest.raises(CommandError, match="all 8 outcomes are " + ("held" if held else "dropped")):
        fit_weights(examples([], [], many, [held] * 8))
    pairs = [[2.0]] * 3, [[1.0]] * 3
    alone, _ = likeliest(examples(*pairs), 0.01)
    weights, intercept = likeliest(examples(*pairs, many, [held] * 8), 0.01)
    assert weights.tobytes() == alone.tobytes()
    assert intercept == (np.inf if held else -np.inf)


def test_no_criterion_in_common_is_said():
    with pytest.raises(CommandError, match="no criterion has a score on every side"):
        fit_weights(Examples((), np.empty((5, 0)), np.empty((5, 0)), np.empty((0, 0)), np.empty(0, dtype=bool)))
