"""Close a robot hand around a known object, in closed form, and carry it out.

Names are imported when first used, so `import clench` stays quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clench.apps.figures import draw_solution
    from clench.base.errors import ClenchError, CommandError, FileError, HandError, ObjectError, UnknownNameError
    from clench.base.pose import Pose
    from clench.execution.completing import complete
    from clench.execution.convex_pieces import in_pieces
    from clench.execution.driven_hand import DrivenHand
    from clench.execution.driver import DriverError, DriverLimits, HandDriver, HandState, JointPath
    from clench.execution.drivers.orca import OrcaDriver
    from clench.execution.drivers.ros2 import Ros2Driver
    from clench.execution.executing import Actuator, execute
    from clench.execution.filming import Film
    from clench.execution.formats.exchange import GraspFormat, export_grasps, import_grasps
    from clench.execution.formats.grasp_posture import GraspPosture
    from clench.execution.formats.mcap_log import write_log
    from clench.execution.history import ExecutionHistory
    from clench.execution.hold import Hold, HoldReport
    from clench.execution.joint_map import JointMap
    from clench.execution.pregrasp import plan_pregrasp
    from clench.execution.ready_signal import ReadySignal
    from clench.execution.report import ExecutionReport
    from clench.execution.simulation import SimulatedHand
    from clench.execution.trajectory import Trajectory, plan_trajectory
    from clench.grasp.approach import approach_poses
    from clench.grasp.calibration import Calibration, load_calibration
    from clench.grasp.contact_kinds import GraspKind
    from clench.grasp.criteria import Criterion, HandCriterion
    from clench.grasp.criterion_registry import register_criterion
    from clench.grasp.scene import set_object_cache
    from clench.grasp.self_check import check_hand
    from clench.models.command import ClosingOrder, GraspCommand
    from clench.models.command_file import load_command
    from clench.models.hand.findings import Finding, FindingCode
    from clench.models.hand.hand import Hand, JointRole
    from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
    from clench.models.objects.obstacles import obstacle, table
    from clench.models.objects.stable_poses import StablePose, stable_poses
    from clench.models.shapes import CollisionSource, ShapeKind
    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp
    from clench.planner.plan_grasps import iter_grasps, plan_grasps
    from clench.planner.regions import Region
    from clench.planner.search import GraspSearch
    from clench.solver.batch import solve_batch, solve_stream
    from clench.solver.controller import solve
    from clench.solver.grasp_batch import BatchContacts, GraspBatch
    from clench.solver.grasp_kinds import grasp_kind
    from clench.solver.pose_error import PoseErrorReport, pose_error
    from clench.solver.quality import GraspQuality, grasp_quality
    from clench.solver.record import Record
    from clench.solver.sensitivity import Sensitivity, sensitivity
    from clench.solver.solution import (
        Candidate,
        Contact,
        ContactKind,
        FingerResult,
        FingerStatus,
        GraspSolution,
        SolutionStatus,
    )
    from clench.solver.squeezing import SqueezePlan, plan_squeeze
    from clench.solver.tracking import Tracker

__version__ = "0.1.0"

# One documented path per name: the module that defines it. A test holds this equal to `__all__`.
_HOMES = {
    "Actuator": "clench.execution.executing",
    "BatchContacts": "clench.solver.grasp_batch",
    "Body": "clench.models.objects.grasp_object",
    "BodyRole": "clench.models.objects.grasp_object",
    "Calibration": "clench.grasp.calibration",
    "Candidate": "clench.solver.solution",
    "ClenchError": "clench.base.errors",
    "ClosingOrder": "clench.models.command",
    "CollisionSource": "clench.models.shapes",
    "CommandError": "clench.base.errors",
    "Contact": "clench.solver.solution",
    "ContactKind": "clench.solver.solution",
    "Criterion": "clench.grasp.criteria",
    "DrivenHand": "clench.execution.driven_hand",
    "DriverError": "clench.execution.driver",
    "DriverLimits": "clench.execution.driver",
    "ExecutionHistory": "clench.execution.history",
    "ExecutionReport": "clench.execution.report",
    "FileError": "clench.base.errors",
    "Film": "clench.execution.filming",
    "Finding": "clench.models.hand.findings",
    "FindingCode": "clench.models.hand.findings",
    "FingerResult": "clench.solver.solution",
    "FingerStatus": "clench.solver.solution",
    "GraspBatch": "clench.solver.grasp_batch",
    "GraspCommand": "clench.models.command",
    "GraspFormat": "clench.execution.formats.exchange",
    "GraspKind": "clench.grasp.contact_kinds",
    "GraspObject": "clench.models.objects.grasp_object",
    "GraspPlan": "clench.planner.grasp_plan",
    "GraspPosture": "clench.execution.formats.grasp_posture",
    "GraspQuality": "clench.solver.quality",
    "GraspSearch": "clench.planner.search",
    "GraspSolution": "clench.solver.solution",
    "Hand": "clench.models.hand.hand",
    "HandCriterion": "clench.grasp.criteria",
    "HandDriver": "clench.execution.driver",
    "HandError": "clench.base.errors",
    "HandState": "clench.execution.driver",
    "Hold": "clench.execution.hold",
    "HoldReport": "clench.execution.hold",
    "JointMap": "clench.execution.joint_map",
    "JointPath": "clench.execution.driver",
    "JointRole": "clench.models.hand.hand",
    "ObjectError": "clench.base.errors",
    "OrcaDriver": "clench.execution.drivers.orca",
    "PlannedGrasp": "clench.planner.grasp_plan",
    "Pose": "clench.base.pose",
    "PoseErrorReport": "clench.solver.pose_error",
    "ReadySignal": "clench.execution.ready_signal",
    "Record": "clench.solver.record",
    "Region": "clench.planner.regions",
    "Ros2Driver": "clench.execution.drivers.ros2",
    "Sensitivity": "clench.solver.sensitivity",
    "ShapeKind": "clench.models.shapes",
    "SimulatedHand": "clench.execution.simulation",
    "SolutionStatus": "clench.solver.solution",
    "SqueezePlan": "clench.solver.squeezing",
    "StablePose": "clench.models.objects.stable_poses",
    "Tracker": "clench.solver.tracking",
    "Trajectory": "clench.execution.trajectory",
    "UnknownNameError": "clench.base.errors",
    "approach_poses": "clench.grasp.approach",
    "check_hand": "clench.grasp.self_check",
    "complete": "clench.execution.completing",
    "draw_solution": "clench.apps.figures",
    "execute": "clench.execution.executing",
    "export_grasps": "clench.execution.formats.exchange",
    "grasp_kind": "clench.solver.grasp_kinds",
    "grasp_quality": "clench.solver.quality",
    "import_grasps": "clench.execution.formats.exchange",
    "in_pieces": "clench.execution.convex_pieces",
    "iter_grasps": "clench.planner.plan_grasps",
    "load_calibration": "clench.grasp.calibration",
    "load_command": "clench.models.command_file",
    "obstacle": "clench.models.objects.obstacles",
    "plan_grasps": "clench.planner.plan_grasps",
    "plan_pregrasp": "clench.execution.pregrasp",
    "plan_squeeze": "clench.solver.squeezing",
    "plan_trajectory": "clench.execution.trajectory",
    "pose_error": "clench.solver.pose_error",
    "register_criterion": "clench.grasp.criterion_registry",
    "sensitivity": "clench.solver.sensitivity",
    "set_object_cache": "clench.grasp.scene",
    "solve": "clench.solver.controller",
    "solve_batch": "clench.solver.batch",
    "solve_stream": "clench.solver.batch",
    "stable_poses": "clench.models.objects.stable_poses",
    "table": "clench.models.objects.obstacles",
    "write_log": "clench.execution.formats.mcap_log",
}

__all__ = [
    "Actuator",
    "BatchContacts",
    "Body",
    "BodyRole",
    "Calibration",
    "Candidate",
    "ClenchError",
    "ClosingOrder",
    "CollisionSource",
    "CommandError",
    "Contact",
    "ContactKind",
    "Criterion",
    "DrivenHand",
    "DriverError",
    "DriverLimits",
    "ExecutionHistory",
    "ExecutionReport",
    "FileError",
    "Film",
    "Finding",
    "FindingCode",
    "FingerResult",
    "FingerStatus",
    "GraspBatch",
    "GraspCommand",
    "GraspFormat",
    "GraspKind",
    "GraspObject",
    "GraspPlan",
    "GraspPosture",
    "GraspQuality",
    "GraspSearch",
    "GraspSolution",
    "Hand",
    "HandCriterion",
    "HandDriver",
    "HandError",
    "HandState",
    "Hold",
    "HoldReport",
    "JointMap",
    "JointPath",
    "JointRole",
    "ObjectError",
    "OrcaDriver",
    "PlannedGrasp",
    "Pose",
    "PoseErrorReport",
    "ReadySignal",
    "Record",
    "Region",
    "Ros2Driver",
    "Sensitivity",
    "ShapeKind",
    "SimulatedHand",
    "SolutionStatus",
    "SqueezePlan",
    "StablePose",
    "Tracker",
    "Trajectory",
    "UnknownNameError",
    "__version__",
    "approach_poses",
    "check_hand",
    "complete",
    "draw_solution",
    "execute",
    "export_grasps",
    "grasp_kind",
    "grasp_quality",
    "import_grasps",
    "in_pieces",
    "iter_grasps",
    "load_calibration",
    "load_command",
    "obstacle",
    "plan_grasps",
    "plan_pregrasp",
    "plan_squeeze",
    "plan_trajectory",
    "pose_error",
    "register_criterion",
    "sensitivity",
    "set_object_cache",
    "solve",
    "solve_batch",
    "solve_stream",
    "stable_poses",
    "table",
    "write_log",
]


def __getattr__(name: str) -> Any:
    if name == "dataset":
        # A namespace of its own, whose names need packages of extras.
        return importlib.import_module("clench.dataset")
    if name not in _HOMES:
        raise AttributeError(f"module 'clench' has no attribute {name!r}; it has: {', '.join(__all__)}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
