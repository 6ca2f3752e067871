"""Second-order cone programs over contact forces, solved by Clarabel (interior point), and balanced afterwards.

Forces that are sent to a hand are planned with the round friction cones. Polyhedra inside them are used where many
programs or hulls are needed: for epsilon, volume and the fast bound.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import ContactSet
from clench.mechanics.grasp.tendon_tensions import TendonDrive

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

#: Accuracy asked of the solver, relative and absolute [-].
_ACCURACY = 1e-10
#: Step lengths towards the boundary. Shorter steps follow if the solver finds neither forces nor a proof that none
#: exist; near the limits about one program in a hundred cycles [-].
_STEPS = (0.99, 0.9)
#: Weight of the squared forces beside the cost: among equally good ones the smallest are taken [-].
_SMALLEST = 1e-9
#: Cones and limits are narrowed by this fraction, so that balancing afterwards stays inside them [-].
_INSIDE = 1e-8


@dataclass
class ConeProgram:
    """Collect a program over `size` unknowns: minimise `cost x + small |x|²` under the added constraints.

    Args:
        size: number of unknowns. cost: shape (size,).
    """

    size: int
    cost: FloatArray
    _equal: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    _most: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    _cones: list[tuple[FloatArray, FloatArray, int]] = field(default_factory=list)

    def equal(self, rows: FloatArray, values: FloatArray) -> None:
        """Demand `rows x = values`."""
        self._equal.append((rows, values))

    def at_most(self, rows: FloatArray, values: FloatArray) -> None:
        """Demand `rows x <= values`; infinite values demand nothing."""
        finite = np.isfinite(values)
        if finite.any():
            self._most.append((rows[finite], values[finite]))

    def inside_cones(self, rows: FloatArray, values: FloatArray, width: int) -> None:
        """Demand, of every `width` entries of `rows x + values`, that the first is at least the norm of the others."""
        self._cones.append((rows, values, width))

    def solve(self) -> FloatArray | None:
        """Return the best x, or None where nothing satisfies the demands."""
        import clarabel

        blocks = [
            *((rows, values) for rows, values in self._equal),
            *((rows, values) for rows, values in self._most),
            *((-rows, values) for rows, values, _ in self._cones),
        ]
        cones: list[Any] = []
        if self._equal:
            cones.append(clarabel.ZeroConeT(sum(len(v) for _, v in self._equal)))
        if self._most:
            cones.append(clarabel.NonnegativeConeT(sum(len(v) for _, v in self._most)))
        for _, values, width in self._cones:
            cones += [clarabel.SecondOrderConeT(width)] * (len(values) // width)
        A = _columns(np.vstack([rows for rows, _ in blocks]))
        b = np.concatenate([values for _, values in blocks])
        P = _small_squares(self.size)
        status = clarabel.SolverStatus
        for step in _STEPS:
            answer = clarabel.DefaultSolver(P, self.cost, A, b, cones, _settings(clarabel, step)).solve()
            if answer.status in (status.Solved, status.AlmostSolved):
                return np.array(answer.x)
            if answer.status in (status.PrimalInfeasible, status.AlmostPrimalInfeasible):
                return None
        return None


def demand_cones(
    program: ConeProgram, contacts: ContactSet, forces: FloatArray, extra: FloatArray, needed: NDArray[np.bool_]
) -> None:
    """Demand that contact forces lie inside their friction cones, in M cases.

    Args:
        program: to add to. contacts: C of them.
        forces: rows that give all force components from the unknowns, shape (1 or M, C * width, size).
        extra: added to them, shape (M, C * width). needed: which contacts matter in which case, shape (M, C).
    """
    width, cases = contacts.width, (len(extra), len(contacts), contacts.width)
    scale = _cone_scale(contacts)
    order = [2, 0, 1, 3][:width]
    rows = np.broadcast_to(forces.reshape(len(forces), *cases[1:], -1), (*cases, program.size))[needed]
    scales = np.broadcast_to(scale, cases)[needed]
    rows = (rows * scales[:, :, None])[:, order]
    values = (extra.reshape(cases)[needed] * scales)[:, order]
    program.inside_cones(rows.reshape(-1, program.size), values.reshape(-1), width)


def hardest_changes(contacts: ContactSet, changes: FloatArray) -> NDArray[np.bool_]:
    """Return which changes of the forces may take a contact out of its cone first, shape (N, C).

    Where a change differs from another one by a force inside the cone, forces that survive the other one survive it.

    Args:
        contacts: C of them. changes: shape (N, C * width).
    """
    count = len(changes)
    each = (changes.reshape(count, len(contacts), contacts.width) * _cone_scale(contacts)).transpose(1, 0, 2)
    between = each[:, :, None] - each[:, None]  # of a change (second axis) from another one (third axis)
    leaning = np.concatenate([between[..., :2], between[..., 3:]], axis=-1)
    easier = between[..., 2] >= np.sqrt((leaning * leaning).sum(axis=-1))
    # Of changes that are equal, the first one counts.
    easier &= ~easier.transpose(0, 2, 1) | (np.arange(count)[:, None] > np.arange(count))
    return np.asarray(~easier.any(axis=2).T)


def _cone_scale(contacts: ContactSet) -> FloatArray:
    """Return factors of the forces that make the cones, a little narrowed, round and of half angle 45°, (C, width)."""
    scale = np.ones((len(contacts), contacts.width))
    scale[:, :2] = 1.0 / contacts.reach[:, :2]
    scale[:, 3:] = 1.0 / contacts.reach[:, 2:]
    scale[:, 2] = 1.0 - _INSIDE
    return scale


def demand_limits(program: ConeProgram, rows: FloatArray, limits: FloatArray, extra: FloatArray) -> None:
    """Demand `rows x + extra <= limits`, a little inside, in M cases.

    Args:
        program: to add to. rows: shape (D, size). limits: shape (D,). extra: shape (M, D).
    """
    # Contacts do not load the other joints.
    loaded = (rows != 0.0).any(axis=1) | (extra != 0.0).any(axis=0)
    inner = limits[loaded] * (1.0 - _INSIDE) - extra[:, loaded]
    program.at_most(np.tile(rows[loaded], (len(extra), 1)), inner.reshape(-1))


def demand_tensions(program: ConeProgram, torques: FloatArray, drive: TendonDrive, first: int) -> FloatArray:
    """Demand that tendons within their limits give torques; return the rows that give the tensions, shape (T, size).

    Args:
        program: to add to.
        torques: rows of the torques of all degrees of freedom, in units in which they are as large as forces.
        drive: the tendons, in the same units. first: place of the first tension among the unknowns.
    """
    tensions = np.eye(len(drive.t_min), program.size, first)
    program.equal(torques[list(drive.columns)] - drive.arms @ tensions, np.zeros(len(drive.columns)))
    program.at_most(tensions / drive.t_max[:, None], np.full(len(tensions), 1.0 - _INSIDE))
    program.at_most(-tensions, -drive.t_min * (1.0 + _INSIDE))
    return tensions


def balanced(G: FloatArray, forces: FloatArray, wrench: FloatArray) -> FloatArray:
    """Return the nearest forces with `G f = wrench` to rounding."""
    answer = np.linalg.pinv(G)
    for _ in range(2):
        forces = forces + answer @ (wrench - G @ forces)
    return forces


def _columns(rows: FloatArray) -> csc_matrix:
    """Return a matrix as sparse columns; SciPy's own way over coordinates takes twice as long."""
    from scipy.sparse import csc_matrix

    column, row = np.nonzero(rows.T)
    ends = np.concatenate([[0], np.cumsum(np.bincount(column, minlength=rows.shape[1]))])
    return csc_matrix((rows[row, column], row.astype(np.int32), ends.astype(np.int32)), shape=rows.shape)


@lru_cache(maxsize=32)
def _small_squares(size: int) -> csc_matrix:
    return _columns(np.eye(size) * _SMALLEST)


def _settings(clarabel: Any, step: float) -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_feas = settings.tol_gap_abs = settings.tol_gap_rel = _ACCURACY
    settings.max_threads = 1
    settings.max_step_fraction = step
    return settings
