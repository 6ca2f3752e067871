"""Search the combinations of one candidate per finger for the best (docs/method.md section 6).

Criteria of the whole hand do not add up over the fingers, so the best of every finger need not be the best of all. The
search goes best first. Every combination has a ceiling that its sum does not exceed. The search judges the combination
with the highest ceiling. It ends with a proof when no ceiling is above the best judged sum. Criteria may lower the
ceilings on the way (`HandCriterion`). If there are too many combinations, or a proof would take too long, each finger
in turn takes its best candidate given the candidates of the others. Then nothing is proved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray

#: More combinations than this get no ceilings: they would take more memory and time than they save.
MOST_CEILINGS: Final = 2**20
#: Numbers of combinations that are judged at most: on the way to a proof, and in all if the proof is given up.
MOST_JUDGED: Final = 256
MOST_TRIED: Final = 384
#: Starts of the ascent besides the best that is known; they are drawn from a fixed seed.
RESTARTS: Final = 12
#: Ceilings that are higher by less than this are no higher [-].
ROUNDING: Final = 1e-9
_SEED: Final = 0

Places = tuple[int, ...]


@dataclass(frozen=True)
class Combination:
    """One candidate per finger and its judgement.

    Args:
        candidates: index of the candidate of every finger. total: weighted sum over fingers and hand [-].
        scores: values of the criteria of the whole hand that have a value. allowed: these values are inside the limits.
    """

    candidates: tuple[int, ...]
    scores: Mapping[str, float]
    allowed: bool
    total: float

    @property
    def rank(self) -> tuple[bool, int, float]:
        """Sort key, larger for the better combination: limits first, then whether every criterion has a value."""
        return self.allowed, len(self.scores), self.total


class Ceilings(NamedTuple):
    """Upper bounds for all combinations, one axis per finger.

    Args:
        allowed: it may be inside the limits. total: its weighted sum is at most this [-].
    """

    allowed: NDArray[np.bool_]
    total: FloatArray


class Judge(Protocol):
    """Judge combinations."""

    @property
    def criteria(self) -> int:
        """Number of criteria of the whole hand that may have a value."""
        ...

    def __call__(self, candidates: tuple[int, ...]) -> Combination:
        """Return how a combination is judged."""
        ...

    def ceilings(self, places: Places) -> Ceilings | None:
        """Return the ceilings of all combinations, made low at some places among the options; None without any."""
        ...


@dataclass(frozen=True)
class SearchResult:
    """The result of a search.

    Args:
        best: the best combination. second: the best of the others that were judged, None when there is no other.
        tried: how many were judged. proved: no other combination is better by more than rounding.
    """

    best: Combination
    second: Combination | None
    tried: int
    proved: bool


def best_combination(options: Sequence[Sequence[int]], judge: Judge) -> SearchResult:
    """Return the best combination, and whether it is known to be the best of all.

    Among equal combinations, the first in the order of the options wins.

    Args:
        options: candidates of every finger, best first. judge: gives the value of a combination, and ceilings.
    """
    counts = tuple(len(o) for o in options)
    tried: dict[Places, Combination] = {}

    def value(places: Places) -> Combination:
        if places not in tried:
            tried[places] = judge(tuple(o[p] for o, p in zip(options, places, strict=True)))
        return tried[places]

    proved = math.prod(counts) <= MOST_CEILINGS and _best_first(counts, judge, value, tried)
    if not proved:
        random = np.random.default_rng(_SEED)
        _ascend(_first(tried)[0] if tried else (0,) * len(counts), counts, value)
        for _ in range(RESTARTS):
            if len(tried) > MOST_TRIED:
                break
            _ascend(tuple(int(random.integers(n)) for n in counts), counts, value)
    ranked = _first(tried)
    second = tried[ranked[1]] if len(ranked) > 1 else None
    return SearchResult(tried[ranked[0]], second, len(tried), proved or len(tried) == math.prod(counts))


def _first(tried: Mapping[Places, Combination]) -> list[Places]:
    """Return the judged combinations, best first."""
    return sorted(tried, key=lambda places: (*(-float(r) for r in tried[places].rank), places))


def _best_first(
    counts: Places, judge: Judge, value: Callable[[Places], Combination], tried: dict[Places, Combination]
) -> bool:
    """Judge combinations from the highest ceiling down; say whether the best is proved to be.

    At least two are judged, the second as the most promising of the others.
    """
    lowered: set[Places] = {(0,) * len(counts)}
    ceilings = judge.ceilings((0,) * len(counts))
    if ceilings is None and math.prod(counts) > MOST_JUDGED:
        return False
    ceilings = ceilings or Ceilings(np.ones(counts, dtype=np.bool_), np.full(counts, np.inf))
    waiting = np.ones(counts, dtype=np.bool_)
    best: Combination | None = None
    while len(tried) < MOST_JUDGED:
        places, rank = _highest(ceilings, waiting, judge.criteria)
        if places is None or (best is not None and best.rank >= rank and len(tried) > 1):
            return True
        if places not in lowered:
            lowered.add(places)
            ceilings = judge.ceilings(places) or ceilings
            continue
        waiting[places] = False
        found = value(places)
        best = found if best is None or found.rank > best.rank else best
    return bool(not waiting.any())


def _highest(
    ceilings: Ceilings, waiting: NDArray[np.bool_], criteria: int
) -> tuple[Places | None, tuple[bool, int, float]]:
    """Return the places of the combination with the highest ceiling that waits, and the rank that it may have."""
    for allowed in (True, False):
        open_ = waiting & (ceilings.allowed == allowed)
        flat = int(np.where(open_, ceilings.total, -np.inf).argmax())
        if open_.reshape(-1)[flat]:
            places = tuple(int(p) for p in np.unravel_index(flat, waiting.shape))
            return places, (allowed, criteria, float(ceilings.total[places]) - ROUNDING)
    return None, (False, 0, -np.inf)


def _ascend(places: Places, counts: Sequence[int], value: Callable[[Places], Combination]) -> None:
    """Improve a combination one finger at a time until no finger has a better candidate."""
    best, unchanged, k = value(places), 0, 0
    while unchanged < len(counts):
        unchanged += 1
        for p in range(counts[k]):
            other = (*places[:k], p, *places[k + 1 :])
            found = value(other)
            if found.rank > best.rank:
                best, places, unchanged = found, other, 0
        k = (k + 1) % len(counts)
