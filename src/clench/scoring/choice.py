"""Choose the best candidate of every finger, and of all of them together (docs/method.md section 6)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.core.pose import FloatArray

from .calibration import Calibration
from .combinations import Ceilings, Combination, best_combination
from .criterion_registry import (
    bound_hand,
    find_criterion,
    ideal_value,
    is_of_finger,
    is_of_hand,
    prepare_hand,
    score_candidates,
    score_hand,
)
from .criterion_types import ScoringContext

#: Tiers that rank one candidate before another regardless of the scores, strongest first; as `tier` lists them.
TIERS = (
    "may be taken",
    "passes through nothing on any plane",
    "touches the object",
    "is inside the limits of the calibration",
    "has a value for every criterion",
)

#: Candidates whose angles differ by less are the same for the choice [rad]; the same number applies to sums [-].
SAME_ANGLE = 1e-9
_SAME_DIGITS = 9


@dataclass(frozen=True, eq=False)
class FingerChoice:
    """The comparison of the candidates of one finger.

    Args:
        tiers: per candidate, its values of `TIERS`. totals: per candidate, the weighted sum of its scores [-].
        order: indices of the candidates, best first. equals: candidates with the best tier and different joint angles,
            best first: the scores decide among them. chosen: index.
    """

    tiers: tuple[tuple[bool, ...], ...]
    totals: tuple[float, ...]
    order: tuple[int, ...]
    equals: tuple[int, ...]
    chosen: int


@dataclass(frozen=True, eq=False)
class HandChoice:
    """The choice over all fingers.

    Args:
        fingers: one per finger. calibration: weights and limits. used, unused: names of its criteria with and without a
            value for some candidate. hand_scores: values of the hand's criteria for the chosen candidates.
        runner_up: the second best combination, as indices, with its total and hand scores; None when there is none.
        total: weighted sum over the chosen candidates [-]. proved: no other combination is better.
        tried: number of compared combinations; 0 if no criterion is about the whole hand, so that every finger has its
            own best.
    """

    fingers: tuple[FingerChoice, ...]
    calibration: Calibration
    used: tuple[str, ...]
    unused: tuple[str, ...]
    hand_scores: Mapping[str, float]
    runner_up: Combination | None
    total: float
    tried: int
    proved: bool

    @property
    def chosen(self) -> list[int]:
        """Index of the chosen candidate of every finger."""
        return [finger.chosen for finger in self.fingers]


def choose(
    groups: Sequence[Sequence[FingerCandidate]], calibration: Calibration, context: ScoringContext
) -> HandChoice:
    """Return the best candidate of every finger; the candidates' scores are filled on the way.

    `TIERS` decide first: a candidate that is known to be infeasible never goes before another one, and so on. The
    weighted scores decide among the rest; ties go to the full width, then to the first. Without a criterion of the
    whole hand, the best candidates of the fingers are the best of all; else see `best_combination`.

    Args:
        groups: candidates of every finger. calibration: weights and limits. context: context of the judgement.
    """
    criteria = {name: find_criterion(name, calibration.name) for name in calibration.criteria}
    of_finger = [name for name, c in criteria.items() if is_of_finger(c)]
    for group in groups:
        score_candidates(group, of_finger, context)
    fingers = [_compare(group, of_finger, calibration, context.tip_only) for group in groups]
    of_hand = [name for name, c in criteria.items() if is_of_hand(c)]
    judge = _HandJudge(groups, fingers, of_hand, calibration, context)
    known = {name for group in groups for c in group for name in c.scores}
    if of_hand:
        search = best_combination([finger.equals for finger in fingers], judge)
        best, second, tried, proved = search.best, search.second, search.tried, search.proved
        known |= set(best.scores)
        fingers = [replace(finger, chosen=i) for finger, i in zip(fingers, best.candidates, strict=True)]
    else:
        best, second = judge(tuple(finger.chosen for finger in fingers)), _next_best(fingers, judge)
        tried, proved = 0, True
    return HandChoice(
        tuple(fingers),
        calibration,
        tuple(name for name in criteria if name in known),
        tuple(name for name in criteria if name not in known),
        best.scores,
        second,
        best.total,
        tried,
        proved,
    )


def _compare(
    group: Sequence[FingerCandidate], names: Sequence[str], calibration: Calibration, tip_only: bool
) -> FingerChoice:
    """Rank the candidates of one finger by their tiers, then by their weighted scores."""
    said = [name for name in names if any(name in c.scores for c in group)]
    tiers = tuple(_tier(c, said, calibration, tip_only) for c in group)
    worth = {name: calibration.worth(name, 1.0) for name in said}
    totals = tuple(sum(w * c.scores[n] for n, w in worth.items() if n in c.scores) for c in group)
    same = _same_as_whole(group)
    # Rounded, so that candidates that are equal but for rounding come in the order of the alternatives.
    steps = [math.floor(total / SAME_ANGLE + 0.5) for total in totals]
    rank = [(tiers[same[i]], steps[same[i]], c.plane is None, -i) for i, c in enumerate(group)]
    order = sorted(range(len(group)), key=rank.__getitem__, reverse=True)
    best = [i for i in order if tiers[i] == tiers[order[0]]]
    different = {group[i].q.round(_SAME_DIGITS).tobytes(): i for i in reversed(best)}
    return FingerChoice(tiers, totals, tuple(order), tuple(i for i in best if i in different.values()), order[0])


def _same_as_whole(group: Sequence[FingerCandidate]) -> list[int]:
    """Return whose tier counts for each candidate: its own, or the full width's for a plane with the same angles.

    Otherwise, if corners touch on several planes simultaneously, a plane with a weaker guarantee could go first.
    """
    whole = {id(c.plan): i for i, c in enumerate(group) if c.plane is None}
    result = []
    for i, c in enumerate(group):
        full = whole.get(id(c.plan)) if c.clear and c.plane is not None else None
        same = full is not None and np.abs(c.q - group[full].q).max(initial=0.0) <= SAME_ANGLE
        result.append(full if full is not None and same else i)
    return result


def _tier(c: FingerCandidate, said: Sequence[str], calibration: Calibration, tip_only: bool) -> tuple[bool, ...]:
    """Return the tier of a candidate, see `TIERS`."""
    return (
        c.feasible is not False,
        c.clear,
        bool(c.holding) and not (tip_only and c.missed),
        all(calibration.allows(name, c.scores.get(name)) for name in said),
        all(name in c.scores for name in said),
    )


def _next_best(fingers: Sequence[FingerChoice], judge: _HandJudge) -> Combination | None:
    """Return the second best combination of sums: it differs in the finger whose best leads its second by least."""
    rivals = [(f.totals[f.equals[0]] - f.totals[f.equals[1]], k) for k, f in enumerate(fingers) if len(f.equals) > 1]
    if not rivals:
        return None
    _, k = min(rivals)
    return judge(tuple(f.equals[1] if n == k else f.chosen for n, f in enumerate(fingers)))


class _HandJudge:
    """Judge combinations of candidates: the sums of their fingers, and the criteria that are about the whole hand."""

    def __init__(
        self,
        groups: Sequence[Sequence[FingerCandidate]],
        fingers: Sequence[FingerChoice],
        criteria: Sequence[str],
        calibration: Calibration,
        context: ScoringContext,
    ) -> None:
        self._groups, self._fingers, self._criteria = groups, fingers, criteria
        self._calibration, self._context = calibration, context
        self._worth = {name: calibration.worth(name, 1.0) for name in criteria}
        self._options = [[group[i] for i in f.equals] for group, f in zip(groups, fingers, strict=True)]
        #: Values that no combination beats, by criterion; criteria that know none are missing.
        self._unbeaten: dict[str, FloatArray] = {
            name: np.array(ideal) for name in criteria if (ideal := ideal_value(name)) is not None
        }
        prepare_hand([c for options in self._options for c in options], criteria, context)

    @property
    def criteria(self) -> int:
        """Number of criteria of the whole hand that may have a value."""
        return len(self._criteria)

    def __call__(self, candidates: tuple[int, ...]) -> Combination:
        """Return a combination with its scores and total."""
        chosen = [group[i] for group, i in zip(self._groups, candidates, strict=True)]
        scores = score_hand(chosen, self._criteria, self._context)
        total = sum(f.totals[i] for f, i in zip(self._fingers, candidates, strict=True))
        total += sum(self._worth[name] * value for name, value in scores.items())
        allowed = all(self._calibration.allows(name, scores.get(name)) for name in self._criteria)
        return Combination(candidates, scores, allowed, total)

    def ceilings(self, places: tuple[int, ...]) -> Ceilings | None:
        """Return upper bounds of all combinations; None if a criterion of the whole hand gives no bound."""
        for name in self._criteria:
            found = bound_hand(name, self._options, places, self._context)
            if found is not None:
                closer = np.minimum if find_criterion(name, "choice").larger_is_better else np.maximum
                self._unbeaten[name] = closer(self._unbeaten.get(name, found), found)
        if len(self._unbeaten) < len(self._criteria):
            return None
        total: FloatArray = reduce(np.add.outer, [np.array([f.totals[i] for i in f.equals]) for f in self._fingers])
        allowed = np.ones(total.shape, dtype=np.bool_)
        for name, values in self._unbeaten.items():
            total = total + self._worth[name] * values
            allowed &= self._calibration.inside(name, values)
        return Ceilings(allowed, total)
