"""The kernels against the planar oracle: true stops, nothing earlier, free travel to every limit claimed."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from oracle.adapter import solve_planar
from oracle.cases import cases, make_case
from oracle.checking import check_answer
from oracle.scene import PlanarCurve, PlanarFinger, PlanarOutline
from oracle.shapes import ring_of_sides

#: Cases that were wrong once.
WRONG_ONCE = [
    (0, 2037),
    (2024, 9562),
    (2024, 40871),
    (2024, 47220),
    (2024, 56375),
    (2026, 47765),
    (2026, 61947),
    (2026, 151225),
    (2026, 397429),
]


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
        counted["coupled"] += len(case.finger.rates) > case.finger.dofs
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


@pytest.mark.parametrize(("rate", "ends"), [(1.0, "contact"), (-1.0, "limit")])
@pytest.mark.parametrize("lean", [0.1, 0.5, 0.9])
def test_a_notch_of_the_link_leaves_the_corner_that_is_in_it(rate: float, ends: str, lean: float) -> None:
    """A step of the link meets the object's corner, which points into the step, at once; the other way it goes free."""
    step = [(0.0, -0.01), (0.05, -0.01), (0.05, 0.02), (0.03, 0.02), (0.03, 0.0), (0.0, 0.0)]
    sides = ring_of_sides(6)
    link = PlanarOutline(0, np.array(step), sides, 0.0)
    finger = PlanarFinger(np.zeros((1, 2)), np.array([rate]), np.zeros(1, dtype=np.int64), np.array([1.0]), (link,))
    middle = np.pi / 2.0 * (1.0 + lean)
    tips = [0.01 * np.array([np.cos(middle + turn), np.sin(middle + turn)]) for turn in (-0.1, 0.1)]
    curve = PlanarCurve((np.array([0.03, 0.0]) + np.array([np.zeros(2), *tips]),))
    (stage,), _ = solve_planar(finger, curve)
    assert stage.ended == ends
    assert stage.parameter == (0.0 if ends == "contact" else 1.0)
    assert check_answer(finger, curve, (stage,)).failures == ()


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


@pytest.mark.parametrize("lean", [0.0, 1e-12, 1e-10, 3e-9, 3e-8])
@pytest.mark.parametrize("rate", [1.0, -1.0])
def test_a_corner_that_almost_fills_a_notch_presses_into_a_side_of_it(lean: float, rate: float) -> None:
    """The corner's sides lean off the notch's by next to nothing: either way one of them goes in at once."""
    corner = np.array([0.03, 0.003])
    notch = [corner, (0.032, -0.016), (0.063, -0.02), (0.07, 0.011), (0.052, 0.037), (0.0255, 0.021)]
    first, last = (np.arctan2(*(np.array(notch[k]) - corner)[::-1]) for k in (1, -1))
    ends = [corner + 0.008 * np.array([np.cos(a), np.sin(a)]) for a in (first - lean, last + lean)]
    link = PlanarOutline(0, np.array([corner, ends[1], ends[0]]), ring_of_sides(3), 0.0)
    finger = PlanarFinger(np.zeros((1, 2)), np.array([rate]), np.zeros(1, dtype=np.int64), np.array([0.3]), (link,))
    curve = PlanarCurve((np.array(notch),))
    (stage,), _ = solve_planar(finger, curve)
    assert stage.parameter < 1e-6
    assert check_answer(finger, curve, (stage,)).failures == ()
