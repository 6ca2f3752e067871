"""Closing orders as alternatives: every order is solved by itself, and the best of the solutions is kept.

An order applies to the whole hand. In `together` and `fingertip` all fingers close simultaneously and stop each other,
so the fingers do not mix orders.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from clench.core.exceptions import ClenchError
from clench.models.command import ClosingOrder, GraspCommand
from clench.scoring.criterion_registry import find_criterion, is_of_hand
from clench.scoring.explaining import say_what_decided

from .solution import GraspSolution, SolutionStatus, posture_reason, solve_scores

#: Tiers that rank one order before another regardless of the scores, strongest first; as `_Solved.rank` lists them.
_TIERS: Final = (
    "is a valid {status}",
    "ends as {status}",
    "is inside the limits of the calibration",
    "has a value for every criterion",
)
_BEST_FIRST: Final = (
    SolutionStatus.GRASP,
    SolutionStatus.PARTIAL,
    SolutionStatus.NO_CONTACT,
    SolutionStatus.BLOCKED,
)


@dataclass(frozen=True, eq=False)
class _Solved:
    """The solution of one closing order, and its scores.

    Args:
        order, solution: the order and its solution. scores: by criterion. worth: contribution of each to the weighted
            sum [-].
        inside: its values are inside the limits.
    """

    order: ClosingOrder
    solution: GraspSolution
    scores: Mapping[str, float]
    worth: Mapping[str, float]
    inside: bool

    @property
    def total(self) -> float:
        """The weighted sum [-]."""
        return sum(self.worth.values())

    @property
    def rank(self) -> tuple[bool, int, bool, int, float]:
        """Sort key: larger for the better order."""
        solution = self.solution
        place = -_BEST_FIRST.index(solution.status)
        return solution.is_valid(), place, self.inside, len(self.worth), round(self.total, 9)


def best_order(command: GraspCommand, solve: Callable[[GraspCommand], GraspSolution]) -> GraspSolution:
    """Return the best of the solutions of a command's orders; its `choice` says how they compare.

    Orders that the hand does not allow are left out, and said; of equal ones the first wins.

    Args:
        command: with at least one of `orders`. solve: solves a command of one order.

    Raises:
        ClenchError: no order can be solved; the text is that of the first order.
    """
    solutions: dict[ClosingOrder, GraspSolution] = {}
    refused: dict[ClosingOrder, ClenchError] = {}
    for order in command.orders:
        try:
            solutions[order] = solve(replace(command, order=order, orders=()))
        except ClenchError as error:
            refused[order] = error
    if not solutions:
        raise refused[command.orders[0]]
    # A criterion that has a value for one order counts for all: an order without a value is not inside its limit.
    criteria: dict[str, Any] = {}
    for solution in solutions.values():
        criteria |= (solution.choice or {}).get("criteria", {})
    solved = [_judged(order, solution, criteria) for order, solution in solutions.items()]
    ranked = sorted(solved, key=lambda s: s.rank, reverse=True)
    best = ranked[0]
    compared: dict[str, Any] = {str(s.order): _described(s) for s in solved}
    compared |= {str(order): {"refused": str(error)} for order, error in refused.items()}
    text = _text(best, ranked[1]) if len(ranked) > 1 else f"{best.order} is the only order that could be solved."
    choice = {**(best.solution.choice or {}), "orders": {"chosen": str(best.order), "text": text, "compared": compared}}
    stages = dict.fromkeys(stage for s in solved for stage in s.solution.timing)
    timing = {stage: sum(s.solution.timing.get(stage, 0.0) for s in solved) for stage in stages}
    return replace(best.solution, choice=choice, timing=timing)


def settled(command: GraspCommand, solution: GraspSolution) -> GraspCommand:
    """Return a command with the order and the posture that were chosen for a solution of it."""
    orders = (solution.choice or {}).get("orders") if command.orders else None
    if orders is not None:
        command = replace(command, order=ClosingOrder(orders["chosen"]), orders=())
    posture = posture_reason(solution)
    if posture is not None:
        command = replace(command, preshape=dict(posture["angles"]))
    return command


def _judged(order: ClosingOrder, solution: GraspSolution, criteria: Mapping[str, Any]) -> _Solved:
    scores, worth = solve_scores(solution), {}
    for name, c in criteria.items():
        if name in scores:
            sign = 1.0 if c["better"] == "more" else -1.0
            worth[name] = sign * c["weight"] * scores[name] / c["scale"]
    inside = all(_inside_limit(name, c, solution) for name, c in criteria.items() if c["limit"] is not None)
    return _Solved(order, solution, scores, worth, inside)


def _inside_limit(name: str, criterion: Mapping[str, Any], solution: GraspSolution) -> bool:
    """Say whether all values of a criterion are inside its limit; an unknown value is not."""
    if is_of_hand(find_criterion(name, "orders")):
        values = [(solution.choice or {}).get("final_hand_scores", {}).get(name)]
    else:  # a finger of whose candidates it says nothing is left aside, as among candidates
        fingers = [f for f in solution.fingers.values() if any(name in c.scores for c in f.candidates)]
        values = [f.candidates[f.chosen].scores.get(name) for f in fingers]
    limit, more = criterion["limit"], criterion["better"] == "more"
    return all(v is not None and (v >= limit if more else v <= limit) for v in values)


def _described(solved: _Solved) -> dict[str, Any]:
    return {
        "status": solved.solution.status.value,
        "valid": solved.solution.is_valid(),
        "scores": {name: solved.scores[name] for name in solved.worth},
        "total": solved.total,
    }


def _text(best: _Solved, second: _Solved) -> str:
    """Return the sentence that says why an order won."""
    for what, ours, theirs in zip(_TIERS, best.rank, second.rank, strict=False):
        if ours != theirs:
            said = what.format(status=best.solution.status.value)
            return f"{best.order} comes before {second.order} because it {said}."
    lead = best.total - second.total
    gains = {name: worth - second.worth[name] for name, worth in best.worth.items() if name in second.worth}
    if best.rank == second.rank or not gains:
        return f"{best.order} and {second.order} score the same; the first goes before the second."
    return f"{best.order} leads {second.order} by {lead:.3g}; {say_what_decided(gains, best.scores, second.scores)}"
