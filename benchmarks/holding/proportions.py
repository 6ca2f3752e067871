"""Statistics of yes and no: intervals of a proportion, and how well a score tells the two apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clench.core.pose import FloatArray


def wilson(yes: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a proportion (E. B. Wilson, 1927); 0 to 1 when nothing was counted.

    Args:
        yes: how many were. count: of how many.
    """
    from scipy.stats import binomtest

    if count == 0:
        return 0.0, 1.0
    interval = binomtest(yes, count).proportion_ci(confidence_level=0.95, method="wilson")
    return float(interval.low), float(interval.high)


def roc_auc(scores: Sequence[float] | FloatArray, yes: Sequence[bool]) -> float | None:
    """Return the probability that a yes has a higher score than a no, ties counted half; None without one of each.

    Args:
        scores: of every case. yes: the outcomes to predict.
    """
    values, is_yes = np.asarray(scores, dtype=np.float64), np.asarray(yes, dtype=bool)
    high, low = values[is_yes], values[~is_yes]
    if not len(high) or not len(low):
        return None
    above = (high[:, None] > low[None]).mean()
    return float(above + 0.5 * (high[:, None] == low[None]).mean())
