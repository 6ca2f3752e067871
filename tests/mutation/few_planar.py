"""The first of the cases that `oracle/test_against_oracle.py` judges, a few at a time: for mutants and for coverage."""

import pytest

from oracle.test_against_oracle import judge


@pytest.mark.parametrize("first", range(0, 400, 20))
def test_a_few(first):
    assert not judge(7, 20, first)[1]
