"""Find the wrenches that combinations of alternatives resist: the best epsilon among thousands, after judging only a
few.

A combination takes one set of wrenches per finger; its epsilon is the least, over directions, of the farthest that any
of them reaches. Along every direction, the reach of all wrenches is a maximum over fingers. It bounds epsilon from
above.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from clench.core.pose import FloatArray

from .wrench_space import weak_directions

#: Searches for the direction in which a combination is weakest; another starts at that of the combination before.
_STARTS = 3


class AlternativeWrenches:
    """The wrenches of every set of every finger, and directions in which some combination was weakest.

    Args:
        wrenches: by finger and set, shape (N, 6) each; sets without contact have none.
    """

    def __init__(self, wrenches: Sequence[Sequence[FloatArray]]) -> None:
        self._wrenches = [[*sets] for sets in wrenches]
        # A finger need not push: 0 is among the wrenches of every set.
        every = [np.vstack([w, np.zeros((1, 6))]) for sets in wrenches for w in sets]
        self._rows = np.vstack(every)
        self._first = np.concatenate([[0], np.cumsum([len(w) for w in every])[:-1]])
        self._last = np.cumsum([len(sets) for sets in wrenches])[:-1]
        self._weakest: FloatArray | None = None

    def reach(self, direction: FloatArray) -> FloatArray:
        """Return how far combinations reach along a direction, at least 0, one axis per finger."""
        each = np.maximum.reduceat(self._rows @ direction, self._first)
        grid: FloatArray = reduce(np.maximum.outer, np.split(each, self._last))
        return grid

    def bound(self, places: tuple[int, ...], weakest: Sequence[FloatArray] = ()) -> FloatArray:
        """Return values that no combination's epsilon exceeds, near that of one of them.

        Args:
            places: of its sets. weakest: directions in which others are known to be weakest, shape (6,) each.
        """
        known = [self.reach(direction) for direction in weakest]
        wrenches = np.vstack([sets[p] for sets, p in zip(self._wrenches, places, strict=True)])
        if not len(wrenches):
            return reduce(np.minimum, known, self.reach(np.eye(6)[0]))
        directions, reach = weak_directions(wrenches, _STARTS, self._weakest)
        least = int(reach.argmin())
        if reach[least] > 0.0:
            self._weakest = directions[least]
        return reduce(np.minimum, known, self.reach(directions[least]))
