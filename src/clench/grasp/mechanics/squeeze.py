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

from .actuation import Effort, HoldingForces, HoldingProgram, solve_first
from .binding import why_not
from .held import HeldObject
from .loads import check_loads

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
    changes, unresisted = change.T[~lost], tuple(np.flatnonzero(lost).tolist())
    unit = max(float(np.linalg.norm(nominal)), float(np.linalg.norm(rows, axis=1).max())) or 1.0
    best = _largest_margin(held, nominal, unit, changes, enough)
    if best is None:
        return SqueezeForces(None, 0.0, unresisted, why_not(held, nominal))
    # A margin that is enough is reached to the last digit; only one that falls short gives up a part.
    gentle = _least_torque(held, nominal, unit, changes, min(enough, best[1] * (1.0 - _GIVEN_UP)))
    plan, margin = gentle if gentle is not None else best
    return SqueezeForces(plan, min(enough, margin), unresisted, "")


def _largest_margin(
    held: HeldObject, load: FloatArray, unit: float, changes: FloatArray, enough: float
) -> tuple[HoldingForces, float] | None:
    """Return forces and their margin, the largest one."""
    place = held.jacobian.shape[0]

    def build(tendons: bool) -> HoldingProgram:
        program = HoldingProgram(held, load, unit, extra=1, tendons=tendons)
        spread = np.eye(program.cone.size)[place]
        program.cone.cost[place] = -1.0
        program.cone.at_most(np.vstack([spread, -spread]), np.array([enough * (1.0 + 2.0 * _GIVEN_UP), 0.0]))
        _demand_spread(program, changes / unit, spread)
        return program

    found = solve_first(build, held)
    return None if found is None else (found[0], max(0.0, float(found[1][place])))


def _least_torque(
    held: HeldObject, load: FloatArray, unit: float, changes: FloatArray, margin: float
) -> tuple[HoldingForces, float] | None:
    """Return the forces of a given margin whose worst torque is smallest, and that margin."""
    place = held.jacobian.shape[0]

    def build(tendons: bool) -> HoldingProgram:
        program = HoldingProgram(held, load, unit, extra=2, tendons=tendons)
        spread, worst = np.eye(program.cone.size)[place : place + 2]
        program.cone.cost[place + 1] = 1.0
        program.cone.equal(spread[None], np.array([margin]))
        program.keep_below(worst, Effort.TORQUE)
        _demand_spread(program, changes / unit, spread)
        return program

    found = solve_first(build, held)
    return None if found is None else (found[0], margin)


def _demand_spread(program: HoldingProgram, changes: FloatArray, spread: FloatArray) -> None:
    program.demand_forces()
    for change in changes:
        program.demand_forces(change, spread)


def _answers(held: HeldObject) -> FloatArray:
    """Return K, the least change of forces that exerts a wrench, shape (C * width, 6)."""
    weights = np.ones((len(held.contacts), held.contacts.width))
    if held.contacts.torsion is not None:
        weights[:, 3] = held.contacts.torsion
    scaled = weights.reshape(-1)
    K: FloatArray = scaled[:, None] * np.linalg.pinv(held.grasp_map * scaled)
    return K
