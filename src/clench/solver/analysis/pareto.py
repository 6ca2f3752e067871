"""Combinations over all fingers that no other beats in every criterion (docs/method.md section 6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from clench.scoring.explaining import pareto_front
from clench.solver.solution import GraspSolution

#: More combinations than this are not carried from one finger to the next; the best weighted sums are.
MOST: Final = 400


@dataclass(frozen=True)
class HandSets:
    """One candidate per finger, with the scores of this combination.

    Args:
        candidates: index of the candidate by finger. scores: sums over the fingers by criterion.
        total: weighted sum [-]. chosen: whether these are the chosen candidates.
    """

    candidates: Mapping[str, int]
    scores: Mapping[str, float]
    total: float
    chosen: bool

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form."""
        candidates, scores = dict(self.candidates), dict(self.scores)
        return {"candidates": candidates, "scores": scores, "total": self.total, "chosen": self.chosen}


def hand_front(solution: GraspSolution) -> list[HandSets]:
    """Return the Pareto front over all fingers, best weighted sum first; empty where the solution says no choice.

    The criteria are those that add up over the fingers and for which every candidate in question has a score. If
    another candidate of the same finger dominates a candidate, the latter cannot be in the best sum. So the fronts of
    the fingers are enough.
    """
    choice = solution.choice
    if choice is None or not choice["fingers"]:
        return []
    options = {name: list(said["pareto"]) for name, said in choice["fingers"].items()}
    scores = {n: [c.scores for c in solution.fingers[n].candidates] for n in options}
    names = [n for n in choice["criteria"] if all(n in scores[f][i] for f, own in options.items() for i in own)]
    if not names:
        return []
    signs = np.array([1.0 if choice["criteria"][n]["better"] == "more" else -1.0 for n in names])
    worth = signs * [choice["criteria"][n]["weight"] / choice["criteria"][n]["scale"] for n in names]
    candidates: list[tuple[int, ...]] = [()]
    sums = np.zeros((1, len(names)))
    for finger, own in options.items():
        rows = np.array([[scores[finger][i][n] for n in names] for i in own])
        sums = (sums[:, None] + rows[None]).reshape(-1, len(names))
        candidates = [(*before, i) for before in candidates for i in own]
        kept = pareto_front(sums * signs)
        kept.sort(key=lambda k: -float(sums[k] @ worth))
        sums, candidates = sums[kept[:MOST]], [candidates[k] for k in kept[:MOST]]
    chosen = tuple(solution.fingers[name].chosen for name in options)
    return [
        HandSets(
            dict(zip(options, found, strict=True)),
            dict(zip(names, row.tolist(), strict=True)),
            float(row @ worth),
            found == chosen,
        )
        for found, row in zip(candidates, sums, strict=True)
    ]
