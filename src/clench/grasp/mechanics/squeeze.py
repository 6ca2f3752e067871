"""The squeeze: contact forces that hold an object with a margin, before anything disturbs it (METHOD.md section 6).

Forces f balance the nominal load. A disturbance d changes them by the least that balances it, `-K d`, as equally stiff
fingers do (torques of soft fingers count by gamma); the hand need not react. The margin is the largest s such that
`f - s K d` is inside all cones and torque limits for every disturbance d of a set: up to a margin that is enough, after
which the smallest worst torque is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.base.errors import CommandError
from clench.base.pose import FloatArray

from .actuation import MOST_FORCE, HoldingForces, checked, why_not
from .held import HeldObject
from .loads import check_loads
from .programs import ConeProgram, balanced, demand_cones, demand_limits

#: Margin that is enough unless another is asked for [-].
ENOUGH: Final = 2.0
#: Part of the margin that is given up for smaller torques [-].
_GIVEN_UP: Final = 1e-6
#: Disturbances of which more than this part cannot be exerted by any contact forces count as not resisted [-].
_UNRESISTED: Final = 1e-9


@dataclass(frozen=True, eq=False)
class SqueezeForces:
    """Hold a squeeze.

    Args:
        plan: forces and torques that balance the nominal load; None when there are none.
        margin: the disturbances are resisted up to this multiple [-].
        unresisted: rows of the disturbance set that no contact forces can balance; the margin leaves them out.
        reason: which limit binds where there is no plan, else "".
    """

    plan: HoldingForces | None
    margin: float
    unresisted: tuple[int, ...]
    reason: str


def squeeze_forces(
    held: HeldObject, load: ArrayLike, disturbances: ArrayLike, *, enough: float = ENOUGH
) -> SqueezeForces:
    """Return the forces that hold a load with the largest margin, inside cones and limits.

    Args:
        held: the grasp. load: nominal external wrench `(force, torque / length)` [N], shape (6,).
        disturbances: rows like it, shape (N, 6). enough: largest margin that is asked for [-].

    Raises:
        CommandError: malformed loads, an empty set, a margin that is not above 0.
    """
    nominal, rows = check_loads(load)[0], check_loads(disturbances)
    if not (np.isfinite(enough) and enough > 0.0):
        raise CommandError(f"margin: expected a finite number above 0, got {enough!r}.")
    if not len(held.contacts):
        return SqueezeForces(None, 0.0, (), "Nothing touches the object.")
    change = -_answers(held) @ rows.T
    missing = np.linalg.norm(held.grasp_map @ change + rows.T, axis=0)
    lost = missing > _UNRESISTED * np.linalg.norm(rows, axis=1)
    changes = change.T[~lost]
    best = _program(held, nominal, rows, changes, enough, None)
    if best is None:
        return SqueezeForces(None, 0.0, tuple(np.flatnonzero(lost).tolist()), why_not(held, nominal))
    margin = max(0.0, best[1])
    gentle = _program(held, nominal, rows, changes, enough, margin * (1.0 - _GIVEN_UP))
    plan, reached = gentle if gentle is not None else best
    return SqueezeForces(plan, max(0.0, reached), tuple(np.flatnonzero(lost).tolist()), "")


def _answers(held: HeldObject) -> FloatArray:
    """Return K, the least change of forces that exerts a wrench, shape (C * width, 6)."""
    weights = np.ones((len(held.contacts), held.contacts.width))
    if held.contacts.torsion is not None:
        weights[:, 3] = held.contacts.torsion
    scaled = weights.reshape(-1)
    K: FloatArray = scaled[:, None] * np.linalg.pinv(held.grasp_map * scaled)
    return K


def _program(
    held: HeldObject, load: FloatArray, rows: FloatArray, changes: FloatArray, enough: float, margin: float | None
) -> tuple[HoldingForces, float] | None:
    """Return forces and their margin: the largest one, or the smallest worst torque at a given margin."""
    contacts, G, J = held.contacts, held.grasp_map, held.jacobian
    count = J.shape[0]
    unit = max(float(np.linalg.norm(load)), float(np.linalg.norm(rows, axis=1).max())) or 1.0
    arm = float(np.abs(J).max(initial=0.0)) or 1.0
    size = count + 2
    spread, worst = np.eye(size)[count], np.eye(size)[count + 1]
    program = ConeProgram(size, -spread if margin is None else worst)
    forces = np.eye(count, size)
    program.equal(G @ forces, -load / unit)
    if margin is None:
        program.at_most(np.vstack([spread, -spread, worst, -worst]), np.array([enough, 0.0, 1.0, 0.0]))
    else:
        program.equal(spread[None], np.array([margin]))
        for sign in (1.0, -1.0):
            program.at_most(sign * (J.T @ forces) / arm - worst, np.zeros(J.shape[1]))
    program.at_most(forces[2 :: contacts.width], np.full(len(contacts), MOST_FORCE))
    for change in np.vstack([np.zeros((1, count)), changes / unit]):
        disturbed = forces + np.outer(change, spread)
        demand_cones(program, contacts, disturbed)
        demand_limits(program, J.T @ disturbed / arm, held.dofs.limits / (unit * arm))
    x = program.solve()
    if x is None:
        return None
    f = balanced(G, x[:count] * unit, -load)
    plan = checked(held, HoldingForces(load, f.reshape(len(contacts), contacts.width), held.torques(f)))
    return None if plan is None else (plan, float(x[count]))
