"""Rows of a dataset: a grasp, or a grasp that failed, as plain values by column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from clench import __version__
from clench.core.pose import FloatArray, Pose
from clench.dataset.jobs.sources import license_beside
from clench.dataset.jobs.units import Unit
from clench.execution.simulation.hold import HoldReport
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.planner.grasp_plan import PlannedGrasp, UnfinishedGrasp
from clench.planner.rejections import Rejection
from clench.solver.analysis.holding import hold
from clench.solver.analysis.squeezing import SqueezePlan

from .columns import COLUMNS

_STAGE_OF: Final = {Rejection.NO_SQUEEZE: "squeeze", Rejection.NO_WAY: "path"}
#: The strict limits of the hold test: distance [m], angle [rad].
STRICT: Final = (0.005, float(np.deg2rad(5.0)))

Row = dict[str, Any]


def row_of(
    unit: Unit, hand: Hand, obj: GraspObject, grasp: PlannedGrasp | UnfinishedGrasp, report: HoldReport | None
) -> Row:
    """Return the row of a grasp; unknown values are None.

    Args:
        unit: that it belongs to. hand, obj: hand and object. grasp: the grasp. report: of the hold test, None without
            one.
    """
    solution, command = grasp.solution, grasp.command
    hand_hash, _, object_hash = solution.geometry_hash.partition("+")
    row: Row = dict.fromkeys(COLUMNS)
    row |= {
        "hand": solution.hand,
        "hand_model": unit.hand,
        "hand_hash": hand_hash,
        "hand_license": license_beside(unit.hand),
        "object": solution.object,
        "object_model": unit.object,
        "object_hash": object_hash,
        "object_license": license_beside(unit.object),
        "scale": unit.scale,
        "object_collision_source": str(obj.collision_source),
        "unit": unit.key,
        "seed": unit.seed,
        "proposal": grasp.number,
        "clench_version": __version__,
        "ok": isinstance(grasp, PlannedGrasp),
        "kind": grasp.kind.value,
        "preshape": grasp.preshape,
        "preshape_joints": list(command.angles),
        "preshape_angles": [float(angle) for angle in command.angles.values()],
        "fingers": None if command.fingers is None else list(command.fingers),
        "T_world_palm": solution.hand_pose.wxyz_xyz.tolist(),
        "T_object_palm": (solution.object_pose.inverse() @ solution.hand_pose).wxyz_xyz.tolist(),
        "T_world_object": solution.object_pose.wxyz_xyz.tolist(),
        "touch": [solution.joint_angles[name] for name in hand.joint_names],
        "certified": solution.certified,
        "penetration": solution.max_penetration,
    }
    if isinstance(grasp, UnfinishedGrasp):
        contacts = hold(solution, hand, obj).contacts
        row |= {"stage": _STAGE_OF[grasp.reason], "reason": grasp.reason.value}
    else:
        contacts = grasp.squeeze.grasp.contacts
        row |= _planned(grasp, hand)
    row |= {
        "contact_finger": [c.finger for c in contacts],
        "contact_link": [c.link for c in contacts],
        "contact_position": _points([solution.object_pose.inverse().apply(c.position) for c in contacts]),
        "contact_normal": _points([solution.object_pose.rotation.T @ c.normal for c in contacts]),
    }
    return row if report is None else row | _tested(report)


def _planned(grasp: PlannedGrasp, hand: Hand) -> Row:
    """Return the columns that only a complete grasp has."""
    plan, pregrasp = grasp.squeeze, grasp.solution.pregrasp
    return {
        "pregrasp": None if pregrasp is None else [pregrasp[name] for name in hand.joint_names],
        "squeeze": _told(plan, hand, grasp),
        "torque_joints": list(plan.torques),
        "torques": [float(torque) for torque in plan.torques.values()],
        "margin": _finite(plan.margin),
        "contact_force": _points(_in_object(plan.forces, grasp.solution.object_pose)),
        "epsilon": grasp.epsilon,
        "score": grasp.score,
        "confidence": grasp.confidence,
    }


def _told(plan: SqueezePlan, hand: Hand, grasp: PlannedGrasp) -> list[float] | None:
    """Return the angles that press as planned [rad]; None where the model lacks the gain of a servo that presses."""
    if any(torque and name not in plan.offsets for name, torque in plan.torques.items()):
        return None
    touch = grasp.solution.joint_angles
    return [touch[name] + float(plan.offsets.get(name, 0.0)) for name in hand.joint_names]


def _tested(report: HoldReport) -> Row:
    """Return the columns of a hold test; a dropped grasp failed."""
    moved = [pulled.farthest for pulled in report.pulls.values()]
    row: Row = {
        "held": report.held,
        "held_5mm_5deg": report.held_within(*STRICT),
        "hold_distance": _finite(max(motion.distance for motion in moved)) if moved else None,
        "hold_angle": _finite(max(motion.angle for motion in moved)) if moved else None,
        "hold_reason": report.reason,
    }
    return row if report.held else row | {"ok": False, "stage": "hold", "reason": report.reason}


def _in_object(vectors: FloatArray, T_world_object: Pose) -> FloatArray:
    return np.asarray(vectors @ T_world_object.rotation)


def _points(points: Sequence[FloatArray] | FloatArray) -> list[list[float]]:
    return [[float(x) for x in point] for point in points]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
