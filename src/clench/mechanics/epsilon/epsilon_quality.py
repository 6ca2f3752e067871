"""Epsilon quality of a held object: epsilon and volume, within torque limits, and a fast lower bound of each epsilon.

Polyhedra inside the friction cones replace the cones, so every number is a lower bound. With N edges, the friction is
too small by at most a factor cos(pi / N).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import ContactSet, edge_directions
from clench.mechanics.grasp.held import HeldObject

from .wrench_space import Ball, WrenchNorm, epsilon_l1, epsilon_linf, largest_ball, spanned_dimensions

#: Default number of edges of the polyhedra inside the friction cones [-].
EDGES: Final = 8
#: Largest normal force of a contact within torque limits [N]; binds only where joints have none, or stand still.
MOST_NORMAL_FORCE: Final = 1e3
#: Rounds of reweighting of the fast bound [-].
ROUNDS = 3
#: Accuracy of the radius within torque limits, as a fraction of the largest wrench [-].
_LIMITED_ACCURACY = 1e-7
_LIMITED_BATCH = 6


def epsilon(held: HeldObject, norm: WrenchNorm | str = WrenchNorm.L1, edges: int = EDGES) -> Ball:
    """Return the Ferrari–Canny ball of a grasp: `radius` is epsilon [N per N of normal force].

    Args:
        held: the grasp. norm: see `WrenchNorm`. edges: of the friction cones.

    Raises:
        CommandError: fewer than 3 edges, no such norm.
    """
    if norm not in list(WrenchNorm):
        raise CommandError(f"norm: expected one of {', '.join(WrenchNorm)}, got {norm!r}.")
    if not len(held.contacts):
        return Ball(0.0, None)
    wrenches = held.edge_wrenches(edges)
    return epsilon_l1(wrenches) if norm == WrenchNorm.L1 else epsilon_linf(wrenches)


def epsilon_within_torques(held: HeldObject, edges: int = EDGES) -> Ball:
    """Return the largest ball of wrenches [N] that contact forces resist within the torque limits of the hand.

    The set is that of all `G f` with forces inside the cones and `|J^T f| <= limits`; its support is a linear program.
    Contact forces are bounded by `MOST_NORMAL_FORCE`, too.
    """
    if not len(held.contacts) or spanned_dimensions(held.grasp_map.T) < 6:
        return Ball(0.0, None)
    programs = _LimitedWrenches.of(held, edges)
    return largest_ball(programs.support, held.grasp_map.T, _LIMITED_ACCURACY, _LIMITED_BATCH)


def epsilon_bound(held: HeldObject, norm: WrenchNorm | str | None = WrenchNorm.L1, edges: int = EDGES) -> float:
    """Return a lower bound of `epsilon`, or with norm None of `epsilon_within_torques`, in a fraction of the time [N].

    Forces answer wrenches affinely, `f = s f0 + K w`. A bound of 0 means that the search found no such answer, although
    one may exist.
    """
    from clench.kernels.mechanics.wrench_bound import resisted_ball

    if not len(held.contacts):
        return 0.0
    caps, most = _caps(held, norm)
    contacts = held.contacts
    reach = np.ones((len(contacts), contacts.width))
    reach[:, :2], reach[:, 3:] = contacts.reach[:, :2], contacts.reach[:, 2:]
    generators, faces = contacts.cone_edges(edges), cone_faces(contacts, edges)
    return float(resisted_ball(held.grasp_map, generators, faces, reach, caps, most, ROUNDS))


def cone_faces(contacts: ContactSet, edges: int) -> FloatArray:
    """Return inward normals of the faces of the polyhedra of `ContactSet.cone_edges`, shape (C, F, width)."""
    inner = contacts.friction * np.cos(np.pi / edges)
    faces = np.zeros((len(contacts), edges, contacts.width))
    faces[:, :, :2] = edge_directions(edges, 0.5) / -inner[:, None, None]
    faces[:, :, 2] = 1.0
    if contacts.torsion is None:
        return faces
    turning = np.zeros_like(faces)
    turning[:, :, 3] = 1.0 / contacts.torsion[:, None]
    return np.concatenate([faces + turning, faces - turning], axis=1)


def _caps(held: HeldObject, norm: WrenchNorm | str | None) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the forces: rows c with `|c f| <= most`."""
    contacts = held.contacts
    if norm == WrenchNorm.L1:
        together = np.zeros((1, len(contacts) * contacts.width))
        together[0, 2 :: contacts.width] = 1.0
        return together, np.ones(1)
    normal = np.eye(len(contacts) * contacts.width)[2 :: contacts.width]
    if norm == WrenchNorm.LINF:
        return normal, np.ones(len(contacts))
    limits = held.dofs.limits
    finite = np.isfinite(limits)
    rows = np.vstack([normal, held.jacobian.T[finite]])
    return rows, np.concatenate([np.full(len(contacts), MOST_NORMAL_FORCE), limits[finite]])


@dataclass(frozen=True, eq=False)
class _LimitedWrenches:
    """The linear program whose optimum along a direction is the support of the limited wrench space.

    Args:
        wrenches: of the cones' edges, shape (C * N, 6). rows, most: bounds of the edges' shares.
    """

    wrenches: FloatArray
    rows: FloatArray
    most: FloatArray

    @classmethod
    def of(cls, held: HeldObject, edges: int) -> _LimitedWrenches:
        contacts = held.contacts
        generators = contacts.cone_edges(edges)
        each = generators.shape[1]
        shares = np.repeat(np.eye(len(contacts)), each, axis=1)
        J = held.jacobian.reshape(len(contacts), contacts.width, -1)
        torques = np.einsum("cew,cwd->dce", generators, J).reshape(J.shape[2], -1)
        finite = np.isfinite(held.dofs.limits)
        limits = held.dofs.limits[finite]
        return cls(
            wrenches=held.edge_wrenches(edges).reshape(-1, 6),
            rows=np.vstack([shares, torques[finite], -torques[finite]]),
            most=np.concatenate([np.full(len(contacts), MOST_NORMAL_FORCE), limits, limits]),
        )

    def support(self, directions: FloatArray) -> FloatArray:
        """Return the wrenches that reach farthest along directions, shape (M, 6)."""
        from scipy.optimize import linprog

        found = np.empty_like(directions)
        for k, direction in enumerate(directions):
            answer = linprog(-self.wrenches @ direction, A_ub=self.rows, b_ub=self.most, method="highs-ds")
            found[k] = np.asarray(answer.x) @ self.wrenches
        return found
