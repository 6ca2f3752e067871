"""Close a robot hand around a known object, in closed form, and execute the grasp.

The root has the names that most programs need. The others are in namespaces: `clench.criteria`, `clench.errors`,
`clench.execution`, `clench.formats`, `clench.mechanics` and `clench.types`. Their names are also found at the root.
`clench.dataset` has datasets. Names are imported when first used, so `import clench` stays quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names
from clench.core.showing.display import register_display

if TYPE_CHECKING:
    from clench import criteria as criteria
    from clench import errors as errors
    from clench import execution as execution
    from clench import formats as formats
    from clench import mechanics as mechanics
    from clench import types as types
    from clench.apps.figures import draw_solution
    from clench.apps.pages.page import write_page
    from clench.closing.collision.approach import approach_poses
    from clench.closing.collision.self_check import check_hand
    from clench.core.exceptions import ClenchError
    from clench.core.pose import Pose
    from clench.execution.executing import execute
    from clench.execution.formats.exchange import export_grasps, import_grasps
    from clench.execution.simulation.simulated_hand import SimulatedHand
    from clench.execution.trajectory import plan_trajectory
    from clench.models.command import ClosingOrder, GraspCommand
    from clench.models.command_file import load_command
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.models.objects.obstacles import obstacle, table
    from clench.models.objects.stable_poses import stable_poses
    from clench.planner.grasp_plan import GraspPlan
    from clench.planner.plan_grasps import iter_grasps, plan_grasps
    from clench.solver.analysis.quality import grasp_quality
    from clench.solver.analysis.record import Record
    from clench.solver.analysis.squeezing import plan_squeeze
    from clench.solver.batch.grasp_batch import GraspBatch
    from clench.solver.batch.solve_batch import solve_batch, solve_stream
    from clench.solver.batch.tracking import Tracker
    from clench.solver.solution import GraspSolution
    from clench.solver.solve import solve

__version__ = "0.1.0"

# One documented path per name: the module that defines it. A test holds this equal to `__all__`.
_HOMES = {
    "ClenchError": "clench.core.exceptions",
    "ClosingOrder": "clench.models.command",
    "GraspBatch": "clench.solver.batch.grasp_batch",
    "GraspCommand": "clench.models.command",
    "GraspObject": "clench.models.objects.grasp_object",
    "GraspPlan": "clench.planner.grasp_plan",
    "GraspSolution": "clench.solver.solution",
    "Hand": "clench.models.hand.hand",
    "Pose": "clench.core.pose",
    "Record": "clench.solver.analysis.record",
    "SimulatedHand": "clench.execution.simulation.simulated_hand",
    "Tracker": "clench.solver.batch.tracking",
    "approach_poses": "clench.closing.collision.approach",
    "check_hand": "clench.closing.collision.self_check",
    "draw_solution": "clench.apps.figures",
    "execute": "clench.execution.executing",
    "export_grasps": "clench.execution.formats.exchange",
    "grasp_quality": "clench.solver.analysis.quality",
    "import_grasps": "clench.execution.formats.exchange",
    "iter_grasps": "clench.planner.plan_grasps",
    "load_command": "clench.models.command_file",
    "obstacle": "clench.models.objects.obstacles",
    "plan_grasps": "clench.planner.plan_grasps",
    "plan_squeeze": "clench.solver.analysis.squeezing",
    "plan_trajectory": "clench.execution.trajectory",
    "solve": "clench.solver.solve",
    "solve_batch": "clench.solver.batch.solve_batch",
    "solve_stream": "clench.solver.batch.solve_batch",
    "stable_poses": "clench.models.objects.stable_poses",
    "table": "clench.models.objects.obstacles",
    "write_page": "clench.apps.pages.page",
}

#: Their names are also found at the root.
_NAMESPACES = ("criteria", "errors", "execution", "formats", "mechanics", "types")

__all__ = [
    "ClenchError",
    "ClosingOrder",
    "GraspBatch",
    "GraspCommand",
    "GraspObject",
    "GraspPlan",
    "GraspSolution",
    "Hand",
    "Pose",
    "Record",
    "SimulatedHand",
    "Tracker",
    "__version__",
    "approach_poses",
    "check_hand",
    "draw_solution",
    "execute",
    "export_grasps",
    "grasp_quality",
    "import_grasps",
    "iter_grasps",
    "load_command",
    "obstacle",
    "plan_grasps",
    "plan_squeeze",
    "plan_trajectory",
    "solve",
    "solve_batch",
    "solve_stream",
    "stable_poses",
    "table",
    "write_page",
]

# Objects of lower layers show themselves by what a higher layer draws; it is imported when something is shown.
register_display("clench.apps.pages.showing")

__getattr__, __dir__ = lazy_names(__name__, _HOMES, _NAMESPACES, ("dataset",))
