"""Write the results of a command: one JSON document on standard output, or files in a folder."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.core.exceptions import MotionError
from clench.core.files.file_bytes import make_folder
from clench.core.files.json_files import encode_document

if TYPE_CHECKING:
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.solution import GraspSolution


def print_json(document: dict[str, Any]) -> None:
    """Print one document, indented, on standard output."""
    import msgspec

    sys.stdout.write(msgspec.json.format(encode_document(document, "document"), indent=2).decode() + "\n")
    sys.stdout.flush()


def write_results(
    hand: Hand, obj: GraspObject, command: GraspCommand, solution: GraspSolution, folder: Path
) -> list[Path]:
    """Write solution.json, trajectory.json if a path is free, and the figures; return their paths.

    Without a free path, one sentence on standard error says why.

    Raises:
        FileError: the folder or a file cannot be written.
    """
    from clench.apps.figures import draw_solution
    from clench.execution.trajectory import plan_trajectory

    make_folder(folder)
    solution.save(folder / "solution.json")
    written = [folder / "solution.json"]
    if solution.rounds == 1:
        try:
            plan_trajectory(solution, hand, obj=obj).save(folder / "trajectory.json")
            written.append(folder / "trajectory.json")
        except MotionError as error:
            (folder / "trajectory.json").unlink(missing_ok=True)
            sys.stderr.write(f"clench: no trajectory was written. {error}\n")
    return [*written, *draw_solution(hand, obj, command, solution, folder)]


def exit_code(solution: GraspSolution, strict: bool) -> int:
    """Return 0 for a grasp, or a partial one unless strict, else 1."""
    good = ("grasp",) if strict else ("grasp", "partial")
    return 0 if solution.status.value in good else 1
