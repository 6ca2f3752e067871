"""Try a grasp in simulation under several settings, and measure it at its posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import pack_object
from clench.execution.simulation.hold import Hold, HoldReport
from clench.execution.simulation.mujoco_scene import Scene, build_scene
from clench.execution.simulation.pulling import hold_and_pull
from clench.execution.simulation.simulated_hand import nearest
from clench.execution.trajectory import plan_trajectory
from clench.mechanics.grasp.contact_kinds import GraspKind
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.analysis.grasp_kinds import grasp_kind
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

#: Links this near touch, and fingers without anything nearer count so far away [m], as in DexGraspBench.
NEAR, FAR = 0.002, 0.01
#: Other settings under which the selected grasps are tried: what of `Hold` is replaced.
HARDER: Mapping[str, dict[str, Any]] = {"friction_0.3": {"friction": 0.3}, "mass_0.5": {"mass": 0.5}}


@dataclass(frozen=True)
class GraspMeasures:
    """Measure a grasp at its posture, as DexGraspBench does.

    Args:
        penetration: of hand and object, by the exact depth [m]. self_penetration: of links of the hand [m].
        contact_links: links within 2 mm. contact_distance: mean over fingers of the smallest distance [m].
        consistency: largest minus smallest of these [m].
    """

    penetration: float
    self_penetration: float
    contact_links: int
    contact_distance: float
    consistency: float


@dataclass(frozen=True, eq=False)
class Trial:
    """The outcome of a trial of a grasp.

    Args:
        solution: the grasp. grasp_kind: by the links that touch. score: our own, see `PlannedGrasp`.
        simultaneous: a way is known on which all contacts are reached at once.
        measures: at the grasp's posture. report: at the settings asked for. harder: held under other ones, by name.
    """

    solution: GraspSolution
    grasp_kind: GraspKind | None
    score: float
    simultaneous: bool
    measures: GraspMeasures
    report: HoldReport
    harder: Mapping[str, HoldReport]

    @property
    def outcome(self) -> str:
        """The outcome, for counting."""
        limits = self.report.settings.max_distance, self.report.settings.max_angle
        if self.report.held:
            return "held"
        if self.report.closed is None or self.report.squeezed is None:
            return "hand_in_the_table" if "table" in self.report.reason else "unstable"
        if not self.report.closed.within(*limits):
            return "pushed_away_while_closing"
        if not self.report.planned:
            return "no_feasible_squeeze"
        if not self.report.squeezed.within(*limits):
            return "lost_in_the_squeeze"
        return "lost_in_the_pull"

    def to_dict(self) -> dict[str, Any]:
        """Return the record of a trial: the grasp, the measurements, and the reports of all tests."""
        return {
            "hand_pose": self.solution.hand_pose.to_dict(),
            "joint_angles": dict(self.solution.joint_angles),
            "open_angles": dict(self.solution.open_angles),
            "score": self.score,
            "outcome": self.outcome,
            "grasp_kind": self.grasp_kind,
            "simultaneous": self.simultaneous,
            "measures": asdict(self.measures),
            "hold": self.report.to_dict(),
            "harder": {name: report.to_dict() for name, report in self.harder.items()},
        }


def try_grasp(
    solution: GraspSolution, score: float, hand: Hand, obj: GraspObject, hold: Hold, *, harder: bool
) -> Trial:
    """Simulate a grasp.

    Args:
        solution: the grasp. score: its own. hand, obj: hand and object. hold: the test. harder: also other settings.
    """
    trajectory = plan_trajectory(solution, hand, obj=obj, force=True)
    return Trial(
        solution,
        grasp_kind(solution, hand, obj),
        score,
        trajectory.pregrasp is not None,
        measure_grasp(solution, hand, obj),
        hold_and_pull(solution, hand, obj, hold, trajectory),
        {
            name: hold_and_pull(solution, hand, obj, replace(hold, **changed), trajectory)
            for name, changed in HARDER.items()
            if harder
        },
    )


def measure_grasp(solution: GraspSolution, hand: Hand, obj: GraspObject) -> GraspMeasures:
    """Measure a grasp at its posture."""
    import mujoco

    q = posture(solution.joint_angles, hand, "joint_angles")
    scene = build_scene(hand, obj, solution.hand_pose, q)
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = q
    mujoco.mj_forward(scene.model, data)
    distances = [nearest(scene, data, link, FAR)[0] for link in range(len(hand.links))]
    per_finger = [min(FAR, max(0.0, min(distances[i] for i in f.links))) for f in hand.fingers]
    T = np.linalg.inv(solution.hand_pose.matrix) @ obj.pose.matrix
    depths = hand_depths(hand, q, pack_object(obj), T, CollisionSource(solution.collision_source))
    return GraspMeasures(
        penetration=max((found.depth for found in depths), default=0.0),
        self_penetration=_self_penetration(scene, data),
        contact_links=sum(distance <= NEAR for distance in distances),
        contact_distance=float(np.mean(per_finger)),
        consistency=max(per_finger) - min(per_finger),
    )


def _self_penetration(scene: Scene, data: Any) -> float:
    of_object = np.isin(data.contact.geom, scene.object_geoms).any(axis=1) if data.ncon else np.zeros(0, dtype=bool)
    return max(0.0, float(-data.contact.dist[~of_object].min(initial=0.0)))
