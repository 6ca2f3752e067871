"""Bounds of epsilon for all grasps of a batch (docs/method.md section 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.mechanics.epsilon.batch_bounds import epsilon_bounds
from clench.mechanics.grasp.contacts import pair_friction
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.objects.mass import mass_properties
from clench.solver.solution import SolutionStatus

from .batch_solver import rotations, turned
from .grasp_batch import STATUSES, GraspBatch

#: Statuses that may be a grasp: for a hand without a thumb, some fingers suffice.
HOLDS: Final = [STATUSES.index(SolutionStatus.GRASP), STATUSES.index(SolutionStatus.PARTIAL)]


@dataclass(eq=False)
class BatchEpsilon:
    """Bound the epsilon quality of many grasps of one hand and object from below.

    Args:
        hand, obj: as solved. friction: of all contacts; None: that of each link and body. torsion: torsional
            coefficient of soft fingers [m]; None: point contacts.
        center: centre of mass in the object's frame [m], shape (3,); None: that of a uniform density.
    """

    hand: Hand
    obj: GraspObject
    friction: float | None = None
    torsion: float | None = None
    center: FloatArray | None = None

    def __post_init__(self) -> None:
        """Look up the data that every grasp needs."""
        mass = mass_properties(self.obj)
        self._center, self._length = mass.center if self.center is None else self.center, mass.length
        links, bodies = range(len(self.hand.links)), self.obj.bodies
        self._mu = np.array([[self.friction or pair_friction(self.hand, k, body) for body in bodies] for k in links])
        self.graspable = np.array([body.role is BodyRole.GRASPABLE for body in bodies])

    def counted(self, batch: GraspBatch) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the grasp of every contact, and whether it counts, (C,): not opened again and no obstacle's."""
        contacts = batch.contacts
        owner = np.repeat(np.arange(len(batch)), np.diff(contacts.first))
        return owner, ~contacts.passed & self.graspable[contacts.body]

    def bounds(self, batch: GraspBatch, share: float = 1.0) -> FloatArray:
        """Return a lower bound of epsilon for every answer [N/N], shape (N,); 0 for anything but a grasp.

        The edges of the friction polyhedra are fixed in the frame of the hand. So a motion of hand and object together
        changes nothing.

        Args:
            batch: the answers. share: of the friction that counts [-].
        """
        contacts = batch.contacts
        owner, keep = self.counted(batch)
        keep = keep & np.isin(batch.status_codes, HOLDS)[owner]
        first = np.concatenate([[0], np.cumsum(np.bincount(owner[keep], minlength=len(batch)))])
        mu = share * self._mu[contacts.link[keep], contacts.body[keep]]
        rows, palms = batch.object_poses, batch.hand_poses
        to_hand, own = rotations(palms).transpose(0, 2, 1), owner[keep]
        centers = turned(rotations(rows), np.broadcast_to(self._center, (len(rows), 3))) + rows[:, 4:]
        centers = turned(to_hand, centers - palms[:, 4:])
        places = turned(to_hand[own], contacts.position[keep] - palms[own, 4:])
        normals = turned(to_hand[own], contacts.normal[keep])
        return epsilon_bounds(first, places, normals, mu, centers, self._length, self.torsion)
