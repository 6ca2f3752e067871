"""Bring proposed hands up to the object, and reject those that are stopped too early (docs/method.md section 9)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from clench.closing.collision.depths import link_mesh_arrays, object_mesh
from clench.closing.collision.packed_object import PackedObject
from clench.closing.link_bodies import link_bodies
from clench.core.pose import FloatArray
from clench.core.threads import share_out
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole

from .proposals import DEEP, Arm, Proposals

#: A hand stops this far before its first touch [m].
OFF = 0.001
#: A hand that is stopped farther than this before its place is of no use [m].
SHORT = 0.02


@dataclass(frozen=True, eq=False)
class Approached:
    """Proposals that arrive, and those that are stopped, all with the palm where it stops.

    Args:
        proposals: that arrive. stopped: by the object before their place. obstacle: by an obstacle.
    """

    proposals: Proposals
    stopped: Proposals
    obstacle: Proposals


@dataclass(eq=False)
class Approach:
    """Bring a hand at any of its preshapes up to an object along the palm's normal.

    Args:
        hand: the hand. postures: the preshapes, shape (K, J) [rad]. packed: the object with its obstacles.
    """

    hand: Hand
    postures: FloatArray
    packed: PackedObject

    def __post_init__(self) -> None:
        """Pose the hand at every preshape."""
        self._poses = np.ascontiguousarray(poses_at(self.hand, self.postures)[:, :, :3])
        self._obstacle = np.array([role is not BodyRole.GRASPABLE for role in self.packed.body_roles])

    def bring_up(self, proposals: Proposals, arms: tuple[Arm, ...], threads: int) -> Approached:
        """Return the proposals that arrive, each at its place or where the object stops the hand shortly before."""
        from clench.kernels.mechanics.placing import Placed, Target, bring_up

        count, packed = len(proposals), self.packed
        shape = np.array([arm.shape for arm in arms], dtype=np.int64)[proposals.arm]
        out = Placed(np.empty(count), np.empty(count, dtype=np.int64))
        T = np.ascontiguousarray(proposals.T_object_palm[:, :3])
        ball = np.array([*packed.center, packed.radius])
        meshes, hulls = link_mesh_arrays(self.hand), link_bodies(self.hand, self.hand.default_source).hulls
        target = Target(object_mesh(packed), packed.bodies, packed.element_body, ball)
        normal = np.ascontiguousarray(self.hand.palm_normal)

        most = np.where(np.array([arm.deep for arm in arms])[proposals.arm], DEEP, 0.0)
        ahead = most + OFF

        def run(some: slice) -> None:
            part = Placed(out.travel[some], out.body[some])
            bring_up(meshes, hulls, self._poses, shape[some], T[some], normal, target, ahead[some], SHORT - OFF, part)

        ends = np.linspace(0, count, min(count, 4 * threads) + 1).astype(int).tolist()
        share_out(run, [slice(a, b) for a, b in pairwise(ends)], threads)
        go = np.minimum(out.travel - OFF, most)
        obstacle = (out.body >= 0) & self._obstacle[out.body] & (go < most)
        arrives = (go >= -SHORT) & ~obstacle
        moved = proposals.T_object_palm.copy()
        moved[:, :3, 3] += go[:, None] * (moved[:, :3, :3] @ self.hand.palm_normal)
        placed = Proposals(proposals.arm, moved, proposals.center)
        return Approached(placed.taken(arrives), placed.taken(~arrives & ~obstacle), placed.taken(obstacle))
