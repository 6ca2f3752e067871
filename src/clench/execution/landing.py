"""Plan the last piece of the way: straight to all contacts simultaneously (docs/method.md section 7)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.jacobian import DegreesOfFreedom, degrees_of_freedom, hand_jacobian
from clench.models.hand.hand import Hand, JointRole
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import Contact, GraspSolution

#: Default clearance of the pregrasp [m].
CLEARANCE: Final = 0.005
#: Speed of links near the object on the last piece of the way, unless joints must be slower [m/s].
LANDING_SPEED: Final = 0.01
#: A joint turns back by at most this [rad]: for more, the path would not be near its tangent.
_FARTHEST: Final = 0.5
#: Cost of a contact that comes off faster than another, against the turning of joints [rad/m].
_UNEVEN: Final = 1e4
#: A follower that is this far from where its coupling has it does not move on a straight line [rad].
_UNCOUPLED: Final = 1e-7


def plan_landing(
    solution: GraspSolution, hand: Hand, clearance: float = CLEARANCE, resting: Collection[int] = ()
) -> FloatArray | None:
    """Return the posture from which a straight line in joint space reaches all contacts simultaneously.

    See `Landing.start`.
    """
    return Landing(solution, hand).start(clearance, resting)


class Landing:
    """Find postures from which a straight line in joint space reaches all contacts simultaneously.

    At the touch, every contact of a finger approaches at the same speed, as far as its joints allow. The rates follow
    from the Jacobian's rows along the contact normals. Fingers without contacts stay as they are.

    Args:
        solution: the solution. hand: the hand that was solved for.
    """

    def __init__(self, solution: GraspSolution, hand: Hand) -> None:
        self.hand = hand
        self._q = posture(solution.joint_angles, hand, "joint_angles")
        self._dofs = degrees_of_freedom(hand, self._q)
        self._rates: dict[tuple[int, float, tuple[int, ...]], FloatArray | None] = {}
        contacts = [c for c in solution.contacts if not c.passed]
        links = [hand.link_index(c.link) for c in contacts]
        rows = _normal_rows(solution, hand, contacts, self._q, self._dofs)
        of_finger = [[k for k, link in enumerate(links) if link in finger.links] for finger in hand.fingers]
        self._rows = [rows[np.array(own, dtype=np.intp)] for own in of_finger]

    def start(self, clearance: float, resting: Collection[int] = ()) -> FloatArray | None:
        """Return the posture where the line starts [rad], shape (J,).

        Args:
            clearance: of every contact there [m]. resting: indices of joints that stay as they are.

        Returns:
            the posture; None if the joints of a finger cannot take off all of its contacts simultaneously.
        """
        q, start = self._q, self._q.copy()
        for n, rows in enumerate(self._rows):
            if len(rows):
                rates = self._opening(n, clearance, resting)
                if rates is None:
                    return None
                start += clearance * rates
        for c in self.hand.couplings:
            joint = self.hand.joints[c.follower]
            wanted = np.clip(c.ratio * start[c.leader] + c.offset, joint.lower, joint.upper)
            if start[c.leader] != q[c.leader] and abs(start[c.follower] - wanted) > _UNCOUPLED:
                return None
        return start

    def _opening(self, number: int, clearance: float, resting: Collection[int]) -> FloatArray | None:
        """Return rates of all joints per distance [rad/m], (J,), at which a finger's contacts come off, or None.

        A joint that rests changes only the rates of its own finger, so the others are found once.
        """
        finger, dofs = self.hand.fingers[number], self._dofs
        key = number, clearance, tuple(j for j in finger.joints if j in resting)
        if key not in self._rates:
            own = [d for d, j in enumerate(dofs.joints) if j in finger.joints and j not in resting]
            closing = [d for d in own if self.hand.joints[dofs.joints[d]].role is JointRole.CLOSING]
            self._rates[key] = None
            for used in (closing, own):
                room = _room(self.hand, self._q, dofs, used, clearance)
                rates = _even_rates(self._rows[number][:, used], *room)
                if rates is not None:
                    self._rates[key] = np.asarray(dofs.motion[:, used] @ rates)
                    break
        return self._rates[key]


def _normal_rows(
    solution: GraspSolution, hand: Hand, contacts: Sequence[Contact], q: FloatArray, dofs: DegreesOfFreedom
) -> FloatArray:
    """Return the speed at which contacts come off the object per rate of the degrees of freedom, shape (C, D)."""
    if not contacts:
        return np.empty((0, len(dofs.joints)))
    T_palm_world = solution.hand_pose.inverse()
    made = make_contacts(
        T_palm_world.apply(np.array([c.position for c in contacts])),
        -np.array([c.normal for c in contacts]) @ T_palm_world.rotation.T,
        links=[hand.link_index(c.link) for c in contacts],
    )
    rows: FloatArray = -hand_jacobian(hand, q, made, dofs)[2::3]
    return rows


def _room(
    hand: Hand, q: FloatArray, dofs: DegreesOfFreedom, used: list[int], clearance: float
) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest rates that keep all joints inside their limits [rad/m], each shape (D,)."""
    low, high = np.zeros(len(used)), np.zeros(len(used))
    for k, d in enumerate(used):
        most, down, up = np.inf, -np.inf, np.inf
        for j in np.flatnonzero(dofs.motion[:, d]).tolist():
            share, joint = float(dofs.motion[j, d]) * clearance, hand.joints[j]
            ends = float(joint.lower - q[j]) / share, float(joint.upper - q[j]) / share
            most, down, up = min(most, _FARTHEST / abs(share)), max(down, min(ends)), min(up, max(ends))
        low[k], high[k] = min(0.0, max(-most, down)), max(0.0, min(most, up))
    return low, high


def _even_rates(rows: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """Return rates that take all contacts off by at least 1, as evenly as possible, turning little; None without."""
    from clench.kernels.mechanics.least_cost import least_cost

    contacts, count = rows.shape
    if not count:
        return None
    # Unknowns: the rates' positive and negative parts, and by how much the fastest contact is faster than 1.
    cost = np.concatenate([np.ones(2 * count), [_UNEVEN]])
    demands = np.zeros((2 * contacts + 2 * count, 2 * count + 1))
    demands[:contacts, :-1] = np.hstack([-rows, rows])
    demands[contacts : 2 * contacts, :-1] = np.hstack([rows, -rows])
    demands[contacts : 2 * contacts, -1] = -1.0
    demands[2 * contacts :, :-1] = np.eye(2 * count)
    most = np.concatenate([-np.ones(contacts), np.ones(contacts), high, -low])
    x = np.empty(2 * count + 1)
    if not least_cost(demands, most, cost, x):
        return None
    return x[:count] - x[count : 2 * count]
