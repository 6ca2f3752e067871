"""The first of the cases that `oracle/test_width.py` judges, for mutants."""

import pytest

from oracle.width import judge_places


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("order", ["proximal-first", "together"])
def test_a_few(order, seed):
    assert not [sentence for judged in judge_places(seed, order, 2) for sentence in judged.wrong]
