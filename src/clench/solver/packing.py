"""A command, planned and packed for the kernels that solve it at any poses."""

from __future__ import annotations

from collections import OrderedDict

from clench.base.keeping import kept_while_alive
from clench.grasp.batching import PackedProblem, choosing_terms, pack_problem, sums_alone
from clench.grasp.calibration import Calibration
from clench.grasp.exact import hand_bodies
from clench.grasp.scene import PackedObject
from clench.models.command import ClosingOrder

from .planning import KEPT_PLANS, Planned
from .problem import Problem

#: What a choice by sums depends on, and the plan by its identity.
_Key = tuple[int, tuple[tuple[int, float], ...]]
_Kept = OrderedDict[_Key, tuple[Planned, PackedProblem]]


def packed_problem(problem: Problem, made: Planned, calibration: Calibration) -> PackedProblem | None:
    """Return a problem for the kernels of a batch, packed once; None where they do not cover it.

    Args:
        problem: the three inputs. made: their plan. calibration: what counts.
    """
    command = problem.command
    usual = command.order == ClosingOrder.PROXIMAL_FIRST and command.rounds == 1 and not command.check_sets
    if not usual or not made.covered or not (made.whole or sums_alone(calibration)):
        return None
    terms = () if made.whole else choosing_terms(calibration)
    kept, key = _packed_with(problem.packed), (id(made), terms)
    entry = kept.get(key)
    if entry is None:
        entry = kept[key] = made, _pack(made, problem.packed, terms)
        while len(kept) > KEPT_PLANS:
            kept.popitem(last=False)
    return entry[1]


@kept_while_alive
def _packed_with(packed: PackedObject) -> _Kept:
    """Return what is kept for an object."""
    return OrderedDict()


def _pack(made: Planned, packed: PackedObject, terms: tuple[tuple[int, float], ...]) -> PackedProblem:
    hand, source = made.hand, made.source
    bodies = hand_bodies(hand, source, made.start)
    return pack_problem(hand, made.plan, made.exact, packed, made.start, source, bodies, terms, len(made.idle))
