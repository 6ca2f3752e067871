"""A grasp as mechanics sees it: contacts, grasp map, hand Jacobian, limits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.models.hand.hand import Hand

from .contacts import ContactSet
from .grasp_map import edge_wrenches, grasp_map
from .jacobian import DegreesOfFreedom, degrees_of_freedom, hand_jacobian
from .tendon_tensions import TendonDrive, tendon_drive


@dataclass(frozen=True, eq=False)
class HeldObject:
    """The input for forces and epsilon quality.

    Args:
        contacts: in one frame (the palm's where a hand holds).
        center: centre of mass of the object in the same frame [m], shape (3,).
        length: length scale: largest distance of the object's surface from the centre of mass [m].
        dofs: degrees of freedom of the hand; empty for contacts without a hand.
        jacobian: see `hand_jacobian`, shape (C * width, D).
        drive: tendons that move the joints, None where joints are driven by themselves.
    """

    contacts: ContactSet
    center: FloatArray
    length: float
    dofs: DegreesOfFreedom
    jacobian: FloatArray
    drive: TendonDrive | None = None

    __repr__ = short_repr

    @cached_property
    def grasp_map(self) -> FloatArray:
        """The grasp map G, shape (6, C * width)."""
        return grasp_map(self.contacts, self.center, self.length)

    @cached_property
    def unlimited(self) -> tuple[str, ...]:
        """Names of the degrees of freedom that contacts load, and whose torque neither joint nor tendon limits."""
        bounded = np.isfinite(self.dofs.limits)
        if self.drive is not None:
            pulling = np.where(self.drive.arms != 0.0, self.drive.t_max, 0.0)
            bounded[list(self.drive.columns)] |= np.isfinite(pulling).all(axis=1)
        loaded = (self.jacobian != 0.0).any(axis=0)
        return tuple(self.dofs.names[d] for d in np.flatnonzero(loaded & ~bounded))

    def edge_wrenches(self, edges: int) -> FloatArray:
        """Return the wrenches of the cones' edges, shape (C, N, 6)."""
        return edge_wrenches(self.contacts, self.center, self.length, edges)

    def torques(self, forces: FloatArray) -> FloatArray:
        """Return the torques with which the hand exerts contact forces, shape (D,) [Nm]."""
        return np.asarray(self.jacobian.T @ forces.reshape(-1))

    def with_friction(self, friction: FloatArray) -> HeldObject:
        """Return the grasp with other friction, shape (C,)."""
        contacts = replace(self.contacts, friction=friction)
        # Frames and grasp map know nothing of friction.
        contacts.__dict__["frames"] = self.contacts.frames
        made = replace(self, contacts=contacts)
        made.__dict__["grasp_map"] = self.grasp_map
        return made

    def without_limits(self) -> HeldObject:
        """Return the grasp with joints of unlimited torque, and no tendons."""
        made = replace(self, dofs=replace(self.dofs, limits=np.full_like(self.dofs.limits, np.inf)), drive=None)
        made.__dict__["grasp_map"] = self.grasp_map
        return made


def held_by_hand(hand: Hand, q: FloatArray, contacts: ContactSet, center: ArrayLike, length: float) -> HeldObject:
    """Return contacts of a hand as mechanics sees them.

    Args:
        hand: the hand. q: its posture [rad], shape (J,).
        contacts: in the palm frame, with links.
        center: centre of mass in the palm frame [m]. length: length scale [m].

    Raises:
        CommandError: see `grasp_map`.
    """
    dofs = degrees_of_freedom(hand, q)
    J = hand_jacobian(hand, q, contacts, dofs)
    held = HeldObject(contacts, np.asarray(center, dtype=np.float64), length, dofs, J, tendon_drive(hand, dofs))
    _ = held.grasp_map  # refuses what is malformed
    return held


def held_by_contacts(contacts: ContactSet, center: ArrayLike, length: float) -> HeldObject:
    """Return contacts that no hand's limits bind.

    Raises:
        CommandError: see `grasp_map`.
    """
    nothing = DegreesOfFreedom((), (), np.empty((0, 0)), np.empty(0))
    none = np.empty((len(contacts) * contacts.width, 0))
    held = HeldObject(contacts, np.asarray(center, dtype=np.float64), length, nothing, none)
    _ = held.grasp_map
    return held
