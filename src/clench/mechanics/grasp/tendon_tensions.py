"""Tendons: tensions `t_min <= t <= t_max` that give torques `tau = R t`, with R the moment arms [m].

A tendon pulls and never pushes. An antagonistic layout has two tendons per degree of freedom; N + 1 is the least number
of tendons for N degrees of freedom (M. E. Abdallah et al., "Applied joint-space torque and stiffness control of
tendon-driven fingers", Humanoids 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand

from .jacobian import DegreesOfFreedom

#: Torques that tensions miss by more than this cannot be given [Nm].
_MISSED = 1e-9


@dataclass(frozen=True, eq=False)
class Tensions:
    """The tensions of tendons.

    Args:
        tensions: [N], shape (T,); of the nearest torques that can be given.
        given: the torques that they give, of the tendon-driven degrees of freedom [Nm], shape (N,).
        infeasible: names of the degrees of freedom whose torques cannot be given.
    """

    tensions: FloatArray
    given: FloatArray
    infeasible: tuple[str, ...]

    @property
    def feasible(self) -> bool:
        """Whether the tensions give the torques that were asked for."""
        return not self.infeasible


@dataclass(frozen=True, eq=False)
class TendonDrive:
    """The tendons of a hand, acting on its degrees of freedom.

    Args:
        names: of the tendon-driven degrees of freedom, shape (N,). columns: their indices among all.
        arms: R, torque of a degree of freedom per tension [m], shape (N, T).
        t_min, t_max: allowed tensions [N], shape (T,).
    """

    names: tuple[str, ...]
    columns: tuple[int, ...]
    arms: FloatArray
    t_min: FloatArray
    t_max: FloatArray

    def tensions(self, torques: ArrayLike) -> Tensions:
        """Return tensions that give torques of the tendon-driven degrees of freedom, the largest tension smallest.

        If no tensions give the torques, the tensions with the nearest torques are returned, and the missing torques are
        named.

        Args:
            torques: [Nm], shape (N,).

        Raises:
            CommandError: another shape, or not finite.
        """
        wanted = np.asarray(torques, dtype=np.float64)
        if wanted.shape != (len(self.names),) or not np.isfinite(wanted).all():
            raise CommandError(f"torques: expected {len(self.names)} finite numbers [Nm], one each for {self.names}.")
        found = self._least(wanted)
        if found is None:
            found = self._nearest(wanted)
        given = self.arms @ found
        missed = np.abs(given - wanted) > _MISSED * max(1.0, float(np.abs(wanted).max(initial=0.0)))
        return Tensions(found, given, tuple(n for n, m in zip(self.names, missed, strict=True) if m))

    def _least(self, wanted: FloatArray) -> FloatArray | None:
        """Minimise the largest tension and, with a small weight, the sum, so that no tendon is pulled without need."""
        from clench.kernels.mechanics.least_cost import least_cost

        count, eye, arms = self.arms.shape[1], np.eye(self.arms.shape[1]), self.arms / self._unit
        left = wanted / self._unit - arms @ self.t_min
        # Unknowns: tensions above the least ones, and the largest tension above the largest of the least ones.
        lowest = float(self.t_min.max(initial=0.0))
        rows = np.vstack([np.hstack([block, np.zeros((len(block), 1))]) for block in (arms, -arms, eye, eye)])
        rows[-count:, -1] = -1.0
        most = np.concatenate([left, -left, self.t_max - self.t_min, lowest - self.t_min])
        bound = np.isfinite(most)
        x = np.empty(count + 1)
        if not least_cost(rows[bound], most[bound], np.append(np.full(count, 1e-6), 1.0), x):
            return None
        return self.t_min + x[:count]

    def _nearest(self, wanted: FloatArray) -> FloatArray:
        """Return the tensions whose torques are nearest (bounded least squares)."""
        from scipy.optimize import lsq_linear

        answer = lsq_linear(self.arms / self._unit, wanted / self._unit, bounds=(self.t_min, self.t_max), method="bvls")
        return np.asarray(answer.x)

    @property
    def _unit(self) -> float:
        return float(np.abs(self.arms).max(initial=0.0)) or 1.0


def tendon_drive(hand: Hand, dofs: DegreesOfFreedom) -> TendonDrive | None:
    """Return the tendons of a hand, None when it has none; followers add to their leaders as they move with them."""
    if hand.tendons is None:
        return None
    arms = dofs.motion.T @ hand.tendons.arms_of(hand.joint_names)
    driven = np.flatnonzero(np.abs(arms).max(axis=1, initial=0.0) > 0.0)
    return TendonDrive(
        names=tuple(dofs.names[d] for d in driven),
        columns=tuple(int(d) for d in driven),
        arms=arms[driven],
        t_min=np.array(hand.tendons.t_min),
        t_max=np.array(hand.tendons.t_max),
    )
