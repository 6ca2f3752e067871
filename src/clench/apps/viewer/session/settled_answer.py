"""The exact numbers once the user has let go: the reason in words, the hold margin and the forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import clench
from clench.core.exceptions import ClenchError
from clench.solver.analysis.quality import GraspQuality
from clench.solver.analysis.squeezing import SqueezePlan
from clench.solver.solution import GraspSolution

from .quick_answer import QuickAnswer


@dataclass(frozen=True, eq=False)
class SettledAnswer:
    """Everything about a grasp that the page shows at rest.

    Args:
        quick: the answer that was drawn before. solution: the whole answer.
        quality: how steady it is, squeeze: the forces that hold the object; None without contacts.
        problem: why one of the two is missing; empty where none is.
    """

    quick: QuickAnswer
    solution: GraspSolution
    quality: GraspQuality | None
    squeeze: SqueezePlan | None
    problem: str = ""


def settle(quick: QuickAnswer, is_outdated: Callable[[], bool]) -> SettledAnswer | None:
    """Return the exact numbers of an answer, or None when they are no longer wanted.

    Args:
        quick: the answer. is_outdated: whether something newer was asked for; called between the steps.

    Raises:
        ClenchError: see `clench.solve`.
    """
    state, hand, obj = quick.state, quick.hand, quick.obj
    solution = quick.solution or clench.solve(hand, obj, state.command)
    if is_outdated():
        return None
    if not quick.links:
        return SettledAnswer(quick, solution, None, None)
    try:
        quality = clench.grasp_quality(solution, hand, obj, mass=state.mass, friction=state.friction)
        if is_outdated():
            return None
        squeeze = clench.plan_squeeze(solution, hand, obj, mass=state.mass, friction=state.friction)
    except ClenchError as error:
        return SettledAnswer(quick, solution, None, None, str(error))
    return SettledAnswer(quick, solution, quality, squeeze)
