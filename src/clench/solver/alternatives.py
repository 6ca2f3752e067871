"""The sets of every finger, and the choice among them; made when they are read where they decide nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from clench.base.deferring import once
from clench.grasp.blocking import start_overlaps
from clench.grasp.calibration import Calibration
from clench.grasp.candidates import FingerCandidate, read_candidates
from clench.grasp.choice import HandChoice, choose
from clench.grasp.closing import ClosedHand, HandPlan, close_hand
from clench.grasp.criteria import Setting
from clench.grasp.criterion_registry import is_built_in, score_hand
from clench.grasp.depths import LinkDepth
from clench.grasp.explaining import explain_choice
from clench.grasp.feasibility import judge_sets

from .planning import planned

if TYPE_CHECKING:
    from .planning import Planned
    from .problem import Problem

Groups = list[list[FingerCandidate]]


class ClosedSets(NamedTuple):
    """The result of closing: the kernels' answer, overlaps at the start per entry, and sets per item."""

    closed: ClosedHand
    overlaps: list[LinkDepth | None]
    sets: list[FingerCandidate]


def finger_sets(problem: Problem) -> Groups:
    """Return the sets of every finger that the choice is made of."""
    made = planned(problem)
    return group_by_finger(made.plan, close_sets(problem, made, lambda stage: None).sets)


def close_sets(problem: Problem, made: Planned, lap: Callable[[str], None]) -> ClosedSets:
    """Close every alternative of every finger that is planned, and judge what it passes through.

    Args:
        problem: the three inputs. made: the plan. lap: is told the name of each stage that ends.
    """
    hand, packed, T, plan = problem.hand, problem.packed, problem.T_palm_object, made.plan
    closed = close_hand(plan, made.exact, packed, T, problem.rounds)
    lap("close")
    overlaps = start_overlaps(hand, plan, made.exact.link_pose, closed, packed, T, problem.source)
    sets = read_candidates(hand, plan, packed, closed.answer, T, overlaps)
    _judge(problem, sets)
    lap("sets")
    return ClosedSets(closed, overlaps, sets)


def _judge(problem: Problem, sets: Sequence[FingerCandidate]) -> None:
    p = problem
    judge_sets(p.hand, sets, p.packed, p.T_palm_object, p.source, p.command.check_sets, p.together)


def with_planes(
    problem: Problem, overlaps: Sequence[LinkDepth | None], full_width: Sequence[FingerCandidate]
) -> Groups:
    """Return the sets of every finger, the full widths as they were closed already, with what overlaps per entry."""
    made, T = planned(problem).planes, problem.T_palm_object
    closed = close_hand(made.plan, made.exact, problem.packed, T, problem.rounds)
    sets = read_candidates(problem.hand, made.plan, problem.packed, closed.answer, T, overlaps)
    _judge(problem, [*sets, *full_width])
    groups = group_by_finger(made.plan, sets)
    return [[*group, whole] for group, whole in zip(groups, full_width, strict=True)]


def group_by_finger(plan: HandPlan, candidates: list[FingerCandidate]) -> Groups:
    """Return the candidates of each finger that closes, in the command's order."""
    groups: dict[int, list[FingerCandidate]] = {finger: [] for finger in plan.finger}
    for entry, candidate in zip(plan.items.entry.tolist(), candidates, strict=True):
        groups[plan.finger[entry]].append(candidate)
    return list(groups.values())


def decided(problem: Problem, calibration: Calibration) -> Planned | None:
    """Return the plan of the sets that are chosen whatever the others are, or None where the choice is open.

    The full width goes before every plane: it alone passes through nothing, or a plane has its angles. So where each
    finger has one full width there is nothing to choose. Criteria that others wrote are asked about every set at once,
    so that what they raise is raised by the solve; so are sets that are all to be measured.
    """
    if problem.command.check_sets or not is_built_in(calibration.criteria):
        return None
    return planned(problem).full_width


@dataclass(eq=False)
class Alternatives:
    """The alternative sets of every finger, and the choice among them. Both are computed when first read.

    Args:
        problem, calibration, setting: what the sets are chosen by. close: returns the sets.
    """

    problem: Problem
    calibration: Calibration
    setting: Setting
    close: Callable[[], Groups]

    def __post_init__(self) -> None:
        # Threads that read at once get the same: the criteria keep what they found in the setting.
        self._scored = once(self._score)

    def _score(self) -> tuple[Groups, HandChoice]:
        groups = self.close()
        return groups, choose(groups, self.calibration, self.setting)

    @property
    def choice(self) -> HandChoice:
        """The choice among the sets."""
        return self._scored()[1]

    def of_finger(self, k: int) -> Sequence[FingerCandidate]:
        """Return the sets of a finger, as closed without the other fingers, with their scores."""
        return self._scored()[0][k]

    def explained(self, best: Sequence[FingerCandidate], changed: Sequence[int]) -> dict[str, Any]:
        """Return the choice as plain values; see `explain_choice`.

        Args:
            best: the chosen sets. changed: numbers of those fingers that the others made close again.
        """
        groups, choice = self._scored()
        explained = explain_choice(choice, groups)
        for k in changed:
            explained["fingers"][best[k].plan.finger.name]["closed_again"] = True
        if changed:
            explained["final_hand_scores"] = score_hand(best, choice.used, self.setting)
        return explained
