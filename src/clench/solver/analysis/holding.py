"""A solution as mechanics sees it: its contacts with friction, the object's centre of mass, the hand's Jacobian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clench.core.argument_types import check_type
from clench.core.pose import FloatArray, Pose, checked_vector
from clench.core.showing.short_repr import short_repr
from clench.mechanics.grasp.contacts import (
    DEFAULT_TORSION,
    ContactModel,
    check_friction,
    friction_range,
    make_contacts,
    pair_friction,
    without_repeats,
)
from clench.mechanics.grasp.held import HeldObject, held_by_hand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.objects.mass import mass_properties
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import Contact, GraspSolution


@dataclass(frozen=True, eq=False)
class HeldSolution:
    """The contacts, frames and centre of mass of a solution, as mechanics needs them.

    Args:
        held: contacts in the palm frame. contacts: the solution's contacts, in the same order, each place once.
        T_world_palm: where the palm is. model: of the contacts. center: centre of mass in the world [m].
    """

    held: HeldObject
    contacts: tuple[Contact, ...]
    T_world_palm: Pose
    model: ContactModel
    center: FloatArray

    __repr__ = short_repr

    def world_wrench(self, wrench: FloatArray) -> dict[str, list[float]]:
        """Return a wrench `(force, torque / length)` of the palm frame as force [N] and torque [Nm] in the world."""
        R = self.T_world_palm.rotation
        return {"force": (R @ wrench[:3]).tolist(), "torque": (R @ wrench[3:] * self.held.length).tolist()}

    def palm_direction(self, direction: ArrayLike) -> FloatArray:
        """Return a direction of the world in the palm frame, shape (3,)."""
        return np.asarray(self.T_world_palm.rotation.T @ checked_vector(direction, 3, "gravity", "[x, y, z]"))

    def conventions(self) -> dict[str, Any]:
        """Return the settings that force numbers depend on, as plain values."""
        torsion = self.held.contacts.torsion
        return {
            "contact_model": self.model.value,
            "contacts": [{"finger": c.finger, "link": c.link} for c in self.contacts],
            "friction": self.held.contacts.friction.tolist(),
            "torsion": None if torsion is None else torsion.tolist(),
            "center_of_mass": self.center.tolist(),
            "length_scale": self.held.length,
        }


def hold(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    *,
    contact_model: ContactModel | str = ContactModel.POINT,
    friction: float | tuple[float, float] | None = None,
    torsion: float = DEFAULT_TORSION,
    center_of_mass: ArrayLike | None = None,
) -> HeldSolution:
    """Return a solution as mechanics sees it; contacts with obstacles, passed ones and repeated ones are left out.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for.
        contact_model: see `ContactModel`. friction: of all contacts [-]; None takes that of links and object.
        torsion: torsional coefficient of soft fingers [m].
        center_of_mass: in the object's frame [m]; None is that of a uniform density.

    Raises:
        CommandError: the solution is of another hand, friction not above 0, a malformed centre of mass.
        UnknownNameError: a contact's link is not in the hand.
    """
    check_type(solution, GraspSolution, "solution")
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    lowest = friction_range(friction)[0] if isinstance(friction, tuple) else friction
    if lowest is not None:
        check_friction(lowest)
    q = posture(solution.joint_angles, hand, "joint_angles")
    bodies = {body.name: body for body in obj.bodies if body.role is BodyRole.GRASPABLE}
    still = [c for c in solution.contacts if not c.passed and c.body in bodies]
    touching = [hand.link_index(c.link) for c in still]
    kept = without_repeats(touching, [c.position for c in still], [c.normal for c in still])
    contacts, links = tuple(still[i] for i in kept), [touching[i] for i in kept]
    pairs = [pair_friction(hand, link, bodies[c.body]) for link, c in zip(links, contacts, strict=True)]
    T_palm_world = solution.hand_pose.inverse()
    made = make_contacts(
        [T_palm_world.apply(c.position) for c in contacts],
        [-T_palm_world.rotation @ c.normal for c in contacts],
        pairs if lowest is None else lowest,
        model=contact_model,
        torsion=torsion,
        links=links,
    )
    mass = mass_properties(obj)
    own = mass.center if center_of_mass is None else center_of_mass
    center = solution.object_pose.apply(checked_vector(own, 3, "center_of_mass", "[x, y, z] in metres"))
    held = held_by_hand(hand, q, made, T_palm_world.apply(center), mass.length)
    return HeldSolution(held, contacts, solution.hand_pose, ContactModel(contact_model), center)
