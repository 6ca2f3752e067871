"""The plan: grasps with all data for their use, and the fate of all proposals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.core.pose import Pose
from clench.core.showing import display
from clench.core.showing.display import Displayed
from clench.execution.trajectory import Trajectory
from clench.mechanics.grasp.contact_kinds import GraspKind
from clench.models.command import GraspCommand
from clench.solver.analysis.squeezing import SqueezePlan, without_limits
from clench.solver.solution import GraspSolution

from .options import PlanOptions
from .rejections import HELP, Rejection

if TYPE_CHECKING:
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject


@dataclass(frozen=True, eq=False)
class PlannedGrasp(Displayed):
    """A grasp that was planned: everything that is needed to use it.

    Args:
        solution: the certified answer with its pregrasp and squeeze; `solution.hand_pose` is where the palm goes.
        command: solves to the same answer. preshape: name of the preshape. kind: see `GraspKind`.
        epsilon: Ferrari–Canny ball at the lowest friction [N per N of normal force].
        score: mean of epsilon at the lowest friction and at half of it. Grasps are sorted by it, unless displaced.
        displaced: mean of the bound of this score over displacements of the object; None without `pose_sigma`.
        confidence: measured share of grasps with such a score that held in simulation, 0 to 1 (docs/planning.md). None
            for soft contacts, for which no measurement exists.
        squeeze: forces, torques and offsets that hold the object.
        trajectory: the proven path from the open hand to the touch; None when it was not asked for.
        number: tells the grasps of a search apart; earlier ones have lower numbers.
    """

    solution: GraspSolution
    command: GraspCommand
    preshape: str
    kind: GraspKind
    epsilon: float
    score: float
    displaced: float | None
    confidence: float | None
    squeeze: SqueezePlan
    trajectory: Trajectory | None
    number: int

    @property
    def rank(self) -> tuple[float, int]:
        """Sort key of plans: the better score first, then the earlier proposal."""
        return -(self.score if self.displaced is None else self.displaced), self.number

    @property
    def hand_pose(self) -> Pose:
        """Target pose of the palm, `T_world_palm`."""
        return self.solution.hand_pose

    @property
    def joint_angles(self) -> Mapping[str, float]:
        """Angles of all joints at the touch [rad], by name."""
        return self.solution.joint_angles

    def show(self, hand: Hand | None = None, obj: GraspObject | None = None) -> Path | None:
        """Show the grasp as a page; see `GraspSolution.show`."""
        return display.show(self, hand, obj)

    def __repr__(self) -> str:
        position = ", ".join(f"{x:.3f}" for x in self.hand_pose.position)
        return f"PlannedGrasp({self.kind}, '{self.preshape}', palm at [{position}] m, epsilon {self.epsilon:.3g})"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form: the solution's document, and the plan's data about it."""
        return {
            "preshape": self.preshape,
            "kind": self.kind.value,
            "epsilon": self.epsilon,
            "score": self.score,
            "displaced": self.displaced,
            "confidence": self.confidence,
            "proposal": self.number,
            "solution": self.solution.to_dict(),
        }


@dataclass(frozen=True, eq=False)
class UnfinishedGrasp:
    """A closed grasp that could not be completed, and why; a plan leaves it out.

    Args:
        solution: the certified answer, without squeeze and pregrasp.
        command, preshape, kind, number: see `PlannedGrasp`.
        reason: why it was left out: no squeeze, or no path.
    """

    solution: GraspSolution
    command: GraspCommand
    preshape: str
    kind: GraspKind
    number: int
    reason: Rejection


@dataclass(frozen=True, eq=False)
class RejectedProposal:
    """A proposal that came to nothing, where it did.

    Args:
        T_object_palm: where the palm was. preshape: its name. angles: what it sets [rad], by joint name.
        reason: what it fell for.
    """

    T_object_palm: Pose
    preshape: str
    angles: Mapping[str, float]
    reason: Rejection


@dataclass(frozen=True, eq=False)
class GraspPlan(Displayed):
    """Grasps of an object, the best ones first, and what became of all proposals.

    Args:
        hand, object: their names. grasps: see `PlannedGrasp`. asked: the options.
        proposed: how many wrist poses were proposed. closed: at how many the hand was closed.
        force_closed: how many of these resist every wrench, by the bound of epsilon.
        rejected: number of rejected proposals by reason. waiting: number of good proposals that were not needed.
        late: the time budget ended the search. widest: how far apart pads of the hand come [m].
        times: seconds by stage.
    """

    hand: str
    object: str
    grasps: tuple[PlannedGrasp, ...]
    asked: PlanOptions
    proposed: int
    closed: int
    force_closed: int
    rejected: dict[str, int]
    waiting: int
    late: bool
    widest: float
    times: dict[str, float]

    def __len__(self) -> int:
        return len(self.grasps)

    def __iter__(self) -> Iterator[PlannedGrasp]:
        return iter(self.grasps)

    def __getitem__(self, number: int) -> PlannedGrasp:
        return self.grasps[number]

    @property
    def text(self) -> str:
        """Sentences: the result, the reason if there are fewer grasps than asked for, and joints without limits."""
        unlimited = dict.fromkeys(name for grasp in self.grasps for name in grasp.squeeze.unlimited)
        return f"{self._result} {without_limits(tuple(unlimited))}".rstrip()

    @property
    def _result(self) -> str:
        found = f"{len(self)} of {self.asked.count} grasps from {self.proposed} proposals"
        if len(self) >= self.asked.count:
            return f"Found {found}."
        if self.late:
            return f"Found {found}. The time was over."
        counted = {k: n for k, n in self.rejected.items() if n}
        if not counted:
            return (
                f"Found {found}. No two opposing places of the object are spanned by the hand, whose pads come up to "
                f"{1e3 * self.widest:.0f} mm apart. Check the object's scale."
            )
        # An option that the caller left out does not restrict the others.
        others = {k: n for k, n in counted.items() if k != Rejection.DIRECTION} or counted
        reason, number = max(others.items(), key=lambda item: item[1])
        return f"Found {found}. Most proposals fell for '{reason}' ({number}). {HELP[Rejection(reason)]}"

    def show(self, hand: Hand | None = None, obj: GraspObject | None = None) -> Path | None:
        """Show all grasps as a page, to be clicked through; see `GraspSolution.show`."""
        return display.show(self, hand, obj)

    def __repr__(self) -> str:
        return f"GraspPlan({self.text!r})"

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, schema `clench.plan/1`."""
        return {
            "schema": "clench.plan/1",
            "hand": self.hand,
            "object": self.object,
            "text": self.text,
            "proposed": self.proposed,
            "closed": self.closed,
            "force_closed": self.force_closed,
            "rejected": dict(self.rejected),
            "waiting": self.waiting,
            "seconds": {**self.times, "total": sum(self.times.values())},
            "grasps": [grasp.to_dict() for grasp in self.grasps],
        }
