"""Forces and quality: contacts, grasp map, wrenches, squeeze (docs/method.md section 6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.solver.analysis.batch_quality import batch_epsilon
    from clench.solver.analysis.grasp_kinds import grasp_kind
    from clench.solver.analysis.pose_error import PoseErrorReport, pose_error
    from clench.solver.analysis.quality import GraspQuality, grasp_quality
    from clench.solver.analysis.sensitivity import Sensitivity, sensitivity
    from clench.solver.analysis.squeezing import SqueezePlan, plan_squeeze

_HOMES = {
    "GraspQuality": "clench.solver.analysis.quality",
    "PoseErrorReport": "clench.solver.analysis.pose_error",
    "Sensitivity": "clench.solver.analysis.sensitivity",
    "SqueezePlan": "clench.solver.analysis.squeezing",
    "batch_epsilon": "clench.solver.analysis.batch_quality",
    "grasp_kind": "clench.solver.analysis.grasp_kinds",
    "grasp_quality": "clench.solver.analysis.quality",
    "plan_squeeze": "clench.solver.analysis.squeezing",
    "pose_error": "clench.solver.analysis.pose_error",
    "sensitivity": "clench.solver.analysis.sensitivity",
}

__all__ = [
    "GraspQuality",
    "PoseErrorReport",
    "Sensitivity",
    "SqueezePlan",
    "batch_epsilon",
    "grasp_kind",
    "grasp_quality",
    "plan_squeeze",
    "pose_error",
    "sensitivity",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
