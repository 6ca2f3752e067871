"""Complete a solution on first reading: quality, squeeze and pregrasp."""

from __future__ import annotations

from dataclasses import replace

from clench.core.defaults import MASS
from clench.mechanics.grasp.contacts import ContactModel
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.quality import grasp_quality
from clench.solver.analysis.squeezing import plan_squeeze
from clench.solver.solution import GraspSolution

from .landing import CLEARANCE
from .pregrasp import plan_pregrasp


def complete(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    *,
    mass: float | tuple[float, float] = MASS,
    friction: float | tuple[float, float] | None = None,
    contact_model: ContactModel | str = ContactModel.POINT,
    clearance: float = CLEARANCE,
) -> GraspSolution:
    """Return a solution with `quality`, `squeeze` and `pregrasp`, as its document has them.

    They cost a hundred times the solve, so `clench.solve` leaves them out; the command line fills them into every
    document that it writes.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for.
        mass: of the object [kg]; friction: of its contacts [-]: numbers or ranges, see `plan_squeeze`.
        contact_model: see `grasp_quality`. clearance: see `plan_pregrasp` [m].

    Raises:
        CommandError: a value out of range; the solution is of another hand.
    """
    quality = grasp_quality(solution, hand, obj, mass=mass, friction=friction, contact_model=contact_model)
    squeeze = plan_squeeze(solution, hand, obj, mass=mass, friction=friction, contact_model=contact_model)
    # For joints that closed in several rounds, no path to back off along is known.
    pregrasp = plan_pregrasp(solution, hand, obj=obj, clearance=clearance) if solution.rounds == 1 else None
    return replace(solution, quality=quality.to_dict(), squeeze=squeeze.to_dict(), pregrasp=pregrasp)
