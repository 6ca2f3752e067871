"""Search the combinations of one set per finger for the best (METHOD.md section 6).

Criteria of the whole hand do not add up over the fingers, so the best of every finger need not be the best of all.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

#: Up to this many combinations are all tried.
EXHAUSTIVE: Final = 128
#: Starts of the ascent besides the best of every finger; they are drawn from a fixed seed.
RESTARTS: Final = 12
#: No other start is taken once so many combinations were tried.
MOST_TRIED: Final = 200
_SEED: Final = 0


@dataclass(frozen=True)
class Combination:
    """Hold one set per finger and how it was judged.

    Args:
        sets: index of the set of every finger. scores: values of those criteria of the whole hand that have one.
        allowed: these are inside the limits. total: weighted sum over fingers and hand [-].
    """

    sets: tuple[int, ...]
    scores: Mapping[str, float]
    allowed: bool
    total: float

    @property
    def rank(self) -> tuple[bool, int, float]:
        """What is larger for the better combination: limits first, then that every criterion has a value."""
        return self.allowed, len(self.scores), self.total


def best_combination(
    options: Sequence[Sequence[int]], judge: Callable[[tuple[int, ...]], Combination]
) -> tuple[Combination, Combination | None, int]:
    """Return the best combination, the best of the others that were tried, and how many were.

    All are tried when there are few. Otherwise one finger after another takes the set that is best with those of the
    others, until none changes; from the best of every finger, and from others that are drawn the same every time.
    Of equal ones the first wins, in the order of the options.

    Args:
        options: sets of every finger, best first. judge: gives the value of a combination.
    """
    tried: dict[tuple[int, ...], Combination] = {}

    def value(places: tuple[int, ...]) -> Combination:
        if places not in tried:
            tried[places] = judge(tuple(o[p] for o, p in zip(options, places, strict=True)))
        return tried[places]

    counts = [len(o) for o in options]
    if math.prod(counts) <= EXHAUSTIVE:
        for places in itertools.product(*map(range, counts)):
            value(places)
    else:
        random = np.random.default_rng(_SEED)
        _ascend((0,) * len(counts), counts, value)
        for _ in range(RESTARTS):
            if len(tried) > MOST_TRIED:
                break
            _ascend(tuple(int(random.integers(n)) for n in counts), counts, value)
    ranked = sorted(tried, key=lambda places: (*(-float(r) for r in tried[places].rank), places))
    second = tried[ranked[1]] if len(ranked) > 1 else None
    return tried[ranked[0]], second, len(tried)


def _ascend(places: tuple[int, ...], counts: Sequence[int], value: Callable[[tuple[int, ...]], Combination]) -> None:
    """Improve a combination one finger at a time until no finger has a better set."""
    best, unchanged, k = value(places), 0, 0
    while unchanged < len(counts):
        unchanged += 1
        for p in range(counts[k]):
            other = (*places[:k], p, *places[k + 1 :])
            found = value(other)
            if found.rank > best.rank:
                best, places, unchanged = found, other, 0
        k = (k + 1) % len(counts)
