"""Plan the last piece of the way: straight to all contacts simultaneously (docs/method.md section 7)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.jacobian import DegreesOfFreedom, degrees_of_freedom, hand_jacobian
from clench.models.hand.hand import Finger, Hand, JointRole
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

    At the touch, every contact of a finger approaches at the same speed, as far as its joints allow. The rates follow
    from the Jacobian's rows along the contact normals. Fingers without contacts stay as they are.

    Args:
        solution: the solution. hand: the hand that was solved for. clearance: of every contact at the start [m].
        resting: indices of joints that stay as they are.

    Returns:
        joint angles [rad], shape (J,); None if the joints of a finger cannot take off all of its contacts
            simultaneously.
    """
    q = posture(solution.joint_angles, hand, "joint_angles")
    dofs = degrees_of_freedom(hand, q)
    start = q.copy()
    for finger in hand.fingers:
        contacts = [c for c in solution.contacts if not c.passed and hand.link_index(c.link) in finger.links]
        if contacts:
            rates = _opening(solution, hand, finger, contacts, q, (dofs, resting), clearance)
            if rates is None:
                return None
            start += clearance * rates
    for c in hand.couplings:
        wanted = np.clip(
            c.ratio * start[c.leader] + c.offset, hand.joints[c.follower].lower, hand.joints[c.follower].upper
        )
        if start[c.leader] != q[c.leader] and abs(start[c.follower] - wanted) > _UNCOUPLED:
            return None
    return start


def _opening(
    solution: GraspSolution,
    hand: Hand,
    finger: Finger,
    contacts: Sequence[Contact],
    q: FloatArray,
    free: tuple[DegreesOfFreedom, Collection[int]],
    clearance: float,
) -> FloatArray | None:
    """Return rates of all joints per distance [rad/m], shape (J,), at which a finger's contacts come off, or None."""
    dofs, resting = free
    rows = _normal_rows(solution, hand, contacts, q, dofs)
    own = [d for d, j in enumerate(dofs.joints) if j in finger.joints and j not in resting]
    closing = [d for d in own if hand.joints[dofs.joints[d]].role is JointRole.CLOSING]
    for used in (closing, own):
        rates = _even_rates(rows[:, used], *_room(hand, q, dofs, used, clearance))
        if rates is not None:
            return np.asarray(dofs.motion[:, used] @ rates)
    return None


def _normal_rows(
    solution: GraspSolution, hand: Hand, contacts: Sequence[Contact], q: FloatArray, dofs: DegreesOfFreedom
) -> FloatArray:
    """Return the speed at which contacts come off the object per rate of the degrees of freedom, shape (C, D)."""
    T_palm_world = solution.hand_pose.inverse()
    made = make_contacts(
        [T_palm_world.apply(c.position) for c in contacts],
        [-T_palm_world.rotation @ c.normal for c in contacts],
        links=[hand.link_index(c.link) for c in contacts],
    )
    rows: FloatArray = -hand_jacobian(hand, q, made, dofs)[2::3]
    return rows


def _room(
    hand: Hand, q: FloatArray, dofs: DegreesOfFreedom, used: list[int], clearance: float
) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest rates that keep all joints inside their limits [rad/m], each shape (D,)."""
    low, high = [], []
    for d in used:
        moved = np.flatnonzero(dofs.motion[:, d])
        share = dofs.motion[moved, d] * clearance
        ends = np.array([[hand.joints[j].lower - q[j], hand.joints[j].upper - q[j]] for j in moved]) / share[:, None]
        most = _FARTHEST / float(np.abs(share).max())
        low.append(min(0.0, max(-most, float(ends.min(axis=1).max()))))
        high.append(max(0.0, min(most, float(ends.max(axis=1).min()))))
    return np.array(low), np.array(high)


def _even_rates(rows: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """Return rates that take all contacts off by at least 1, as evenly as possible, turning little; None without."""
    from scipy.optimize import linprog

    contacts, count = rows.shape
    if not count:
        return None
    # Unknowns: rates, their magnitudes, and by how much the fastest contact is faster than 1.
    cost = np.concatenate([np.zeros(count), np.ones(count), [_UNEVEN]])
    eye, none = np.eye(count), np.zeros((contacts, count))
    A = np.block(
        [
            [-rows, none, np.zeros((contacts, 1))],
            [rows, none, -np.ones((contacts, 1))],
            [eye, -eye, np.zeros((count, 1))],
            [-eye, -eye, np.zeros((count, 1))],
        ]
    )
    b = np.concatenate([-np.ones(contacts), np.ones(contacts), np.zeros(2 * count)])
    bounds = [*zip(low, high, strict=True), *[(0.0, None)] * (count + 1)]
    found = linprog(cost, A_ub=A, b_ub=b, bounds=bounds, method="highs")
    return None if found.x is None else np.asarray(found.x[:count])
