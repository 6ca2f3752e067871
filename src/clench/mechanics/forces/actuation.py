"""Actuation force: the smallest worst joint torque, or tendon tension, that holds a load (docs/method.md section 6).

A. Bicchi and V. Kumar, "Robotic grasping and contact: a review", ICRA 2000, state the problem: the load does not
determine the forces. Among the forces inside the cones, the best are chosen. Friction cones are second-order cones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.caching.deferring import LateFields, once
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.mechanics.grasp.held import HeldObject
from clench.mechanics.grasp.loads import check_loads

from .programs import ConeProgram, balanced, demand_cones, demand_limits, demand_tensions, hardest_changes

#: Largest normal force that is considered, as a multiple of the load [-].
MOST_FORCE: Final = 1e3
#: Allowed error of a plan in balance, cones and limits, for forces of 1 N [N, Nm].
ALLOWED: Final = 1e-9


class Effort(StrEnum):
    """The effort that is minimised."""

    TORQUE = "torque"
    """the largest torque of a joint [Nm]"""
    TENSION = "tension"
    """the largest tension of a tendon [N]"""


@dataclass(frozen=True, eq=False)
class HoldingForces:
    """Contact forces that balance a load.

    Args:
        load: the external wrench `(force, torque / length)` [N], shape (6,).
        forces: on the object, in the contact frames [N, Nm], shape (C, width).
        torques: of the degrees of freedom [Nm], shape (D,).
        tensions: of the tendons [N], shape (T,); None without tendons.
    """

    load: FloatArray
    forces: FloatArray
    torques: FloatArray
    tensions: FloatArray | None = None

    @property
    def worst_torque(self) -> float:
        """The largest torque of a joint [Nm]."""
        return float(np.abs(self.torques).max(initial=0.0))

    @property
    def worst_tension(self) -> float | None:
        """The largest tension of a tendon [N], None without tendons."""
        return None if self.tensions is None else float(self.tensions.max(initial=0.0))


@dataclass(frozen=True)
class Actuation(LateFields):
    """The effort of holding a set of loads.

    Args:
        worst_torque: largest torque of a joint over all loads [Nm]; None when some load cannot be held.
        worst_tension: largest tension of a tendon over all loads [N]; None also without tendons.
        plans: one per load, None if it cannot be held.
        reason: which limit binds at the first load that cannot be held, else ""; looked for when it is first read.
    """

    worst_torque: float | None
    worst_tension: float | None
    plans: tuple[HoldingForces | None, ...]
    reason: str

    __repr__ = short_repr


def actuation(held: HeldObject, loads: ArrayLike, least: Effort | str = Effort.TORQUE) -> Actuation:
    """Return the smallest worst torque, or tension, for every load of a set.

    Args:
        held: the grasp. loads: rows `(force, torque / length)` [N], shape (N, 6). least: the effort to minimise.

    Raises:
        CommandError: an empty or malformed set; tensions of a hand without tendons.
    """
    from .binding import why_not

    rows = check_loads(loads)
    plans = tuple(least_effort(held, load, least) for load in rows)
    found = [plan for plan in plans if plan is not None]
    if len(found) < len(plans):
        first = next(load for load, plan in zip(rows, plans, strict=True) if plan is None)
        reason = once(lambda: why_not(held, first))
        return Actuation.with_late(lambda _: reason(), worst_torque=None, worst_tension=None, plans=plans)
    tensions = [plan.worst_tension for plan in found if plan.worst_tension is not None]
    return Actuation(max(p.worst_torque for p in found), max(tensions, default=None), plans, "")


def least_effort(held: HeldObject, load: FloatArray, least: Effort | str = Effort.TORQUE) -> HoldingForces | None:
    """Return forces that hold a load with the least effort, inside cones and limits; None when there are none.

    Args:
        held: the grasp. load: external wrench, shape (6,). least: the effort to minimise.

    Raises:
        CommandError: tensions of a hand without tendons.
    """
    if least not in list(Effort):
        raise CommandError(f"effort: expected one of {', '.join(Effort)}, got {least!r}.")
    if least == Effort.TENSION and held.drive is None:
        raise CommandError("effort: the hand has no tendons whose tension could be made small.")
    count, unit = held.jacobian.shape[0], float(np.linalg.norm(load)) or 1.0
    if count == 0:
        return None if load.any() else HoldingForces(load, np.zeros((0, held.contacts.width)), np.zeros(0))

    def build(tendons: bool) -> HoldingProgram:
        program = HoldingProgram(held, load, unit, extra=1, tendons=tendons)
        program.cone.cost[count] = 1.0
        program.keep_below(np.eye(program.cone.size)[count], least)
        program.demand_forces()
        return program

    found = solve_first(build, held, tendons=least == Effort.TENSION)
    return None if found is None else found[0]


def solve_first(
    build: Callable[[bool], HoldingProgram], held: HeldObject, *, tendons: bool = False
) -> tuple[HoldingForces, FloatArray] | None:
    """Solve a program without its tendons, and with them only where tensions for its torques are lacking, or wanted.

    Args:
        build: makes the program without or with tendons. held: the grasp. tendons: they are wanted.
    """
    found = None if tendons and held.drive is not None else build(False).solve()
    return build(True).solve() if found is None and held.drive is not None else found


class HoldingProgram:
    """Build a cone program over contact forces, `extra` unknowns and tendon tensions; forces in units of the load.

    Args:
        held: the grasp. load: external wrench, shape (6,). unit: forces are counted in this many newtons.
        extra: number of unknowns beside forces and tensions, placed after the forces.
        tendons: whether tensions within their limits are among the unknowns.
    """

    def __init__(self, held: HeldObject, load: FloatArray, unit: float, extra: int, *, tendons: bool) -> None:
        count = held.jacobian.shape[0]
        size = count + extra + (len(held.drive.t_min) if held.drive is not None and tendons else 0)
        self.held, self.load, self.unit = held, load, unit
        self.cone = ConeProgram(size, np.zeros(size))
        self.forces = np.eye(count, size)
        self.normals = self.forces[2 :: held.contacts.width]
        # Arms are centimetres: in these units torques are as large as forces.
        self.arm = float(np.abs(held.jacobian).max(initial=0.0)) or 1.0
        self.torques = held.jacobian.T @ self.forces
        self.tensions: FloatArray | None = None
        self.cone.equal(held.grasp_map @ self.forces, -load / unit)
        self.cone.at_most(self.normals / MOST_FORCE, np.ones(len(held.contacts)))
        if held.drive is not None and tendons:
            # Tensions, too, are counted so that they are as large as forces.
            drive, inner = held.drive, float(np.abs(held.drive.arms).max())
            scale = unit * self.arm / inner
            scaled = replace(drive, arms=drive.arms / inner, t_min=drive.t_min / scale, t_max=drive.t_max / scale)
            self.tensions = demand_tensions(self.cone, self.torques / self.arm, scaled, count + extra)

    def keep_below(self, worst: FloatArray, least: Effort | str) -> None:
        """Demand that no torque, or tension, exceeds the unknown that a row gives."""
        if least == Effort.TENSION and self.tensions is not None:
            self.cone.at_most(self.tensions - worst, np.zeros(len(self.tensions)))
            return
        self.cone.at_most(-worst[None], np.zeros(1))
        for sign in (1.0, -1.0):
            self.cone.at_most(sign * self.torques / self.arm - worst, np.zeros(len(self.torques)))

    def demand_forces(
        self, ends: FloatArray | None = None, changes: FloatArray | None = None, by: FloatArray | None = None
    ) -> None:
        """Demand cones and torque limits for the forces at every end, and under every change; else for them alone.

        Args:
            ends: constant forces that are added, shape (E, C * width).
            changes: forces that are added for every unit of an unknown, besides none, shape (N, C * width).
            by: the row that gives this unknown, which is not negative, shape (size,).
        """
        held, nothing = self.held, np.zeros((1, len(self.forces)))
        constant = nothing if ends is None else ends
        each = nothing if changes is None else np.vstack([nothing, changes])
        along = np.zeros(self.cone.size) if by is None else by
        demand_cones(
            self.cone,
            held.contacts,
            np.tile(self.forces + each[:, :, None] * along, (len(constant), 1, 1)),
            np.repeat(constant, len(each), axis=0),
            np.tile(hardest_changes(held.contacts, each), (len(constant), 1)),
        )
        J, torques = held.jacobian / self.arm, self.torques / self.arm
        limits = held.dofs.limits / (self.unit * self.arm)
        for sign in (1.0, -1.0):
            # The change that adds most to a torque decides.
            most = (sign * each @ J).max(axis=0)
            demand_limits(self.cone, sign * torques + most[:, None] * along, limits, sign * constant @ J)

    def solve(self) -> tuple[HoldingForces, FloatArray] | None:
        """Return the forces, balanced to rounding, and all unknowns; None when nothing satisfies the demands."""
        x = self.cone.solve()
        if x is None:
            return None
        held, contacts = self.held, self.held.contacts
        f = balanced(held.grasp_map, self.forces @ x * self.unit, -self.load)
        torques = held.torques(f)
        tensions = None if held.drive is None else held.drive.tensions(torques[list(held.drive.columns)]).tensions
        plan = HoldingForces(self.load, f.reshape(len(contacts), contacts.width), torques, tensions)
        return (plan, x) if _keeps(held, plan) else None


def _keeps(held: HeldObject, plan: HoldingForces) -> bool:
    """Say whether a plan balances its load inside cones and limits, to rounding."""
    size = max(1.0, float(np.abs(plan.forces).max(initial=0.0)))
    missed = [
        np.abs(held.grasp_map @ plan.forces.reshape(-1) + plan.load).max(),
        -held.contacts.cone_slack(plan.forces).min(initial=np.inf),
        (np.abs(plan.torques) - held.dofs.limits).max(initial=-np.inf),
    ]
    if held.drive is not None and plan.tensions is not None:
        size = max(size, float(plan.tensions.max()))
        given = held.drive.arms @ plan.tensions - plan.torques[list(held.drive.columns)]
        missed += [np.abs(given).max(), (held.drive.t_min - plan.tensions).max()]
        missed.append((plan.tensions - held.drive.t_max).max())
    return bool(max(missed) <= ALLOWED * size)
