"""Say why the chosen candidates won: which criterion decided, against which runner-up, by how much."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.core.pose import FloatArray

from .calibration import Calibration
from .choice import SAME_ANGLE, TIERS, FingerChoice, HandChoice
from .criterion_registry import find_criterion

Groups = Sequence[Sequence[FingerCandidate]]


def explain_choice(choice: HandChoice, groups: Groups) -> dict[str, Any]:
    """Return the choice as plain values: criteria, totals, runners-up, Pareto fronts, and sentences.

    Args:
        choice: result of `choose`. groups: the candidates of every finger, as given to `choose`.
    """
    calibration = choice.calibration
    names = [group[0].plan.finger.name for group in groups]
    second = choice.runner_up
    return {
        "calibration": calibration.name,
        "criteria": {name: _described(name, calibration) for name in choice.used},
        "unused": list(choice.unused),
        "text": f"{_hand_text(choice, groups, names)}{_doubt(choice)}",
        "total": choice.total,
        "hand_scores": dict(choice.hand_scores),
        "final_hand_scores": dict(choice.hand_scores),
        "combinations": math.prod(len(finger.equals) for finger in choice.fingers),
        "combinations_tried": choice.tried,
        "proved": choice.proved,
        "runner_up": None
        if second is None
        else {
            "candidates": dict(zip(names, second.candidates, strict=True)),
            "total": second.total,
            "hand_scores": dict(second.scores),
        },
        "fingers": {
            name: _finger(finger, group, choice)
            for name, finger, group in zip(names, choice.fingers, groups, strict=True)
        },
    }


def pareto_front(values: FloatArray) -> list[int]:
    """Return the rows that no other row equals or beats in every column, and beats in one; more is better.

    Args:
        values: one row per candidate, shape (N, M).
    """
    rows = np.asarray(values, dtype=np.float64)
    as_good = (rows[:, None] >= rows[None]).all(axis=2)
    better = as_good & (rows[:, None] > rows[None]).any(axis=2)
    return np.flatnonzero(~better.any(axis=0)).tolist()


def candidate_name(c: FingerCandidate, group: Sequence[FingerCandidate]) -> str:
    """Return the display name of a candidate among the candidates of its finger."""
    name = "the full width" if c.plane is None else f"plane {c.plane}"
    return f"{name} of posture {c.posture}" if any(other.posture for other in group) else name


def _described(name: str, calibration: Calibration) -> dict[str, Any]:
    criterion = find_criterion(name, calibration.name)
    return {
        "weight": calibration.weights.get(name, 0.0),
        "scale": calibration.scale(name),
        "limit": calibration.limits.get(name),
        "unit": criterion.unit,
        "better": "more" if criterion.larger_is_better else "less",
        "source": criterion.source,
    }


def _finger(finger: FingerChoice, group: Sequence[FingerCandidate], choice: HandChoice) -> dict[str, Any]:
    second = _runner_up(finger, group)
    return {
        "text": _finger_text(finger, group, choice, second),
        "runner_up": second,
        "lead": None if second is None else finger.totals[finger.chosen] - finger.totals[second],
        "totals": list(finger.totals),
        "pareto": _finger_front(finger, group, choice),
        "closed_again": False,
    }


def _runner_up(finger: FingerChoice, group: Sequence[FingerCandidate]) -> int | None:
    """Return the best candidate besides the chosen one: of the same tier, else with different angles."""
    q = group[finger.chosen].q
    for i in (*finger.equals, *finger.order):
        if i != finger.chosen and np.abs(group[i].q - q).max(initial=0.0) > SAME_ANGLE:
            return i
    return None


def _finger_front(finger: FingerChoice, group: Sequence[FingerCandidate], choice: HandChoice) -> list[int]:
    """Return the Pareto-optimal candidates among those that the scores decide between."""
    equals = sorted(finger.equals)
    names = [name for name in choice.used if name in group[equals[0]].scores]
    if not names:
        return equals
    if len(equals) == 1:
        return equals
    rows = np.array([[group[i].scores[name] for name in names] for i in equals])
    signs = [1.0 if find_criterion(name, "choice").larger_is_better else -1.0 for name in names]
    return [equals[k] for k in pareto_front(rows * signs)]


def _finger_text(finger: FingerChoice, group: Sequence[FingerCandidate], choice: HandChoice, second: int | None) -> str:
    best = group[finger.chosen]
    name = candidate_name(best, group)
    if second is None:
        return f"{name} is the only candidate{', all others have its angles' if len(group) > 1 else ''}."
    other = candidate_name(group[second], group)
    for what, has, lacks in zip(TIERS, finger.tiers[finger.chosen], finger.tiers[second], strict=True):
        if has and not lacks:
            return f"{name} comes before {other} because it alone {what}."
    gains = _gains([(best.scores, group[second].scores)], choice)
    lead = finger.totals[finger.chosen] - finger.totals[second]
    if lead < 0.0:
        return (
            f"{name} is {-lead:.3g} behind {other} by itself; with the candidates of the other fingers it is the best."
        )
    if lead == 0.0:
        return f"{name} and {other} score the same; the full width goes first, then the first candidate."
    return f"{name} leads {other} by {lead:.3g}; {say_what_decided(gains, best.scores, group[second].scores)}"


def _hand_text(choice: HandChoice, groups: Groups, names: Sequence[str]) -> str:
    second = choice.runner_up
    if second is None:
        return "No finger has two candidates that the scores could decide between."
    changed = [k for k, (i, j) in enumerate(zip(choice.chosen, second.candidates, strict=True)) if i != j]
    both = [(groups[k][choice.chosen[k]], groups[k][second.candidates[k]]) for k in changed]
    swapped = ", ".join(
        f"{candidate_name(b, groups[k])} for {names[k]}" for k, (_, b) in zip(changed, both, strict=True)
    )
    lead = choice.total - second.total
    unknown = [name for name in choice.hand_scores if name not in second.scores]
    if unknown:
        return f"The next best ({swapped}) has no {', '.join(unknown)}."
    if not second.allowed and lead <= 0.0:
        return f"The next best ({swapped}) is outside a limit of the calibration."
    if lead <= 0.0:
        return f"The next best ({swapped}) scores the same; the first goes before it."
    pairs = [(a.scores, b.scores) for a, b in both] + [(choice.hand_scores, second.scores)]
    gains = _gains(pairs, choice)
    ours = {n: sum(a.get(n, 0.0) for a, _ in pairs) for n in gains}
    theirs = {n: sum(b.get(n, 0.0) for _, b in pairs) for n in gains}
    return (
        f"The chosen candidates lead the next best ({swapped}) by {lead:.3g}; {say_what_decided(gains, ours, theirs)}"
    )


def _doubt(choice: HandChoice) -> str:
    """Return a sentence for a choice that may miss a better combination."""
    if choice.proved:
        return ""
    every = math.prod(len(finger.equals) for finger in choice.fingers)
    return f" The search tried {choice.tried} of {every} combinations: one that is better may exist."


def _gains(pairs: Sequence[tuple[Mapping[str, float], Mapping[str, float]]], choice: HandChoice) -> dict[str, float]:
    """Return how much each criterion adds to the lead [-]."""
    worth = choice.calibration.worth
    gains = dict.fromkeys(choice.used, 0.0)
    for ours, theirs in pairs:
        for name in gains:
            if name in ours and name in theirs:
                gains[name] += worth(name, ours[name]) - worth(name, theirs[name])
    return gains


def say_what_decided(gains: Mapping[str, float], ours: Mapping[str, float], theirs: Mapping[str, float]) -> str:
    """Return the sentence about the criterion that adds most to the lead."""
    name = max(gains, key=lambda n: gains[n])
    unit = find_criterion(name, "choice").unit
    return f"{name} decided it: {ours[name]:.4g} against {theirs[name]:.4g} {unit}, worth {gains[name]:.3g}."
