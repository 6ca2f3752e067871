"""Grasps for `clench export`: solutions, lists and batches, with the hand and the object that they name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.base.errors import CommandError, FileError, UnknownNameError

if TYPE_CHECKING:
    from clench.execution.hold import Hold
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solve.saved_question import SavedBatch
    from clench.solve.solution import GraspSolution


@dataclass(frozen=True, eq=False)
class ReadGrasps:
    """Hold solutions with the hand and the object that they are of, None where these cannot be loaded."""

    solutions: list[GraspSolution]
    hand: Hand | None
    obj: GraspObject | None
    notes: tuple[str, ...]


def make_test(mass: Any, friction: Any) -> Hold:
    """Return the hold test at the hard end of what the squeeze is planned for: the heaviest mass, the lowest friction.

    Raises:
        CommandError: a value out of range.
    """
    from clench.base.defaults import FRICTION, MASS
    from clench.execution.hold import Hold
    from clench.grasp.mechanics.contacts import friction_range
    from clench.grasp.mechanics.loads import mass_range

    heaviest = mass_range(MASS if mass is None else mass, "--mass")[1]
    lowest = friction_range(FRICTION if friction is None else friction, "--friction")[0]
    return Hold(mass=heaviest, friction=lowest, planned_mass=mass, planned_friction=friction)


def read_grasps(
    files: Sequence[Path],
    hand: str | None,
    object: str | None,
    loaded_with: tuple[Path | None, str | None],
    scale: float | None,
) -> ReadGrasps:
    """Read files of grasps.

    Args:
        files: solutions, JSON lists of solutions, batches. hand, object: models; None: those that the files name.
        loaded_with: hand file and palm of the hand. scale: of the object; None: what the files say.

    Raises:
        FileError: a file is missing or malformed; a model that was given cannot be read. CommandError: no grasp.
    """
    import clench
    from clench.solve.saved_question import SavedBatch

    batches = [SavedBatch(file) for file in files if file.suffix == ".npz"]
    solutions = [s for file in files if file.suffix != ".npz" for s in _solutions(file)]
    notes: list[str] = []
    if not (batches or solutions):
        raise CommandError("solutions: expected at least one file with a solution.")
    of = batches[0] if batches else solutions[0]
    factor = of.object_scale if scale is None else scale
    source = of.object_collision_source
    the_hand = _load(
        lambda model: clench.Hand.load(model, hand_file=loaded_with[0], palm=loaded_with[1]), hand, of.hand_model, notes
    )
    obj = _load(
        lambda model: clench.GraspObject.load(model, scale=factor, collision_source=source),
        object,
        of.object_model,
        notes,
    )
    if object is None and scale is None and the_hand is not None and obj is not None:
        for solution in solutions[:1]:
            obj = _fitting(solution, the_hand, obj, notes)
    for batch in batches:
        solutions += _solved(batch, the_hand, obj)
    if not solutions:
        raise CommandError(f"No pose of {', '.join(str(b.path) for b in batches)} is a grasp: nothing is written.")
    return ReadGrasps(solutions, the_hand, obj, tuple(notes))


def _solutions(file: Path) -> list[GraspSolution]:
    import clench
    from clench.base.json_files import read_json

    data = read_json(file)
    if isinstance(data, list):
        return [clench.GraspSolution.from_dict(each, f"{file}[{i}]") for i, each in enumerate(data)]
    return [clench.GraspSolution.from_dict(data, str(file))]


def _solved(batch: SavedBatch, hand: Hand | None, obj: GraspObject | None) -> list[GraspSolution]:
    from clench.kernels.warming import announce, warm_up

    if hand is None or obj is None:
        what, model = ("hand", batch.hand_model) if hand is None else ("object", batch.object_model)
        raise FileError(batch.path, f"{what}_model: '{model}' cannot be loaded; give --{what}.")
    announce()
    warm_up()
    return list(batch.solutions(hand, obj))


def _load(load: Any, given: str | None, named: str, notes: list[str]) -> Any:
    """Return what was given, or what is named; None, and a note, where nothing can be loaded by that name."""
    if given is not None or not named:
        return load(given) if given is not None else None
    try:
        return load(named)
    except (FileError, UnknownNameError) as error:
        notes.append(f"Written without the model that the solution names: {error}")
        return None


def _fitting(solution: GraspSolution, hand: Hand, obj: GraspObject, notes: list[str]) -> GraspObject | None:
    from clench.execution.executing import check_geometry

    check_geometry(solution, hand, None)
    try:
        check_geometry(solution, hand, obj)
    except CommandError as error:
        notes.append(f"Written without the object: {error}")
        return None
    return obj
