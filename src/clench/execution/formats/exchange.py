"""Write solutions for other programs, and read their grasps, by the name of the format."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

from clench.base.errors import CommandError, FileError, UnknownNameError
from clench.solve.solution import GraspSolution

from .dexgraspbench import read_dexgraspbench, write_dexgraspbench
from .grasp_posture import GraspPosture
from .isaac_grasp import read_isaac_grasp, write_isaac_grasp
from .moveit_grasp import read_moveit_grasp, write_moveit_grasp


class GraspFormat(StrEnum):
    """Name the files that are exchanged with other programs."""

    ISAAC_GRASP = "isaac_grasp"
    """YAML, version 1.0: many grasps of one object, the palm in the object's frame"""
    DEXGRASPBENCH = "dexgraspbench"
    """npy with one pickled dictionary: one grasp; read with an unpickler that knows arrays only"""
    MOVEIT_GRASP = "moveit_grasp"
    """JSON in the shape of moveit_msgs/Grasp: many grasps"""


_ENDINGS = {
    ".yaml": GraspFormat.ISAAC_GRASP,
    ".yml": GraspFormat.ISAAC_GRASP,
    ".npy": GraspFormat.DEXGRASPBENCH,
    ".json": GraspFormat.MOVEIT_GRASP,
}


def export_grasps(
    path: str | Path, solutions: GraspSolution | Sequence[GraspSolution], format: GraspFormat | str | None = None
) -> None:
    """Write solutions in the format of another program.

    Args:
        path: the file. solutions: one or more. format: see `GraspFormat`; None: by the file's ending.

    Raises:
        CommandError: more solutions than the format holds, or of several hands. UnknownNameError: no such format.
        FileError: the file cannot be written, or its ending names no format.
    """
    several = [solutions] if isinstance(solutions, GraspSolution) else list(solutions)
    chosen = _format(path, format)
    if chosen is GraspFormat.ISAAC_GRASP:
        write_isaac_grasp(path, several)
    elif chosen is GraspFormat.MOVEIT_GRASP:
        write_moveit_grasp(path, several)
    elif len(several) == 1:
        write_dexgraspbench(path, several[0])
    else:
        raise CommandError(f"{chosen}: one file holds one grasp; {len(several)} solutions were given.")


def import_grasps(path: str | Path, format: GraspFormat | str | None = None) -> list[GraspPosture]:
    """Read grasps of another program; `GraspPosture.command` makes commands of them.

    Args:
        path: the file. format: see `GraspFormat`; None: by the file's ending.

    Raises:
        FileError: missing, malformed, or its ending names no format. UnknownNameError: no such format.
    """
    readers = {
        GraspFormat.ISAAC_GRASP: read_isaac_grasp,
        GraspFormat.DEXGRASPBENCH: read_dexgraspbench,
        GraspFormat.MOVEIT_GRASP: read_moveit_grasp,
    }
    return readers[_format(path, format)](path)


def _format(path: str | Path, given: GraspFormat | str | None) -> GraspFormat:
    if given is not None:
        if given not in list(GraspFormat):
            raise UnknownNameError("format", str(given), "clench", [f.value for f in GraspFormat])
        return GraspFormat(given)
    ending = Path(path).suffix.lower()
    if ending not in _ENDINGS:
        raise FileError(path, f"the ending names no format; expected {', '.join(_ENDINGS)}, or a format by name.")
    return _ENDINGS[ending]
