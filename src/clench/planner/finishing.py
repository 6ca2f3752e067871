"""Complete a grasp that is returned: exact epsilon, squeeze with a reserve, a path that is proven free."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from clench.core.exceptions import MotionError
from clench.core.pose import FloatArray, Pose
from clench.execution.trajectory import plan_trajectory
from clench.mechanics.epsilon.epsilon_quality import epsilon
from clench.mechanics.grasp.contacts import ContactModel
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.squeezing import SqueezePlan, plan_squeeze
from clench.solver.solution import GraspSolution
from clench.solver.solve import solve

from .confidence import shipped_table
from .grasp_plan import PlannedGrasp, UnfinishedGrasp
from .options import PlanOptions
from .rejections import Fallen, Rejection
from .trials import FRICTION_SHARES, Closer, Trial

#: A squeeze under gravity also resists pulls and twists of at least this multiple of the weight [-].
LEAST_MARGIN = 0.5


@dataclass(eq=False)
class Finisher:
    """Complete grasps; see `PlannedGrasp`.

    Args:
        hand, obj, asked: hand, object and options. closer: knows the commands.
        tell: called with every grasp that could not be completed.
    """

    hand: Hand
    obj: GraspObject
    asked: PlanOptions
    closer: Closer
    tell: Callable[[UnfinishedGrasp], None] = field(default=lambda grasp: None)

    def __post_init__(self) -> None:
        """Note how contacts are modelled."""
        self._model: dict[str, Any] = {"contact_model": self.asked.model, "torsion": self.asked.torsion}

    def finish(self, trial: Trial, rejected: Fallen) -> PlannedGrasp | None:
        """Return the completed grasp; None where something is missing, which is counted."""
        T_world_palm = Pose.from_matrix(self.obj.pose.matrix @ trial.T_object_palm)
        command = replace(self.closer.command(trial.arm), hand_pose=T_world_palm)
        solution = solve(self.hand, self.obj, command)
        squeeze = self._squeeze(solution)
        preshape = self.closer.shapes[trial.arm.shape].name

        def leave_out(reason: Rejection) -> None:
            rejected[reason] += 1
            self.tell(UnfinishedGrasp(solution, command, preshape, trial.kind, trial.number, reason))

        if not self._is_enough(squeeze):
            leave_out(Rejection.NO_SQUEEZE)
            return None
        trajectory, pregrasp = None, None
        if self.asked.path:
            try:
                trajectory = plan_trajectory(solution, self.hand, obj=self.obj)
            except MotionError:
                leave_out(Rejection.NO_WAY)
                return None
            row = trajectory.positions[trajectory.pregrasp if trajectory.pregrasp is not None else 0]
            pregrasp = dict(zip(self.hand.joint_names, row.tolist(), strict=True))
        held = squeeze.grasp.held
        friction: FloatArray = held.contacts.friction
        found = [epsilon(held.with_friction(share * friction)).radius for share in FRICTION_SHARES]
        score = float(np.mean(found))
        return PlannedGrasp(
            solution=replace(solution, squeeze=squeeze.to_dict(), pregrasp=pregrasp),
            command=replace(command, planes=GraspCommand.planes),
            preshape=preshape,
            kind=trial.kind,
            epsilon=found[-1],
            score=score,
            displaced=None if self.asked.sigma is None else trial.score,
            confidence=shipped_table().confidence(score) if self.asked.model is ContactModel.POINT else None,
            squeeze=squeeze,
            trajectory=trajectory,
            number=trial.number,
        )

    def _is_enough(self, squeeze: SqueezePlan) -> bool:
        """Say whether a squeeze holds the masses, all of the task's wrenches, and else some disturbance besides."""
        if self.asked.task_wrenches is not None:
            return squeeze.feasible and squeeze.margin >= 1.0 and not squeeze.found.unresisted
        return squeeze.feasible and squeeze.margin >= LEAST_MARGIN

    def _squeeze(self, solution: GraspSolution) -> SqueezePlan:
        asked = self.asked
        return plan_squeeze(
            solution,
            self.hand,
            self.obj,
            mass=asked.mass,
            gravity=asked.gravity,
            disturbances=asked.task_wrenches,
            friction=asked.friction,
            **self._model,
        )
