"""The exact width against another engine: random fingers and objects, blades and needles between the planes."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import pytest

from oracle.width import judge_case

SAMPLE = 120


@pytest.mark.parametrize("order", ["proximal-first", "together"])
def test_a_sample(order):
    counted, wrong = Counter(), []
    for seed in range(SAMPLE):
        kind, sentences = judge_case(seed, order)
        counted[kind] += 1
        wrong += sentences
    assert not wrong, "\n".join(wrong)
    assert counted["contact"] > SAMPLE / 3, counted


@pytest.mark.long
@pytest.mark.parametrize("order", ["proximal-first", "together"])
def test_ten_thousand(order):
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        found = list(pool.map(partial(judge_case, order=order), range(1000, 11_000), chunksize=100))
    wrong = [sentence for _, sentences in found for sentence in sentences]
    assert not wrong, "\n".join(wrong)
