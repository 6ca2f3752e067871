"""The first of the cases that `oracle/test_against_oracle.py` judges, for mutants: they take a second or two."""

from oracle.test_against_oracle import judge


def test_a_few():
    for first in range(0, 300, 20):
        assert not judge(7, 20, first)[1]
