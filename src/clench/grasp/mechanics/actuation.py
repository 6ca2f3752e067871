"""Actuation force: the smallest worst joint torque with which a grasp holds a load (METHOD.md section 6).

A. Bicchi and V. Kumar, "Robotic grasping and contact: a review", ICRA 2000, give the problem: forces are not
determined by the load alone; among those inside the cones the best are chosen. Friction cones are second-order
cones here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.base.pose import FloatArray

from .held import HeldObject
from .loads import check_loads
from .programs import ConeProgram, balanced, demand_cones, demand_limits

#: Friction is raised up to this factor to see whether it is what lacks [-].
_MOST_FRICTION = 100.0
#: Joints whose use of their limit is this close to the largest bind, too [-].
_AS_MUCH = 1e-4
_HALVINGS = 20
#: Largest normal force that is considered, as a multiple of the load [-].
MOST_FORCE: Final = 1e3
#: What a plan may miss balance, cones and limits by, beside forces of 1 N [N, Nm].
ALLOWED: Final = 1e-9


@dataclass(frozen=True, eq=False)
class HoldingForces:
    """Hold contact forces that balance a load.

    Args:
        load: the external wrench `(force, torque / length)` [N], shape (6,).
        forces: on the object, in the contact frames [N, Nm], shape (C, width).
        torques: of the degrees of freedom [Nm], shape (D,).
    """

    load: FloatArray
    forces: FloatArray
    torques: FloatArray

    @property
    def worst_torque(self) -> float:
        """The largest torque of a joint [Nm]."""
        return float(np.abs(self.torques).max(initial=0.0))


@dataclass(frozen=True)
class Actuation:
    """Hold what it takes to hold a set of loads.

    Args:
        worst_torque: largest torque of a joint over all loads [Nm]; None when some load cannot be held.
        plans: one for every load, None where it cannot be held.
        reason: which limit binds at the first load that cannot be held, else "".
    """

    worst_torque: float | None
    plans: tuple[HoldingForces | None, ...]
    reason: str


def actuation(held: HeldObject, loads: ArrayLike) -> Actuation:
    """Return the smallest worst torque for every load of a set.

    Args:
        held: the grasp. loads: rows `(force, torque / length)` [N], shape (N, 6).

    Raises:
        CommandError: an empty or malformed set.
    """
    rows = check_loads(loads)
    plans = tuple(least_torque(held, load) for load in rows)
    failed = [load for load, plan in zip(rows, plans, strict=True) if plan is None]
    if failed:
        return Actuation(None, plans, why_not(held, failed[0]))
    return Actuation(max(p.worst_torque for p in plans if p is not None), plans, "")


def least_torque(held: HeldObject, load: FloatArray) -> HoldingForces | None:
    """Return forces that hold a load with the smallest worst torque, inside cones and limits; None when there are none.

    Args:
        held: the grasp. load: external wrench, shape (6,).
    """
    contacts, G, J = held.contacts, held.grasp_map, held.jacobian
    count, unit = J.shape[0], float(np.linalg.norm(load))
    if unit == 0.0:
        return HoldingForces(load, np.zeros((len(contacts), contacts.width)), np.zeros(J.shape[1]))
    if count == 0:
        return None
    # Arms are centimetres: in these units torques are as large as forces.
    arm = float(np.abs(J).max(initial=0.0)) or 1.0
    worst = np.eye(count + 1)[-1]
    program = ConeProgram(count + 1, worst)
    forces = np.eye(count, count + 1)
    torques = J.T @ forces / arm
    program.equal(G @ forces, -load / unit)
    demand_cones(program, contacts, forces)
    demand_limits(program, torques, held.dofs.limits / (unit * arm))
    for sign in (1.0, -1.0):
        program.at_most(sign * torques - worst, np.zeros(len(torques)))
    program.at_most(-worst[None], np.zeros(1))
    program.at_most(forces[2 :: contacts.width], np.full(len(contacts), MOST_FORCE))
    x = program.solve()
    if x is None:
        return None
    f = balanced(G, x[:count] * unit, -load)
    return checked(held, HoldingForces(load, f.reshape(len(contacts), contacts.width), held.torques(f)))


def checked(held: HeldObject, plan: HoldingForces) -> HoldingForces | None:
    """Return a plan that balances its load inside cones and limits, to rounding; None in place of one that does not."""
    size = max(1.0, float(np.abs(plan.forces).max(initial=0.0)))
    off = np.abs(held.grasp_map @ plan.forces.reshape(-1) + plan.load).max()
    slack = held.contacts.cone_slack(plan.forces).min(initial=np.inf)
    spare = (held.dofs.limits - np.abs(plan.torques)).min(initial=np.inf)
    return plan if max(off, -slack, -spare) <= ALLOWED * size else None


def why_not(held: HeldObject, load: FloatArray) -> str:
    """Return a sentence that names what keeps a load from being held: torque limits, friction, or the contacts."""
    if not len(held.contacts):
        return "Nothing touches the object."
    free = least_torque(held.without_limits(), load)
    if free is not None:
        return _binding_joints(held, load, free)
    if least_torque(held.with_friction(held.contacts.friction * _MOST_FRICTION).without_limits(), load) is None:
        return "No friction would do: the contacts can only push, and not against this load."
    low, high = 1.0, _MOST_FRICTION
    for _ in range(_HALVINGS):
        middle = np.sqrt(low * high)
        enough = least_torque(held.with_friction(held.contacts.friction * middle).without_limits(), load) is not None
        low, high = (low, middle) if enough else (middle, high)
    least = float(held.contacts.friction.min())
    return f"Friction binds: {high:.3g} times as much would do (at least {least * high:.3g} instead of {least:.3g})."


def _binding_joints(held: HeldObject, load: FloatArray, free: HoldingForces) -> str:
    """Return a sentence that names the joints whose limits are exceeded, at the forces that exceed them least."""
    limits = held.dofs.limits
    fair = _least_use(held, load) or free
    use = np.abs(fair.torques) / limits
    binding = [j for j in range(len(use)) if use[j] >= use.max() * (1.0 - _AS_MUCH)]
    named = ", ".join(f"'{held.dofs.names[j]}' ({limits[j]:.3g} Nm)" for j in binding)
    return f"Torque limits bind: {named}; {use.max():.3g} times as much would do."


def _least_use(held: HeldObject, load: FloatArray) -> HoldingForces | None:
    """Return forces whose largest torque, as a fraction of its joint's limit, is smallest; limits may be exceeded."""
    limits = held.dofs.limits
    finite = np.isfinite(limits)
    scaled = np.where(finite, limits, 1.0)
    weighed = HeldObject(
        held.contacts, held.center, held.length, held.dofs, np.where(finite, held.jacobian / scaled, 0.0)
    ).without_limits()
    plan = least_torque(weighed, load)
    return None if plan is None else HoldingForces(load, plan.forces, held.torques(plan.forces))
