"""What is a number that a double holds."""

import math

import numpy as np
import pytest

from clench.core.numbers import is_finite_number


@pytest.mark.parametrize("value", [0, -3, 1.5, np.float32(2.0), np.int64(4), 10**308, -1e308])
def test_numbers(value):
    assert is_finite_number(value)


@pytest.mark.parametrize("value", [True, None, "1", [1.0], math.nan, math.inf, -math.inf, 10**400, -(10**400), 1j])
def test_what_is_none(value):
    assert not is_finite_number(value)
