"""The kernels against the planar oracle: true stops, nothing earlier, free travel to every limit claimed."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import pytest

from oracle.adapter import solve_planar
from oracle.cases import cases, make_case
from oracle.checking import check_answer

#: Cases that were wrong once.
WRONG_ONCE = [(0, 2037), (2024, 9562), (2024, 40871), (2024, 47220), (2024, 56375)]


def judge(seed: int, count: int, start: int = 0) -> tuple[Counter[str], list[str]]:
    """Return what was counted over cases, and a sentence for each that is wrong."""
    counted: Counter[str] = Counter()
    wrong = []
    for case in cases(seed, count, start):
        stages, _ = solve_planar(case.finger, case.curve)
        verdict = check_answer(case.finger, case.curve, stages)
        counted["overlap"] += verdict.overlaps_at_start
        counted["stages"] += len(verdict.stages)
        counted["contacts"] += sum(s.ended == "contact" for s in stages) if verdict.stages else 0
        counted["coupled"] += len(case.finger.rates) > case.finger.groups
        counted["grazing"] += verdict.grazing
        counted["unresolved"] += verdict.unresolved
        if not verdict.ok:
            wrong.append(f"{case.name} ({case.seed}, {case.index}): {verdict.failures}")
    return counted, wrong


def assert_a_fair_sample(counted: Counter[str], count: int) -> None:
    """A sample that hardly touches, or that the oracle cannot judge, would prove nothing."""
    assert counted["overlap"] < 0.1 * count
    assert counted["contacts"] > 0.3 * count
    assert counted["coupled"] > 0.1 * count
    assert counted["grazing"] < 0.05 * counted["stages"]
    assert counted["unresolved"] < 0.001 * counted["stages"]


def test_a_sample() -> None:
    count = 1500
    counted, wrong = judge(7, count)
    assert not wrong, "\n".join(wrong)
    assert_a_fair_sample(counted, count)


@pytest.mark.parametrize(("seed", "index"), WRONG_ONCE)
def test_cases_that_were_wrong_once(seed: int, index: int) -> None:
    case = make_case(seed, index)
    stages, _ = solve_planar(case.finger, case.curve)
    assert check_answer(case.finger, case.curve, stages).failures == ()


@pytest.mark.long
def test_a_hundred_thousand() -> None:
    count, piece = 100_000, 2_500
    starts = range(0, count, piece)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(judge, [2024] * len(starts), [piece] * len(starts), starts))
    counted = sum((c for c, _ in found), Counter())
    wrong = [sentence for _, sentences in found for sentence in sentences]
    assert not wrong, "\n".join(wrong)
    assert_a_fair_sample(counted, count)
