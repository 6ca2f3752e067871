"""Keep what the kernels found at the poses of a batch, so that whole solutions are read without another solve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.closing.kernel_run import Answers
from clench.core.pose import FloatArray
from clench.solver.solution import GraspSolution

#: Memory that one batch keeps for this, at most [bytes]: that of some two thousand poses.
MOST_KEPT: Final = 32_000_000

#: Reads the solution of one pose: from answers for it alone, the pose of the palm, (7,), and of the object, (7,).
Reader = Callable[[Answers, FloatArray, FloatArray], GraspSolution]


class KeptPart(NamedTuple):
    """Answers for poses of one solver: `palms` and `objects` are poses, (N, 7)."""

    read: Reader
    answers: Answers
    palms: FloatArray
    objects: FloatArray

    @property
    def size(self) -> int:
        """Memory of the answers [bytes]."""
        return _size(self.answers)

    def rows(self, which: NDArray[np.integer[Any]]) -> KeptPart:
        """Return some poses, as copies, so that nothing of the others is kept."""
        return KeptPart(self.read, _taken(self.answers, which), self.palms[which], self.objects[which])


class KeptAnswers:
    """The kept answers for N poses of a batch, which may lack some.

    Args:
        parts: the answers. part: which of them holds each pose, -1 for none, (N,). row: of the pose in its part, (N,).
    """

    def __init__(self, parts: Sequence[KeptPart], part: NDArray[np.int64], row: NDArray[np.int64]) -> None:
        self._parts: tuple[KeptPart, ...] = tuple(parts)
        self._part, self._row = part, row

    @property
    def size(self) -> int:
        """Memory of the answers [bytes]."""
        return sum(part.size for part in self._parts)

    @classmethod
    def of(cls, part: KeptPart) -> KeptAnswers:
        """Return the answers of one part, or of none of its poses if they are too large."""
        return cls.joined([cls([part], np.zeros(len(part.palms), dtype=np.int64), np.arange(len(part.palms)))])

    @classmethod
    def none(cls, count: int) -> KeptAnswers:
        """Return no answers for so many poses."""
        return cls([], np.full(count, -1), np.zeros(count, dtype=np.int64))

    @classmethod
    def joined(cls, many: Sequence[KeptAnswers]) -> KeptAnswers:
        """Return the answers of several batches as those of one, from the first on as far as the memory suffices."""
        parts, numbers, left = list[KeptPart](), list[NDArray[np.int64]](), MOST_KEPT
        for each in many:
            place = np.full(len(each._parts) + 1, -1)  # the last one stands for number -1
            for k, part in enumerate(each._parts):
                left -= part.size
                if left >= 0:
                    place[k] = len(parts)
                    parts.append(part)
            numbers.append(place[each._part])
        return cls(parts, np.concatenate(numbers), np.concatenate([each._row for each in many]))

    def taken(self, order: NDArray[np.integer[Any]]) -> KeptAnswers:
        """Return the answers for some poses, in their order."""
        part, row, parts = self._part[order], self._row[order], list[KeptPart]()
        kept = self.none(len(order))
        for k, each in enumerate(self._parts):
            mine = np.flatnonzero(part == k)
            if len(mine):
                kept._part[mine], kept._row[mine] = len(parts), np.arange(len(mine))
                parts.append(each.rows(row[mine]))
        return KeptAnswers(parts, kept._part, kept._row)

    def solution(self, i: int) -> GraspSolution | None:
        """Return the solution of a pose, or None where its answers are not kept."""
        if self._part[i] < 0:
            return None
        one = self._parts[int(self._part[i])].rows(self._row[[i]])
        found: GraspSolution = one.read(one.answers, one.palms[0], one.objects[0])
        return found


def _taken(arrays: Any, which: NDArray[np.integer[Any]]) -> Any:
    """Return rows of nested arrays, as copies."""
    return type(arrays)(*(_taken(a, which) if isinstance(a, tuple) else a[which] for a in arrays))


def _size(arrays: Any) -> int:
    return sum(_size(a) if isinstance(a, tuple) else a.nbytes for a in arrays)
