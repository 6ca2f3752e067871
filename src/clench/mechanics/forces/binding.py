"""Find the limit that makes a load impossible to hold: torque limits, tendons, friction, or the contacts themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.mechanics.grasp.held import HeldObject

from .actuation import HoldingForces, least_effort

#: Friction is raised up to this factor, and at least to this friction, to test whether friction is the limit [-].
MOST_FRICTION: Final = 100.0
#: Joints whose use of their limit is this close to the largest bind, too [-].
_AS_MUCH = 1e-4
_HALVINGS = 20


def why_not(held: HeldObject, load: FloatArray) -> str:
    """Return a sentence that names the limit that makes a load impossible to hold.

    Args:
        held: the grasp. load: external wrench that it does not hold, shape (6,).
    """
    if not len(held.contacts):
        return "Nothing touches the object."
    free = least_effort(held.without_limits(), load)
    if free is None:
        return _friction(held.without_limits(), load)
    fair = _least_use(held, load) or free
    if (np.abs(fair.torques) > held.dofs.limits).any() or held.drive is None:
        return _joints(held, fair)
    tensions = held.drive.tensions(fair.torques[list(held.drive.columns)])
    if tensions.feasible:
        return "No forces inside all cones and limits were found."
    named = ", ".join(f"'{name}'" for name in tensions.infeasible)
    return f"Tendons bind: no tensions within their limits give the torques of {named}."


def _friction(held: HeldObject, load: FloatArray) -> str:
    def holds(factor: float) -> bool:
        return least_effort(held.with_friction(held.contacts.friction * factor), load) is not None

    least = float(held.contacts.friction.min())
    most = MOST_FRICTION * max(1.0, 1.0 / least)
    if not holds(most):
        return "No friction would do: the contacts can only push, and not against this load."
    low, high = 1.0, most
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if holds(middle) else (middle, high)
    return f"Friction binds: {high:.3g} times as much would do (at least {least * high:.3g} instead of {least:.3g})."


def _joints(held: HeldObject, plan: HoldingForces) -> str:
    """Return a sentence that names the joints whose limits a plan exceeds most."""
    limits = held.dofs.limits
    use = np.abs(plan.torques) / limits
    binding = [j for j in range(len(use)) if use[j] >= use.max() * (1.0 - _AS_MUCH)]
    named = ", ".join(f"'{held.dofs.names[j]}' ({limits[j]:.3g} Nm)" for j in binding)
    return f"Torque limits bind: {named}; {use.max():.3g} times as much would do."


def _least_use(held: HeldObject, load: FloatArray) -> HoldingForces | None:
    """Return forces whose largest torque, as a fraction of its joint's limit, is smallest; limits may be exceeded."""
    limits = held.dofs.limits
    finite = np.isfinite(limits)
    weighed = np.where(finite, held.jacobian / np.where(finite, limits, 1.0), 0.0)
    plan = least_effort(replace(held.without_limits(), jacobian=weighed), load)
    return None if plan is None else replace(plan, torques=held.torques(plan.forces))
