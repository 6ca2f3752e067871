"""The dual simplex method finds what another solver finds, also where programs are degenerate or have no solution."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from clench.core.pose import FloatArray
from clench.kernels.mechanics.least_cost import least_cost


def least(rows: FloatArray, most: FloatArray, cost: FloatArray) -> FloatArray | None:
    x = np.full(rows.shape[1], np.nan)
    return x if least_cost(rows, most, cost, x) else None


def check(rows: FloatArray, most: FloatArray, cost: FloatArray) -> None:
    """Compare with HiGHS: whether there is a solution, that it meets all demands, and its cost."""
    found = least(rows, most, cost)
    judge = linprog(cost, A_ub=rows, b_ub=most, method="highs")
    assert (found is not None) == (judge.status == 0)
    if found is not None:
        size = 1.0 + float(np.abs(found).max())
        assert found.min() >= 0.0
        assert (rows @ found - most).max() <= 1e-9 * size
        np.testing.assert_allclose(cost @ found, judge.fun, rtol=1e-8, atol=1e-9)


@given(st.integers(0, 10**6), st.integers(1, 7), st.integers(1, 13))
def test_random_programs(seed: int, size: int, count: int) -> None:
    random = np.random.default_rng(seed)
    check(random.normal(size=(count, size)), random.normal(size=count) + 0.3, np.abs(random.normal(size=size)))


@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 10))
def test_whole_numbers_and_equalities(seed: int, size: int, count: int) -> None:
    """Whole numbers make ties and equal rows; a row and its negative are an equality."""
    random = np.random.default_rng(seed)
    rows, most = random.integers(-2, 3, (count, size)) + 0.0, random.integers(-2, 3, count) + 0.0
    check(np.vstack([rows, -rows[:1]]), np.append(most, -most[0]), random.integers(0, 3, size) + 0.0)


def test_the_origin_is_the_answer_if_it_meets_all_demands() -> None:
    found = least(np.ones((1, 2)), np.ones(1), np.ones(2))
    assert found is not None
    assert found.tolist() == [0.0, 0.0]


def test_a_demand_that_nothing_meets() -> None:
    assert least(np.ones((1, 2)), -np.ones(1), np.ones(2)) is None
    assert least(np.zeros((1, 2)), -np.ones(1), np.ones(2)) is None
    assert least(np.array([[1.0], [-1.0]]), np.array([1.0, -2.0]), np.ones(1)) is None
