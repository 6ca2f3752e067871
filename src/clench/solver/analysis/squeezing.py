"""The squeeze plan of a solution: forces, torques, angle offsets and tensions (docs/method.md section 6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clench.core.defaults import (
    FRICTION_RESERVE,
    LOAD_RESERVE,
    LOSS_RESERVE,
    MASS,
    MOST_FORCE_OF_LIGHT,
    MOST_FORCE_PER_WEIGHT,
)
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import described
from clench.mechanics.forces.squeeze import SqueezeForces, squeeze_forces
from clench.mechanics.grasp.contacts import DEFAULT_TORSION, ContactModel
from clench.mechanics.grasp.loads import (
    GRAVITY,
    check_loads,
    gravity_any_direction,
    mass_range,
    six_pulls_and_twists,
    weight,
)
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

from .holding import HeldSolution, hold

#: Default direction of gravity in the world.
DOWN = (0.0, 0.0, -1.0)
#: Force of the disturbances of something without weight [N].
_LEAST_DISTURBANCE = 1e-3
#: Share of a mass that is worth a number: a smaller one is a rounded zero.
_LEAST_SHARE = 0.001

#: A sentence names so many joints; of more, it names two.
_FEW_NAMES = 3


@dataclass(frozen=True, eq=False)
class SqueezePlan:
    """A plan of forces, torques and offsets that holds a mass, or the reason why there is none.

    Args:
        feasible: whether every mass is held at all.
        mass: the heaviest that is planned for [kg]. margin: disturbances are resisted up to this multiple [-].
        lightest: the lightest mass that is planned for [kg]. any_direction: gravity may point anywhere.
        forces: on the object, one per contact, in the world [N], shape (C, 3). twists: torques about the inward normals
            of soft fingers [Nm], shape (C,).
        torques: by degree of freedom [Nm].
        offsets: target of each position servo beyond the touch, by joint, followers included [rad]. Joints without a
            known gain are left out.
        tensions: of the hand's tendons [N], None without tendons.
        grasp: the contacts, friction, centre of mass and length scale that were used.
        found: the plan as it was computed, with forces in the frames of the contacts.
    """

    feasible: bool
    mass: float
    margin: float
    forces: FloatArray
    twists: FloatArray
    torques: Mapping[str, float]
    offsets: Mapping[str, float]
    tensions: FloatArray | None
    grasp: HeldSolution
    found: SqueezeForces
    lightest: float
    any_direction: bool

    def __repr__(self) -> str:
        return described(
            self, feasible=self.feasible, text=self.text, mass=self.mass, margin=self.margin, torques=self.torques
        )

    @property
    def text(self) -> str:
        """Sentences that say what is held, or which limit binds; that limit is looked for when it is first read."""
        said = _sentence(self.found, (self.lightest, self.mass), self.feasible, self.any_direction)
        return f"{said} {without_limits(self.unlimited)}".rstrip() if self.found.plan is not None else said

    @property
    def unlimited(self) -> tuple[str, ...]:
        """Names of the loaded degrees of freedom whose torque neither an effort limit nor a tendon limits."""
        return self.grasp.held.unlimited

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, `squeeze` in schema `clench.solution/1`."""
        return {
            **self.grasp.conventions(),
            "feasible": self.feasible,
            "text": self.text,
            "mass": self.mass,
            "mass_range": [self.lightest, self.mass],
            "any_direction": self.any_direction,
            "margin": self.margin,
            "friction_reserve": self.found.reserve,
            "joint_friction_loss": self.found.loss,
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
    mass: float | tuple[float, float] = MASS,
    gravity: ArrayLike | None = DOWN,
    disturbances: ArrayLike | None = None,
    margin: float = LOAD_RESERVE,
    contact_model: ContactModel | str = ContactModel.POINT,
    friction: float | tuple[float, float] | None = None,
    torsion: float = DEFAULT_TORSION,
    center_of_mass: ArrayLike | None = None,
    reserve: float = FRICTION_RESERVE,
) -> SqueezePlan:
    """Plan the forces that hold an object with the largest margin over a set of disturbances, inside all limits.

    Mass and friction may be ranges (least, largest): the plan holds all of them. A number is a range of one value.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for.
        mass: of the object [kg].
        gravity: direction in the world. None: any direction; the mass is held when the margin reaches 1 and the margin
            covers every disturbance.
        disturbances: rows (force [N], torque [Nm]) in the world about the centre of mass, shape (N, 6). None: the
            largest weight as a pull along ±x, ±y, ±z of the palm, and as a torque at the length scale about the same
            axes. With `gravity=None` the weight acts in any direction and adds to given disturbances.
        margin: a margin that suffices; once it is reached, the plan makes the torques small instead [-].
        contact_model, friction, torsion, center_of_mass: see `grasp_quality`.
        reserve: part of the lowest friction that the plan counts on, where the mass can be held so [-].

    Raises:
        CommandError: a value out of range, an empty set of disturbances; the solution is of another hand.
    """
    masses = mass_range(mass)
    any_direction = gravity is None
    grasp = hold(
        solution,
        hand,
        obj,
        contact_model=contact_model,
        friction=friction,
        torsion=torsion,
        center_of_mass=center_of_mass,
    )
    ends = np.zeros((2, 6))
    if gravity is not None:
        ends = np.vstack([weight(m, grasp.palm_direction(gravity)) for m in masses])
    found = squeeze_forces(
        grasp.held,
        ends.mean(axis=0),
        _disturbances(grasp, masses[1], gravity, disturbances),
        # Any direction is held where the margin over the weight is 1: no less than that is looked for.
        enough=margin if not any_direction or not margin > 0.0 else max(margin, 1.0),
        needed=1.0 if any_direction else 0.0,
        spread=None if (ends[0] == ends[1]).all() else 0.5 * (ends[1] - ends[0]),
        reserve=reserve,
        most_force=max(MOST_FORCE_PER_WEIGHT * masses[1] * GRAVITY, MOST_FORCE_OF_LIGHT),
    )
    # The margin leaves out loads that no contact forces can balance. Without a direction of gravity, the weight is such
    # a load.
    held_any_way = not any_direction or (found.margin >= 1.0 and not found.unresisted)
    feasible = found.plan is not None and held_any_way
    contacts, plan = grasp.held.contacts, found.plan
    nothing = plan is None
    forces = np.zeros((0, 3)) if plan is None else np.einsum("cij,cj->ci", contacts.frames, plan.forces[:, :3])
    twists = np.zeros(len(forces)) if plan is None or contacts.width == 3 else plan.forces[:, 3]
    torques = np.zeros(0) if plan is None else plan.torques
    return SqueezePlan(
        feasible=feasible,
        mass=masses[1],
        margin=found.margin,
        forces=forces @ grasp.T_world_palm.rotation.T,
        twists=twists,
        torques={} if nothing else dict(zip(grasp.held.dofs.names, torques.tolist(), strict=True)),
        offsets={} if nothing else angle_offsets(hand, grasp, torques),
        tensions=None if plan is None else plan.tensions,
        grasp=grasp,
        found=found,
        lightest=masses[0],
        any_direction=any_direction,
    )


def angle_offsets(hand: Hand, grasp: HeldSolution, torques: FloatArray) -> dict[str, float]:
    """Return the target offset of position servos beyond the touch, `tau / k_p`, by joint [rad].

    A servo that pulls a fixed tendon gives each of its joints a share of the tendon's target: see `Joint.stiffness`.

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


def without_limits(names: Sequence[str]) -> str:
    """Return a sentence about joints whose torque nothing limits; empty without any."""
    if not names:
        return ""
    shown = 2 if len(names) > _FEW_NAMES else len(names)
    others = f" and {len(names) - shown} other joints" if shown < len(names) else ""
    listed = ", ".join(f"'{name}'" for name in names[:shown])
    return f"Torques are without limits, since the hand has no effort limits of {listed}{others}."


def _disturbances(grasp: HeldSolution, mass: float, gravity: ArrayLike | None, given: ArrayLike | None) -> FloatArray:
    """Return the disturbances in the palm frame, torques over the length scale, shape (N, 6)."""
    nothing = max(mass, _LEAST_DISTURBANCE / GRAVITY)
    if given is not None:
        rows = check_loads(given)
        R = grasp.T_world_palm.rotation
        asked = np.hstack([rows[:, :3] @ R, rows[:, 3:] @ R / grasp.held.length])
        if gravity is not None:
            return asked
        # Without a direction, the weight is no load of its own: it adds to every disturbance in each direction.
        either = np.vstack([np.zeros((1, 6)), asked])
        summed: FloatArray = (gravity_any_direction(nothing)[:, None] + either).reshape(-1, 6)
        return summed
    if gravity is None:
        return gravity_any_direction(nothing)
    return six_pulls_and_twists(max(mass * GRAVITY, _LEAST_DISTURBANCE))


def _sentence(found: SqueezeForces, masses: tuple[float, float], feasible: bool, any_direction: bool) -> str:
    which = f"{masses[1]:.3g} kg" if masses[0] == masses[1] else f"{masses[0]:.3g} to {masses[1]:.3g} kg"
    held = f"{which} {'in every direction of gravity' if any_direction else 'under gravity'}"
    if found.plan is None:
        return f"No squeeze holds {held}. {found.reason}"
    left_out = f"{len(found.unresisted)} of the disturbances cannot be resisted by any forces of these contacts."
    if not feasible and found.unresisted:
        return f"No squeeze holds {held}: {left_out}"
    if not feasible:
        most = f"only {found.margin:.3g} times" if found.margin >= _LEAST_SHARE else f"not even {_LEAST_SHARE:g} times"
        return f"No squeeze holds {held}: {most} that mass."
    friction = f"{100 * found.reserve:.3g} % of the friction" if found.reserve < 1.0 else "all of the friction"
    text = f"Holds {held}, with disturbances up to {found.margin:.3g} times the weight, and counts on {friction}."
    if found.loss > (1.0 + 1e-6) / LOSS_RESERVE:
        text += f" Friction in the joints takes up to {100 * found.loss:.2g} % of the torques of a finger."
    return f"{text} {left_out}" if found.unresisted else text
