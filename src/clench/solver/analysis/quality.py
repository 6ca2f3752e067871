"""Rate a solution's grasp: epsilon quality, and the effort of holding (docs/method.md section 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from clench.core.caching.deferring import LateFields, once
from clench.core.defaults import MASS
from clench.core.showing.short_repr import described
from clench.mechanics.epsilon.epsilon_quality import EDGES, epsilon, epsilon_within_torques
from clench.mechanics.epsilon.wrench_space import Ball, WrenchNorm, volume_l1
from clench.mechanics.forces.actuation import Actuation, Effort, actuation
from clench.mechanics.grasp.contacts import DEFAULT_TORSION, ContactModel
from clench.mechanics.grasp.loads import gravity_any_direction, mass_range
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

from .holding import HeldSolution, hold


@dataclass(frozen=True, eq=False)
class GraspQuality(LateFields):
    """Numbers that say how good a grasp is, with the conventions that a comparison needs.

    Volume and effort take much longer than the rest. They are computed when they are first read.

    Args:
        grasp: the contacts, friction, centre of mass and length scale that were used.
        norm: how normal forces are bounded. edges: of the polyhedra inside the friction cones.
        epsilon: the Ferrari–Canny ball [N per N of normal force]; 0 without force closure.
        volume: of the L1 wrench space [N^6 per N^6].
        within_torques: the ball of wrenches resisted within the torque limits [N]; None when not asked for.
        mass: the load is its weight in any direction [kg]. effort: the forces and torques that hold it.
    """

    grasp: HeldSolution
    norm: WrenchNorm
    edges: int
    epsilon: Ball
    volume: float
    within_torques: Ball | None
    mass: float
    effort: Actuation

    def __repr__(self) -> str:
        return described(
            self,
            force_closure=self.force_closure,
            epsilon=self.epsilon.radius,
            volume=self.volume,
            norm=self.norm,
            mass=self.mass,
            worst_torque=self.effort.worst_torque,
        )

    @property
    def force_closure(self) -> bool:
        """Whether every wrench can be resisted, with normal forces large enough."""
        return self.epsilon.radius > 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, `quality` in schema `clench.solution/1`."""
        weakest = self.epsilon.weakest
        within = self.within_torques
        return {
            **self.grasp.conventions(),
            "norm": self.norm.value,
            "edges": self.edges,
            "force_closure": self.force_closure,
            "epsilon": self.epsilon.radius,
            "weakest": None if weakest is None else self.grasp.world_wrench(-weakest),
            "volume": self.volume,
            "epsilon_within_torques": None if within is None else within.radius,
            "actuation": {
                "mass": self.mass,
                "load": "the weight in any direction",
                "worst_torque": self.effort.worst_torque,
                "worst_tension": self.effort.worst_tension,
                "reason": self.effort.reason,
            },
        }


def grasp_quality(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    *,
    mass: float | tuple[float, float] = MASS,
    contact_model: ContactModel | str = ContactModel.POINT,
    friction: float | tuple[float, float] | None = None,
    torsion: float = DEFAULT_TORSION,
    center_of_mass: ArrayLike | None = None,
    norm: WrenchNorm | str = WrenchNorm.L1,
    edges: int = EDGES,
    within_torques: bool = False,
) -> GraspQuality:
    """Return how steady a grasp is, and the smallest worst torque that holds a mass in any direction of gravity.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for.
        mass: of the object [kg]; of a range (least, largest) the largest counts.
        contact_model: `point` (friction alone) or `soft` (also a torque about the normal).
        friction: of all contacts [-]; a range (least, largest) counts with its least value. None takes the friction of
            link and object, or `clench.core.defaults.FRICTION` (0.6) if neither is known.
        torsion: torque about the normal per normal force of soft fingers [m].
        center_of_mass: in the object's frame [m]; None is that of a uniform density.
        norm: `L1` (normal forces sum to 1 N) or `Linf` (each is at most 1 N; takes up to a second).
        edges: of the friction cones. within_torques: also compute the ball within torque limits (half a second).

    Raises:
        CommandError: a value out of range; the solution is of another hand.
    """
    heaviest = mass_range(mass)[1]
    loads = gravity_any_direction(heaviest)
    grasp = hold(
        solution,
        hand,
        obj,
        contact_model=contact_model,
        friction=friction,
        torsion=torsion,
        center_of_mass=center_of_mass,
    )
    held = grasp.held
    ball = epsilon(held, norm, edges)
    late = {
        "volume": once(lambda: volume_l1(held.edge_wrenches(edges)) if len(held.contacts) else 0.0),
        "effort": once(lambda: actuation(held, loads, Effort.TORQUE if held.drive is None else Effort.TENSION)),
    }
    return GraspQuality.with_late(
        lambda name: late[name](),
        grasp=grasp,
        norm=WrenchNorm(norm),
        edges=edges,
        epsilon=ball,
        within_torques=epsilon_within_torques(held, edges) if within_torques else None,
        mass=heaviest,
    )
