"""Files of other programs, in and out (docs/exporting.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.execution.formats.exchange import GraspFormat, export_grasps, import_grasps
    from clench.execution.formats.grasp_posture import GraspPosture
    from clench.execution.formats.mcap_log import write_log
    from clench.execution.formats.scene_files import export_scene

_HOMES = {
    "GraspFormat": "clench.execution.formats.exchange",
    "GraspPosture": "clench.execution.formats.grasp_posture",
    "export_grasps": "clench.execution.formats.exchange",
    "export_scene": "clench.execution.formats.scene_files",
    "import_grasps": "clench.execution.formats.exchange",
    "write_log": "clench.execution.formats.mcap_log",
}

__all__ = [
    "GraspFormat",
    "GraspPosture",
    "export_grasps",
    "export_scene",
    "import_grasps",
    "write_log",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
