"""The squeeze plan of a solution: forces, torques, angle offsets and tensions (METHOD.md section 6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clench.base.pose import FloatArray
from clench.grasp.mechanics.contacts import DEFAULT_TORSION, ContactModel
from clench.grasp.mechanics.loads import (
    GRAVITY,
    check_loads,
    check_mass,
    gravity_any_direction,
    six_pulls_and_twists,
    weight,
)
from clench.grasp.mechanics.squeeze import ENOUGH, SqueezeForces, squeeze_forces
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

from .holding import HeldSolution, hold
from .quality import DEFAULT_MASS
from .solution import GraspSolution

#: Where gravity points in the world unless told otherwise.
DOWN = (0.0, 0.0, -1.0)
#: Force of the disturbances of something without weight [N].
_LEAST_DISTURBANCE = 1e-3


@dataclass(frozen=True, eq=False)
class SqueezePlan:
    """Hold a squeeze, or why there is none.

    Args:
        feasible: whether the mass is held at all; text: a sentence that says so, or which limit binds.
        mass: [kg]. margin: disturbances are resisted up to this multiple [-].
        forces: on the object, one per contact, in the world [N], shape (C, 3); twists: torques about the inward
            normals of soft fingers [Nm], shape (C,).
        torques: by degree of freedom [Nm].
        offsets: what position servos are to be told beyond the touch, by joint, followers included [rad]; joints
            without a known gain are left out.
        tensions: of the hand's tendons [N], None without tendons.
        grasp: the contacts, friction, centre of mass and length scale that were used.
        found: the same in the frames of mechanics.
    """

    feasible: bool
    text: str
    mass: float
    margin: float
    forces: FloatArray
    twists: FloatArray
    torques: Mapping[str, float]
    offsets: Mapping[str, float]
    tensions: FloatArray | None
    grasp: HeldSolution
    found: SqueezeForces

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, `squeeze` in schema `clench.solution/1`."""
        return {
            **self.grasp.conventions(),
            "feasible": self.feasible,
            "text": self.text,
            "mass": self.mass,
            "margin": self.margin,
            "forces": self.forces.tolist(),
            "twists": self.twists.tolist(),
            "torques": dict(self.torques),
            "offsets": dict(self.offsets),
            "tensions": None if self.tensions is None else self.tensions.tolist(),
        }


def plan_squeeze(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    *,
    mass: float = DEFAULT_MASS,
    gravity: ArrayLike | None = DOWN,
    disturbances: ArrayLike | None = None,
    margin: float = ENOUGH,
    contact_model: ContactModel | str = ContactModel.POINT,
    friction: float | None = None,
    torsion: float = DEFAULT_TORSION,
    center_of_mass: ArrayLike | None = None,
) -> SqueezePlan:
    """Return the forces that hold a mass with the largest margin over a set of disturbances, inside all limits.

    Args:
        solution: the solution. hand, obj: what it was computed for.
        mass: of the object [kg].
        gravity: direction in the world; None: any direction, and the mass is held when the margin reaches 1 and no
            disturbance is left out of it.
        disturbances: rows (force [N], torque [Nm]) in the world about the centre of mass, shape (N, 6); None: the
            weight as a pull along ±x, ±y, ±z of the palm, and as a torque at the length scale about the same axes
            (with `gravity=None`: the weight in any direction).
        margin: the largest that is asked for; beyond it, torques are made small instead [-].
        contact_model, friction, torsion, center_of_mass: see `grasp_quality`.

    Raises:
        CommandError: a value out of range, an empty set of disturbances; the solution is of another hand.
    """
    check_mass(mass)
    grasp = hold(
        solution,
        hand,
        obj,
        contact_model=contact_model,
        friction=friction,
        torsion=torsion,
        center_of_mass=center_of_mass,
    )
    nominal = np.zeros((1, 6)) if gravity is None else weight(mass, grasp.palm_direction(gravity))
    # Any direction is held where the margin over the weight is 1: no less than that is looked for.
    enough = margin if gravity is not None or not margin > 0.0 else max(margin, 1.0)
    found = squeeze_forces(grasp.held, nominal, _disturbances(grasp, mass, gravity, disturbances), enough=enough)
    # The margin leaves out what no forces resist; without a direction of gravity that is the weight itself.
    held_any_way = gravity is not None or (found.margin >= 1.0 and not found.unresisted)
    feasible = found.plan is not None and held_any_way
    text = _sentence(found, mass, feasible, grasp, gravity is None)
    contacts, plan = grasp.held.contacts, found.plan
    if plan is None:
        nothing = np.zeros((0, 3))
        return SqueezePlan(False, text, mass, 0.0, nothing, np.zeros(0), {}, {}, None, grasp, found)
    local = np.einsum("cij,cj->ci", contacts.frames, plan.forces[:, :3])
    torques = dict(zip(grasp.held.dofs.names, plan.torques.tolist(), strict=True))
    return SqueezePlan(
        feasible=feasible,
        text=text,
        mass=mass,
        margin=found.margin,
        forces=local @ grasp.T_world_palm.rotation.T,
        twists=plan.forces[:, 3] if contacts.width == 4 else np.zeros(len(contacts)),
        torques=torques,
        offsets=angle_offsets(hand, grasp, plan.torques),
        tensions=plan.tensions,
        grasp=grasp,
        found=found,
    )


def angle_offsets(hand: Hand, grasp: HeldSolution, torques: FloatArray) -> dict[str, float]:
    """Return by how much position servos are to be told more than the touch, `tau / k_p`, by joint [rad].

    Args:
        hand: the hand. grasp: its contacts. torques: of the degrees of freedom [Nm], shape (D,).
    """
    dofs = grasp.held.dofs
    offsets: dict[str, float] = {}
    for d, leader in enumerate(dofs.joints):
        stiffness = hand.joints[leader].stiffness
        if stiffness:
            moved = np.flatnonzero(dofs.motion[:, d])
            offsets |= {hand.joints[j].name: float(dofs.motion[j, d] * torques[d] / stiffness) for j in moved}
    return offsets


def _disturbances(grasp: HeldSolution, mass: float, gravity: ArrayLike | None, given: ArrayLike | None) -> FloatArray:
    """Return the disturbances in the palm frame, torques over the length scale, shape (N, 6)."""
    if given is not None:
        rows = check_loads(given)
        R = grasp.T_world_palm.rotation
        return np.hstack([rows[:, :3] @ R, rows[:, 3:] @ R / grasp.held.length])
    if gravity is None:
        return gravity_any_direction(max(mass, _LEAST_DISTURBANCE / GRAVITY))
    return six_pulls_and_twists(max(mass * GRAVITY, _LEAST_DISTURBANCE))


def _sentence(found: SqueezeForces, mass: float, feasible: bool, grasp: HeldSolution, any_way: bool) -> str:
    how = "in every direction of gravity" if any_way else "under gravity"
    if found.plan is None:
        return f"No squeeze holds {mass:.3g} kg {how}. {found.reason}"
    left_out = f"{len(found.unresisted)} of the disturbances cannot be resisted by any forces of these contacts."
    if not feasible and found.unresisted:
        return f"No squeeze holds {mass:.3g} kg {how}: {left_out}"
    if not feasible:
        return f"No squeeze holds {mass:.3g} kg {how}: only {found.margin:.3g} times that mass."
    text = f"Holds {mass:.3g} kg {how}, with disturbances up to {found.margin:.3g} times the weight."
    return f"{text} {left_out}" if found.unresisted else text
