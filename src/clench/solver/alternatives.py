"""The candidates of every finger: which ones are closed, who chooses among them, and the choice itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from clench.closing.candidates import FingerCandidate, read_candidates
from clench.closing.collision.containment import link_within_link
from clench.closing.feasibility import judge_candidates
from clench.closing.hand_plan import HandPlan
from clench.closing.kernel_run import close_candidates, row_of
from clench.closing.packed_problem import PackedProblem, Terms, pack_problem
from clench.closing.start_blocking import start_overlaps
from clench.core.caching.deferring import once
from clench.scoring.calibration import Calibration
from clench.scoring.choice import HandChoice, choose
from clench.scoring.criterion_registry import ALWAYS, is_built_in, score_hand
from clench.scoring.criterion_types import ScoringContext
from clench.scoring.explaining import explain_choice

from .planning import plan_hand

if TYPE_CHECKING:
    from clench.closing.collision.depths import LinkDepth
    from clench.kernels.closing.solve_layout import Closed

    from .problem import Problem

Groups = list[list[FingerCandidate]]
#: NumPy adds up more numbers in another order than the kernels do.
_MOST_JOINTS: Final = 7


@dataclass(frozen=True, eq=False)
class Candidates:
    """Say which candidates are closed, and who chooses among them.

    Args:
        problem: packed for the kernels. by_kernel: the kernels choose; else `Alternatives` choose from the
            candidates that are read.
    """

    problem: PackedProblem
    by_kernel: bool

    @property
    def plan(self) -> HandPlan:
        """The plan of the candidates that are closed."""
        return self.problem.plan


def candidates_of(problem: Problem, calibration: Calibration) -> Candidates:
    """Return which candidates a solve closes.

    The full width goes before every plane: it alone passes through nothing, or a plane has its angles. If every finger
    has one full width, the planes are not closed and there is nothing to choose. Among planes alone the kernels choose
    by sums of the criteria that are always scored. Custom criteria score every candidate before the choice, so the
    solve raises what they raise. If all candidates need a measurement, one batch closes them, too.
    """
    plan, command = plan_hand(problem), problem.command
    tip_only = command.order.is_of_tips
    if command.check_candidates or not is_built_in(calibration.criteria):
        return Candidates(pack_problem(plan, problem.packed, (), tip_only), False)
    if plan.full_width is not None:
        return Candidates(pack_problem(plan.full_width, problem.packed, (), tip_only), True)
    few = all(len(p.finger.joints) <= _MOST_JOINTS for p in plan.plans)
    by_sums = not any(plan.is_full_width) and not plan.several and few and not tip_only and _sums_alone(calibration)
    terms = _terms(calibration) if by_sums else ()
    return Candidates(pack_problem(plan, problem.packed, terms, tip_only), by_sums)


def _sums_alone(calibration: Calibration) -> bool:
    """Say whether a calibration chooses by the sum of the criteria that are always scored, without limits."""
    weighs_joints = any(weight != 1.0 for weight in calibration.joints.values())
    return set(calibration.criteria) <= set(ALWAYS) and not calibration.limits and not weighs_joints


def _terms(calibration: Calibration) -> Terms:
    """Return the always-scored criteria of a calibration: their codes, and what one unit adds to the sum."""
    terms = [name for name in calibration.criteria if name in ALWAYS]
    return tuple((ALWAYS.index(name), calibration.worth(name, 1.0)) for name in terms)


def finger_candidates(problem: Problem) -> Groups:
    """Return all candidates of every finger."""
    plan = plan_hand(problem)
    packed = pack_problem(plan, problem.packed, (), problem.command.order.is_of_tips)
    closed = close_candidates(packed, problem.T_palm_object[:3])
    return group_by_finger(plan, read_judged(problem, plan, closed))


def overlaps_of(problem: Problem, plan: HandPlan, closed: Closed) -> list[LinkDepth | None]:
    """Return the link of every finger posture that overlaps the object at the start, or None; `closed`: at one pose."""
    return start_overlaps(plan, closed.blocked[0], problem.packed, problem.T_palm_object)


def read_judged(problem: Problem, plan: HandPlan, closed: Closed) -> list[FingerCandidate]:
    """Return the candidates that were closed at the problem's pose, judged; `closed` is for this pose alone."""
    overlaps = overlaps_of(problem, plan, closed)
    candidates = read_candidates(plan, problem.packed, row_of(closed.free, 0), problem.T_palm_object, overlaps)
    _judge(problem, candidates)
    return candidates


def with_planes(problem: Problem, overlaps: Sequence[LinkDepth | None], whole: Sequence[FingerCandidate]) -> Groups:
    """Return the candidates of every finger: planes are closed now, the full widths are given.

    Args:
        problem: the three inputs. overlaps: per finger posture. whole: the full width of every finger.
    """
    plan = plan_hand(problem).planes
    packed = pack_problem(plan, problem.packed, (), problem.command.order.is_of_tips)
    closed = close_candidates(packed, problem.T_palm_object[:3])
    candidates = read_candidates(plan, problem.packed, row_of(closed.free, 0), problem.T_palm_object, overlaps)
    _judge(problem, [*candidates, *whole])
    groups = group_by_finger(plan, candidates)
    return [[*group, full] for group, full in zip(groups, whole, strict=True)]


def group_by_finger(plan: HandPlan, candidates: Sequence[FingerCandidate]) -> Groups:
    """Return the candidates of each finger that closes, in the command's order."""
    groups: Groups = [[] for _ in plan.fingers]
    for finger, candidate in zip(plan.candidate_finger, candidates, strict=True):
        groups[finger].append(candidate)
    return groups


def _judge(problem: Problem, candidates: Sequence[FingerCandidate]) -> None:
    p = problem
    judge_candidates(p.hand, candidates, p.packed, p.T_palm_object, p.source, p.command.check_candidates, p.together)


@dataclass(eq=False)
class Alternatives:
    """The candidates of every finger, and the choice among them. Both are computed when first read.

    Args:
        problem, calibration, context: the basis of the choice. close: returns the candidates.
    """

    problem: Problem
    calibration: Calibration
    context: ScoringContext
    close: Callable[[], Groups]

    def __post_init__(self) -> None:
        """Make the choice once, also for threads that read at the same time: criteria keep values in the context."""
        close, calibration, context = self.close, self.calibration, self.context

        # Nothing here refers to this object, so that it is freed as soon as nobody uses it.
        def score() -> tuple[Groups, HandChoice]:
            groups = close()
            return groups, choose(groups, calibration, context)

        self._scored = once(score)

    @property
    def choice(self) -> HandChoice:
        """The choice among the candidates."""
        return self._scored()[1]

    def of_finger(self, k: int) -> Sequence[FingerCandidate]:
        """Return the candidates of a finger, as closed without the other fingers, with their scores."""
        return self._scored()[0][k]

    def chosen_candidates(self) -> tuple[list[int], bool]:
        """Return the chosen candidates, and whether links already overlap at the start of their closing."""
        best = [self.of_finger(k)[i] for k, i in enumerate(self.choice.chosen)]
        problem = self.problem
        opened = problem.start.copy()
        for c in best:
            own = c.plan.finger.own
            opened[own] = c.plan.posture[own]
        checked = plan_hand(problem).bodies.across
        nested = link_within_link(problem.hand, opened, problem.source, checked) is not None
        return [c.index for c in best], nested

    def explained(self, best: Sequence[FingerCandidate], changed: Sequence[int]) -> dict[str, Any]:
        """Return the choice as plain values; see `explain_choice`.

        Args:
            best: the chosen candidates. changed: numbers of those fingers that the others made close again.
        """
        groups, choice = self._scored()
        explained = explain_choice(choice, groups)
        for k in changed:
            explained["fingers"][best[k].plan.finger.name]["closed_again"] = True
        if changed:
            explained["final_hand_scores"] = score_hand(best, choice.used, self.context)
        return explained
