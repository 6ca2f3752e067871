"""The front over the fingers is that of all combinations of their sets."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import clench
from clench.core.pose import Pose
from clench.solver.analysis.pareto import hand_front
from clench.solver.solution import FingerResult, FingerStatus, GraspSolution
from handmade import make_candidate, make_solution

CRITERIA = {
    "range_of_motion": {"weight": 1.0, "scale": 1.0, "better": "less"},
    "touching_links": {"weight": 0.5, "scale": 1.0, "better": "more"},
}


def solution(tables: dict[str, list[tuple[float, float]]]) -> GraspSolution:
    fingers, said = {}, {}
    for name, rows in tables.items():
        sets = [make_candidate(scores=dict(zip(CRITERIA, row, strict=True))) for row in rows]
        fingers[name] = FingerResult(name, FingerStatus.TOUCH, "", 0, tuple(sets))
        front = [i for i, a in enumerate(rows) if not any(beats(b, a) for b in rows)]
        said[name] = {"pareto": front}
    return make_solution(fingers=fingers, choice={"criteria": CRITERIA, "fingers": said})


def beats(a: Any, b: Any) -> bool:
    return a[0] <= b[0] and a[1] >= b[1] and (a[0] < b[0] or a[1] > b[1])


@pytest.mark.parametrize("seed", range(30))
def test_it_is_that_of_all_combinations(seed: int) -> None:
    random = np.random.default_rng(seed)
    counts = random.integers(1, 6, size=int(random.integers(1, 5)))
    tables = {
        f"finger{k}": [(float(a), float(b)) for a, b in random.integers(0, 6, size=(n, 2))]
        for k, n in enumerate(counts)
    }
    rows = {
        sets: np.sum([tables[name][i] for name, i in zip(tables, sets, strict=True)], axis=0)
        for sets in itertools.product(*(range(len(t)) for t in tables.values()))
    }
    expected = {sets for sets, row in rows.items() if not any(beats(other, row) for other in rows.values())}
    found = hand_front(solution(tables))
    assert {tuple(entry.candidates.values()) for entry in found} == expected
    totals = [entry.total for entry in found]
    assert totals == sorted(totals, reverse=True)
    best = max(-row[0] + 0.5 * row[1] for row in rows.values())
    assert totals[0] == pytest.approx(best)


def test_the_chosen_candidates_lead_the_front_of_a_solve() -> None:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    command = clench.GraspCommand(
        hand_pose=pose, planes=1, yaw_grid=(0.0, 0.1, -0.1), open_variants=(0.0, 0.2), preshape="open"
    )
    found = hand_front(clench.solve(hand, mug, command))
    assert found[0].chosen
    assert sum(entry.chosen for entry in found) == 1


def test_without_a_choice_there_is_no_front() -> None:
    assert hand_front(make_solution()) == []
