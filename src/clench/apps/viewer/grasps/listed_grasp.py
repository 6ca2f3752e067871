"""Grasps to look through: the facts of each, and filters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand

#: What stands for no filter.
ANY: Final = "any"
#: Words of the filter of hold tests.
HELD: Final = ("held", "dropped", "not tested")
#: Words of the filter of what came to something.
SHOWN: Final = ("grasps", "rejected", "all")


@dataclass(frozen=True, eq=False)
class ListedGrasp:
    """A grasp, or a proposal that came to nothing, of a file or of a search.

    Args:
        name: in its file. hand, object: on the shelf. T_object_palm: where the palm is.
        status: of its solution; empty where it is not known. kind: of the grasp; empty where it is not known.
        score: the larger the better; None where there is none. held: in a hold test; None: not tested.
        rejected: why it came to nothing; empty for a grasp.
        command: makes what solves to it. posture: makes the angles of all joints [rad], shape (J,); None: by solving.
    """

    name: str
    hand: str
    object: str
    T_object_palm: Pose
    command: Callable[[], GraspCommand]
    status: str = ""
    kind: str = ""
    score: float | None = None
    held: bool | None = None
    rejected: str = ""
    posture: Callable[[], FloatArray] | None = None

    @property
    def tested(self) -> str:
        """What came of the hold test, as the filter says it."""
        return HELD[2] if self.held is None else HELD[0] if self.held else HELD[1]

    @property
    def text(self) -> str:
        """Return the facts of the grasp, on one line."""
        known = [self.status.replace("_", " "), self.kind, "" if self.held is None else self.tested]
        known.append("" if self.score is None else f"score {self.score:z.3f}")
        known.append(f"rejected: {self.rejected}" if self.rejected else "")
        return " · ".join([self.name, *(word for word in known if word)])


@dataclass(frozen=True)
class GraspFilter:
    """The filters that a shown grasp passes.

    Args:
        status, kind, held: a word, or `ANY`. shown: one of `SHOWN`. reason: why it was rejected, or `ANY`.
        score: least and largest; a grasp without a score passes when nothing is asked of it.
    """

    status: str = ANY
    kind: str = ANY
    held: str = ANY
    shown: str = SHOWN[0]
    reason: str = ANY
    score: tuple[float, float] | None = None

    def passes(self, grasp: ListedGrasp) -> bool:
        """Say whether a grasp is shown."""
        pairs = ((self.status, grasp.status), (self.kind, grasp.kind), (self.held, grasp.tested))
        if any(wanted not in (ANY, given) for wanted, given in pairs):
            return False
        if self.reason != ANY and grasp.rejected and grasp.rejected != self.reason:
            return False
        if self.shown != SHOWN[2] and bool(grasp.rejected) is not (self.shown == SHOWN[1]):
            return False
        if self.score is None or grasp.score is None:
            return True
        return self.score[0] <= grasp.score <= self.score[1]

    def chosen(self, grasps: Sequence[ListedGrasp]) -> list[int]:
        """Return the numbers of the grasps that are shown, the best score first; those without one come last."""
        numbers = [k for k, grasp in enumerate(grasps) if self.passes(grasp)]
        return sorted(numbers, key=lambda k: (grasps[k].score is None, -(grasps[k].score or 0.0), k))


def words_of(values: Iterable[str]) -> tuple[str, ...]:
    """Return the words that a filter offers: `ANY`, and every word that some grasp has."""
    return (ANY, *sorted({value for value in values if value}))
