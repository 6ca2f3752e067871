"""Choose the best set of each finger (METHOD.md section 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .candidates import FingerCandidate
from .criteria import weigh


def choose(candidates: Sequence[FingerCandidate], weights: Mapping[str, float]) -> int:
    """Return the index of the best candidate.

    A set that is known to be infeasible is never chosen before one that is not; one that passes through nothing on
    any plane goes before one that does; one that touches goes before one that does not. The weighted scores decide
    among the rest; ties go to the full width, then to the first.
    """

    def rank(i: int) -> tuple[bool, bool, bool, float, bool, int]:
        c = candidates[i]
        return c.feasible is not False, c.clear, bool(c.holding), weigh(c.scores, weights), c.plane is None, -i

    return max(range(len(candidates)), key=rank)
