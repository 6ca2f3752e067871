"""The exact width against another engine: random fingers and objects, blades and needles between the planes."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from oracle.width import judge_case

SAMPLE = 120


def test_a_sample():
    counted, wrong = Counter(), []
    for seed in range(SAMPLE):
        kind, sentences = judge_case(seed)
        counted[kind] += 1
        wrong += sentences
    assert not wrong, "\n".join(wrong)
    assert counted["contact"] > SAMPLE / 3, counted


@pytest.mark.long
def test_ten_thousand():
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        found = list(pool.map(judge_case, range(1000, 11_000), chunksize=100))
    wrong = [sentence for _, sentences in found for sentence in sentences]
    assert not wrong, "\n".join(wrong)
