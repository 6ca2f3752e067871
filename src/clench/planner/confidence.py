"""The confidence of a grasp: the measured share of grasps with such a score that held (docs/planning.md).

The numbers come from hold tests over many hands and objects. `clench bench confidence` makes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.exceptions import FileError
from clench.core.files.json_files import read_json
from clench.core.pose import FloatArray

SCHEMA: Final = "clench.confidence/1"
#: Approximate number of grasps per level of the score; a level is as wide as this number needs.
LEVEL: Final = 40
_SHIPPED: Final = Path(__file__).with_name("confidence.json")


@dataclass(frozen=True, eq=False)
class ConfidenceTable:
    """The number of tried and held grasps by levels of the score, which do not overlap; low levels first.

    Args:
        score: mean score of every level, ascending, shape (L,). tried, held: numbers of grasps, shape (L,).
    """

    score: FloatArray
    tried: FloatArray
    held: FloatArray

    @classmethod
    def of(cls, scores: Sequence[float], held: Sequence[bool]) -> ConfidenceTable:
        """Return the table of grasps with their scores and outcomes; a higher score never gets a lower share.

        Levels between which the share falls are joined: this is isotonic regression (pool adjacent violators).
        """
        order = np.argsort(np.asarray(scores), kind="stable")
        values, outcomes = np.asarray(scores, dtype=np.float64)[order], np.asarray(held, dtype=np.float64)[order]
        levels = np.array_split(np.arange(len(values)), max(len(values) // LEVEL, 1))
        pooled: list[list[float]] = []
        for rows in levels:
            pooled.append([float(values[rows].sum()), float(len(rows)), float(outcomes[rows].sum())])
            while len(pooled) > 1 and pooled[-2][2] * pooled[-1][1] > pooled[-1][2] * pooled[-2][1]:
                last = pooled.pop()
                pooled[-1] = [a + b for a, b in zip(pooled[-1], last, strict=True)]
        sums = np.array(pooled).reshape(-1, 3)
        return cls(sums[:, 0] / np.maximum(sums[:, 1], 1.0), sums[:, 1], sums[:, 2])

    def confidence(self, score: float) -> float:
        """Return the share of grasps with such a score that held, between levels by interpolation, never 0 or 1.

        Half a grasp that held and half a grasp that did not are added to every level.
        """
        shares = (self.held + 0.5) / (self.tried + 1.0)
        return float(np.interp(score, self.score, shares))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, the levels of schema `clench.confidence/1`."""
        columns = zip(self.score.tolist(), self.tried.tolist(), self.held.tolist(), strict=True)
        return {"levels": [{"score": s, "tried": round(t), "held": round(h)} for s, t, h in columns]}

    @classmethod
    def load(cls, path: str | Path) -> ConfidenceTable:
        """Read a table that `clench bench confidence --out` wrote.

        Raises:
            FileError: missing, unreadable, or no such table.
        """
        document = read_json(path)
        levels = document.get("levels") if isinstance(document, dict) else None
        if not levels or document.get("schema") != SCHEMA:
            raise FileError(path, f"expected a document of schema {SCHEMA} with levels.")
        try:
            rows = np.array([[level["score"], level["tried"], level["held"]] for level in levels], dtype=np.float64)
        except (TypeError, KeyError, ValueError):
            raise FileError(path, "levels: expected numbers score, tried and held for every level.") from None
        counts_fit = (rows[:, 1] >= 1).all() and (rows[:, 2] >= 0).all() and (rows[:, 2] <= rows[:, 1]).all()
        if not (np.isfinite(rows).all() and counts_fit and (np.diff(rows[:, 0]) > 0.0).all()):
            raise FileError(path, "levels: expected ascending scores, and no more grasps held than tried.")
        return cls(*rows.T)


@cache
def shipped_table() -> ConfidenceTable:
    """Return the table that comes with clench."""
    return ConfidenceTable.load(_SHIPPED)
