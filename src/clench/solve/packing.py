"""A command, planned and packed for the kernels that solve it at any poses."""

from __future__ import annotations

from clench.base.keeping import kept_by_identity
from clench.grasp.batching import PackedProblem, is_covered, pack_problem
from clench.grasp.calibration import Calibration
from clench.grasp.exact import hand_bodies
from clench.grasp.scene import KEPT_OBJECTS, PackedObject
from clench.models.command import ClosingOrder

from .planning import Planned, planned
from .problem import Problem


def packed_problem(problem: Problem, calibration: Calibration) -> PackedProblem | None:
    """Return a problem for the kernels of a batch, packed once; None where they do not cover it."""
    command = problem.command
    usual = command.order == ClosingOrder.PROXIMAL_FIRST and command.rounds == 1 and not command.check_sets
    return _packed(planned(problem), problem.packed, calibration) if usual else None


@kept_by_identity(KEPT_OBJECTS)
def _packed(made: Planned, packed: PackedObject, calibration: Calibration) -> PackedProblem | None:
    hand, source = made.hand, made.source
    if not is_covered(hand, made.plan, calibration):
        return None
    bodies = hand_bodies(hand, source)
    return pack_problem(hand, made.plan, made.exact, packed, made.start, source, bodies, calibration, len(made.idle))
