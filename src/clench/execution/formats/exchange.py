"""Write solutions for other programs, and read their grasps, by the name of the format."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np

from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.core.showing.short_repr import short_repr
from clench.execution.simulation.hold import Hold
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.grasp_batch import GraspBatch
from clench.solver.solution import GraspSolution, SolutionStatus

from .dexgraspbench import object_folder, read_dexgraspbench, write_dexgraspbench
from .grasp_posture import BASE, GraspPosture
from .isaac_grasp import read_isaac_grasp, write_isaac_grasp
from .moveit_grasp import read_moveit_grasp, write_moveit_grasp
from .outgoing import ExportSettings, outgoing
from .scene_files import ENDINGS as SCENES


class GraspFormat(StrEnum):
    """Name the files that are exchanged with other programs."""

    ISAAC_GRASP = "isaac_grasp"
    """YAML, version 1.0: many grasps of one object, the gripper's frame in the object's"""
    DEXGRASPBENCH = "dexgraspbench"
    """npy with one pickled dictionary: one grasp a file; read with an unpickler that knows arrays only"""
    MOVEIT_GRASP = "moveit_grasp"
    """JSON in the shape of moveit_msgs/Grasp: many grasps"""


#: Endings of files that hold a whole dataset; `clench.dataset.export` writes them.
DATASETS: Final = (".h5", ".hdf5")
_ENDINGS: Final = {
    ".yaml": GraspFormat.ISAAC_GRASP,
    ".yml": GraspFormat.ISAAC_GRASP,
    ".npy": GraspFormat.DEXGRASPBENCH,
    ".json": GraspFormat.MOVEIT_GRASP,
}


@dataclass(frozen=True)
class ExportReport:
    """The outcome of an export: the files, and the data that they lack.

    Args:
        files: in order. confidences: of the grasps, see `export_grasps`.
        notes: sentences about missing data, each once, with the number of grasps.
    """

    files: tuple[Path, ...]
    confidences: tuple[float, ...]
    notes: tuple[str, ...]

    __repr__ = short_repr


def export_grasps(
    path: str | Path,
    solutions: GraspSolution | GraspBatch | Sequence[GraspSolution],
    format: GraspFormat | str | None = None,
    *,
    hand: Hand | None = None,
    obj: GraspObject | Sequence[GraspObject | None] | None = None,
    root: str | None = None,
    name: str | None = None,
    hold: Hold | None = None,
    mass: float | tuple[float, float] | None = None,
    friction: float | tuple[float, float] | None = None,
    stiffness: float | None = None,
) -> ExportReport:
    """Write grasps in the format of another program (docs/exporting.md).

    With hand and object, a pregrasp and a squeeze for every direction of gravity are planned where a solution has none.
    The confidence of a grasp is 1 where the hold test held, and 0.5 where a squeeze is feasible. It is 0 without a
    feasible squeeze, after a failed test, without a free straight line between the postures, and for an invalid
    solution. A note says why.

    Args:
        path: the file; for several grasps in the format dexgraspbench, a folder. Folders are made.
        solutions: one, several, or a batch, of which the poses that are grasps are solved again.
        format: see `GraspFormat`; None: by the file's ending. A path without an ending is a folder for dexgraspbench.
        hand, obj: the hand and object that were solved for; the default for a batch is its own. For several objects,
            pass a sequence with one object per solution; isaac_grasp takes one object per file.
        root: the link whose pose is written, or "world": the frame of the hand's model file. None: "world" for
            dexgraspbench, which attaches the whole file there; the palm for the others.
        name: of the object, instead of its own.
        hold: a test that every grasp goes through; the file gets the squeeze of the test.
        mass, friction: for planning the squeeze, numbers or ranges (least, largest) [kg], [-]; None: values of the
            solution's squeeze, or of the test.
        stiffness: gain of the servos that will hold the postures, at every joint or tendon [Nm/rad]; None: the model's.

    Raises:
        CommandError: several grasps for one file, or of several hands, or of another hand or object; a root or a test
            without the hand. UnknownNameError: no such format or link. FileError: a file cannot be written, or its
            ending names no format.
    """
    if isinstance(solutions, GraspBatch):
        hand, obj = hand or solutions.question.hand, obj or solutions.question.obj
        solutions = [solutions.solution(int(i)) for i in np.flatnonzero(solutions.status == SolutionStatus.GRASP)]
    several = [solutions] if isinstance(solutions, GraspSolution) else list(solutions)
    chosen = format_of(path, format, read=False)
    bench = chosen is GraspFormat.DEXGRASPBENCH
    files = _files(Path(path), len(several)) if bench else (Path(path),)
    if bench and name is not None:
        raise CommandError(f"name: {chosen} names an object by its folder; it has no place for '{name}'.")
    if not several:
        raise CommandError(f"{chosen}: expected at least one grasp, got none.")
    root = BASE if bench and root is None and hand is not None else root
    objects = [obj] * len(several) if obj is None or isinstance(obj, GraspObject) else list(obj)
    if len(objects) != len(several):
        raise CommandError(f"obj: expected one object for each of {len(several)} solutions, got {len(objects)}.")
    settings = ExportSettings(hand, None, root, name, hold, mass, friction, stiffness)
    grasps = [outgoing(each, replace(settings, obj=of)) for each, of in zip(several, objects, strict=True)]
    notes = [note for grasp in grasps for note in grasp.notes]
    if chosen is GraspFormat.ISAAC_GRASP:
        write_isaac_grasp(path, grasps)
    elif chosen is GraspFormat.MOVEIT_GRASP:
        write_moveit_grasp(path, grasps)
    else:
        folderless = [s.object for s in several if not object_folder(s)]
        notes += [f"The object '{name}' was read from no file: obj_path is empty." for name in folderless]
        for file, grasp in zip(files, grasps, strict=True):
            write_dexgraspbench(file, grasp)
    counted = Counter(notes)
    told = (f"{note} ({count} of {len(grasps)} grasps)" if len(grasps) > 1 else note for note, count in counted.items())
    return ExportReport(files, tuple(grasp.confidence for grasp in grasps), tuple(told))


def _files(path: Path, count: int) -> tuple[Path, ...]:
    """Return the files of so many grasps, one each; make their folder."""
    if path.suffix and not os.path.isdir(path):
        if count > 1:
            raise CommandError(
                f"dexgraspbench: one file holds one grasp; {count} solutions were given for '{path}'. "
                "Give a folder (a path without an ending)."
            )
        return (path,)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(path, f"cannot be made a folder ({error.strerror or error}).") from None
    return tuple(path / f"grasp_{i}.npy" for i in range(count))


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
    return readers[format_of(path, format, read=True)](path)


def format_of(path: str | Path, given: GraspFormat | str | None, *, read: bool) -> GraspFormat:
    """Return the format of a file: the given one, or the one that the ending names.

    Args:
        path: the file. given: name of the format, None: by the ending. read: the file is there to be read.

    Raises:
        FileError: the ending names no format. UnknownNameError: no such format.
    """
    if given is not None:
        if given not in list(GraspFormat):
            raise UnknownNameError("format", str(given), "clench", [f.value for f in GraspFormat])
        return GraspFormat(given)
    if not Path(path).suffix or os.path.isdir(path):
        return GraspFormat.DEXGRASPBENCH
    ending = Path(path).suffix.lower()
    if ending not in _ENDINGS:
        endings, names = ", ".join(_ENDINGS), ", ".join(GraspFormat)
        others = f" A scene ends with {', '.join(SCENES)}; a dataset with {', '.join(DATASETS)}."
        said = f"the ending names no format; expected {endings}, or a format by name: {names}."
        raise FileError(path, said if read else said + others)
    return _ENDINGS[ending]
