"""The squeeze: contact forces that hold an object with a margin against disturbances (docs/method.md section 6).

Forces f balance the nominal load. A disturbance d changes them by the smallest forces that balance it, `-K d`, as
equally stiff fingers do (torques of soft fingers count by gamma). The hand need not react. The margin is the largest s
such that `f - s K d` is inside all cones and torque limits for every disturbance d of a set. Once the margin is large
enough, torques are minimised. A load that is known only as `load ± spread` must be held at both of its ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.caching.deferring import LateFields, once
from clench.core.defaults import LOAD_RESERVE
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.mechanics.grasp.held import HeldObject
from clench.mechanics.grasp.loads import check_loads

from .actuation import Effort, HoldingForces, HoldingProgram, least_effort, solve_first
from .binding import why_not
from .joint_friction import loss_of_torques, pressed_harder

#: Part of the margin that is given up for smaller torques [-].
_GIVEN_UP: Final = 1e-6
#: Disturbances of which more than this part cannot be exerted by any contact forces count as not resisted [-].
_UNRESISTED: Final = 1e-9
#: Edges of the polyhedra around the friction cones by which loads are refused [-].
_EDGES: Final = 8
#: Part of a load that may be missing in a balance of forces [-].
_UNBALANCED: Final = 1e-8
#: Weight of the sum of normal forces beside the worst torque: no finger presses without need [-].
_TOTAL_FORCE: Final = 0.02


@dataclass(frozen=True, eq=False)
class SqueezeForces(LateFields):
    """A squeeze.

    Args:
        plan: forces and torques that balance the nominal load; None when there are none.
        margin: the disturbances are resisted up to this multiple [-].
        unresisted: rows of the disturbance set that no contact forces can balance; the margin leaves them out.
        reason: the binding limit if there is no plan, else ""; looked for when it is first read.
        reserve: the plan counts on this part of the friction [-].
        loss: largest share of a finger's torques that joint friction takes [-].
    """

    plan: HoldingForces | None
    margin: float
    unresisted: tuple[int, ...]
    reason: str
    reserve: float = 1.0
    loss: float = 0.0

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class SqueezeTask:
    """The demands on a squeeze.

    Args:
        held: the grasp. load: nominal external wrench, shape (6,). unit: forces are counted in this many newtons.
        ends: changes of the forces at the ends of the load's range, shape (E, C * width).
        changes: changes of the forces by the disturbances, shape (N, C * width).
        enough: largest margin that is asked for [-]. most_force: normal forces sum to at most this [N].
    """

    held: HeldObject
    load: FloatArray
    unit: float
    ends: FloatArray
    changes: FloatArray
    enough: float
    most_force: float

    def cases(self, margin: float) -> FloatArray:
        """Return all changes of the forces that must be survived, shape (M, C * width)."""
        nothing = np.zeros((1, self.changes.shape[1]))
        disturbed = np.vstack([nothing, margin * self.changes])
        return (self.ends[:, None] + disturbed[None]).reshape(-1, self.changes.shape[1])


def squeeze_forces(
    held: HeldObject,
    load: ArrayLike,
    disturbances: ArrayLike,
    *,
    enough: float = LOAD_RESERVE,
    needed: float = 0.0,
    spread: ArrayLike | None = None,
    reserve: float = 1.0,
    most_force: float = np.inf,
) -> SqueezeForces:
    """Return the forces that hold a load with the largest margin, inside cones and limits.

    Args:
        held: the grasp. load: nominal external wrench `(force, torque / length)` [N], shape (6,).
        disturbances: rows like it, shape (N, 6). enough: largest margin that is asked for [-].
        needed: without this margin the load does not count as held [-].
        spread: the load is anything from `load - spread` to `load + spread` [N], shape (6,); None: the load itself.
        reserve: part of the friction that is counted on, where the load is held so; else all of it is counted on [-].
        most_force: the normal forces sum to at most this [N].

    Raises:
        CommandError: malformed loads, an empty set, a margin that is not above 0, a reserve that is not in (0, 1].
    """
    nominal, rows = check_loads(load)[0], check_loads(disturbances)
    if not (np.isfinite(enough) and enough > 0.0):
        raise CommandError(f"margin: expected a finite number above 0, got {enough!r}.")
    if not 0.0 < reserve <= 1.0:
        raise CommandError(f"reserve: expected a part of the friction, above 0 and up to 1, got {reserve!r}.")
    if not len(held.contacts):
        return SqueezeForces(None, 0.0, (), "Nothing touches the object.")
    K = _answers(held)
    change = -K @ rows.T
    missing = np.linalg.norm(held.grasp_map @ change + rows.T, axis=0)
    lost = missing > _UNRESISTED * np.linalg.norm(rows, axis=1)
    unresisted = tuple(np.flatnonzero(lost).tolist())
    unit = max(float(np.linalg.norm(nominal)), float(np.linalg.norm(rows, axis=1).max())) or 1.0
    ends = np.zeros((1, len(change))) if spread is None else np.outer([1.0, -1.0], K @ check_loads(spread)[0])
    task = SqueezeTask(held, nominal, unit, ends, change.T[~lost], enough, most_force)
    careful = _with_friction(task, reserve)
    found, counted = _squeeze_of(task, careful, needed) if _may_be_held(held, nominal) else (None, task)
    if found is None:
        reason = once(lambda: why_not(held, nominal))
        return SqueezeForces.with_late(
            lambda _: reason(), plan=None, margin=0.0, unresisted=unresisted, reserve=1.0, loss=0.0
        )
    plan = pressed_harder(
        counted.held, found[0], found[0].forces.reshape(-1) + K @ nominal, counted.cases(found[1]), most_force
    )
    used = reserve if counted is careful else 1.0
    return SqueezeForces(plan, found[1], unresisted, "", used, loss_of_torques(held, plan))


def _may_be_held(held: HeldObject, load: FloatArray) -> bool:
    """Say whether polyhedra around the friction cones hold a load, limits left aside; a linear program tells."""
    from clench.kernels.mechanics.least_cost import least_cost

    if not load.any():
        return True
    contacts, wider = held.contacts, 1.0 / np.cos(np.pi / _EDGES)
    torsion = contacts.torsion
    if torsion is not None:
        # The hull of a circle and two points around an ellipsoid.
        wider, torsion = np.sqrt(2.0) * wider, np.sqrt(2.0) * torsion
    around = replace(held, contacts=replace(contacts, friction=wider * contacts.friction, torsion=torsion))
    edges = around.edge_wrenches(_EDGES).reshape(-1, 6).T
    wanted = -load / np.linalg.norm(load)
    rows, most = np.vstack([edges, -edges]), np.concatenate([wanted, -wanted]) + _UNBALANCED
    return bool(least_cost(np.ascontiguousarray(rows), most, np.ones(rows.shape[1]), np.empty(rows.shape[1])))


def _with_friction(task: SqueezeTask, reserve: float) -> SqueezeTask:
    """Return a task that counts on a part of the friction."""
    if reserve == 1.0:
        return task
    held = task.held.with_friction(reserve * task.held.contacts.friction)
    return SqueezeTask(held, task.load, task.unit, task.ends, task.changes, task.enough, task.most_force)


def _squeeze_of(
    task: SqueezeTask, careful: SqueezeTask, needed: float
) -> tuple[tuple[HoldingForces, float] | None, SqueezeTask]:
    """Return forces with their margin, and the task that they fulfil: the careful task if it is feasible."""
    # Most squeezes reach all the margin that is asked for, or nearly.
    found = _least_torque(careful, careful.enough * (1.0 if needed else 1.0 - _GIVEN_UP))
    if found is not None:
        return found, careful
    if needed == 0.0:
        best = _largest_margin(careful)
        if best is not None:
            return _gentle(careful, best), careful
    # Most grasps that hold nothing do not even hold the load itself, which a small program tells.
    if task.load.any() and least_effort(task.held, task.load) is None:
        return None, task
    if needed == 0.0:
        best = None if careful is task else _largest_margin(task)
        return None if best is None else _gentle(task, best), task
    # For the others, only loads that full friction can hold are feasible.
    best = _largest_margin(task)
    if best is None:
        return None, task
    if careful is not task and best[1] >= needed:
        kept = _largest_margin(careful)
        if kept is not None and kept[1] >= needed:
            return _gentle(careful, kept), careful
    return _gentle(task, best), task


def _gentle(task: SqueezeTask, best: tuple[HoldingForces, float]) -> tuple[HoldingForces, float]:
    """Return forces of nearly the largest margin whose torques are small; those given where the solver finds none."""
    # A margin that is large enough is reached to the last digit; only a smaller margin gives up a part.
    return _least_torque(task, min(task.enough, best[1] * (1.0 - _GIVEN_UP))) or best


def _largest_margin(task: SqueezeTask) -> tuple[HoldingForces, float] | None:
    """Return forces and their margin, the largest one."""
    place = task.held.jacobian.shape[0]

    def build(tendons: bool) -> HoldingProgram:
        program = HoldingProgram(task.held, task.load, task.unit, extra=1, tendons=tendons)
        spread = np.eye(program.cone.size)[place]
        program.cone.cost[place] = -1.0
        program.cone.at_most(np.vstack([spread, -spread]), np.array([task.enough * (1.0 + 2.0 * _GIVEN_UP), 0.0]))
        _demand(program, task, spread)
        return program

    found = solve_first(build, task.held)
    return None if found is None else (found[0], min(task.enough, max(0.0, float(found[1][place]))))


def _least_torque(task: SqueezeTask, margin: float) -> tuple[HoldingForces, float] | None:
    """Return the forces of a given margin whose worst torque is smallest, and that margin."""
    place = task.held.jacobian.shape[0]

    def build(tendons: bool) -> HoldingProgram:
        program = HoldingProgram(task.held, task.load, task.unit, extra=2, tendons=tendons)
        spread, worst = np.eye(program.cone.size)[place : place + 2]
        program.cone.cost[place + 1] = 1.0
        program.cone.cost += _TOTAL_FORCE * program.normals.sum(axis=0)
        program.cone.equal(spread[None], np.array([margin]))
        program.keep_below(worst, Effort.TORQUE)
        _demand(program, task, spread)
        return program

    found = solve_first(build, task.held)
    return None if found is None else (found[0], margin)


def _demand(program: HoldingProgram, task: SqueezeTask, spread: FloatArray) -> None:
    program.cone.at_most(program.normals.sum(axis=0)[None], np.array([task.most_force / task.unit]))
    program.demand_forces(task.ends / task.unit, task.changes / task.unit, spread)


def _answers(held: HeldObject) -> FloatArray:
    """Return K, the least change of forces that exerts a wrench, shape (C * width, 6)."""
    weights = np.ones((len(held.contacts), held.contacts.width))
    if held.contacts.torsion is not None:
        weights[:, 3] = held.contacts.torsion
    scaled = weights.reshape(-1)
    K: FloatArray = scaled[:, None] * np.linalg.pinv(held.grasp_map * scaled)
    return K
