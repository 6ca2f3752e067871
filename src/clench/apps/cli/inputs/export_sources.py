"""Grasps for `clench export`: solutions, lists and batches, with the hand and the object that they name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.scene_options import SceneOptions, with_scene
from clench.core.exceptions import CommandError, FileError, UnknownNameError

if TYPE_CHECKING:
    from clench.execution.simulation.hold import Hold
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.batch.saved_question import SavedBatch
    from clench.solver.solution import GraspSolution


@dataclass(frozen=True, eq=False)
class ReadGrasps:
    """Solutions with their hand and objects, None for models that cannot be loaded.

    Args:
        solutions: of all files. hand: of all solutions. objects: by solution.
        sources: the file of every solution, with its place in a list. notes: sentences about models that are missing.
    """

    solutions: list[GraspSolution]
    hand: Hand | None
    objects: list[GraspObject | None]
    sources: list[str]
    notes: tuple[str, ...]


def make_test(mass: Any, friction: Any) -> Hold:
    """Return the hold test at the hard end of the squeeze's range: the heaviest mass, the lowest friction.

    Raises:
        CommandError: a value out of range.
    """
    from clench.core.defaults import FRICTION, MASS
    from clench.execution.simulation.hold import Hold
    from clench.mechanics.grasp.contacts import friction_range
    from clench.mechanics.grasp.loads import mass_range

    heaviest = mass_range(MASS if mass is None else mass, "--mass")[1]
    lowest = friction_range(FRICTION if friction is None else friction, "--friction")[0]
    return Hold(mass=heaviest, friction=lowest, planned_mass=mass, planned_friction=friction)


def read_grasps(
    files: Sequence[Path],
    hand: str | None,
    object: str | None,
    loaded_with: tuple[Path | None, str | None],
    scale: float | None,
    scene: SceneOptions = (None, ()),
) -> ReadGrasps:
    """Read files of grasps, and load the models that they name: one hand, and as many objects as there are.

    Args:
        files: solutions, JSON lists of solutions, batches. hand, object: models; None: the models that the files name.
        loaded_with: hand file and palm of the hand. scale: of the objects; None: the files' own.
        scene: the table and the obstacles that the grasps were solved with.

    Raises:
        FileError: a file is missing or malformed; a model that was given cannot be read. CommandError: no grasp, or a
            grasp of another hand or object than the given one.
    """
    import clench

    read = [pair for file in files for pair in _contents(file)]
    if not read:
        raise CommandError("solutions: expected at least one file with a solution.")
    notes: list[str] = []
    the_hand = _load(
        lambda model: clench.Hand.load(model, hand_file=loaded_with[0], palm=loaded_with[1]),
        hand,
        read[0][1].hand_model,
        notes,
    )
    objects = _Objects(object, scale, scene, the_hand, notes)
    found = ReadGrasps([], the_hand, [], [], ())
    for source, each in read:
        if isinstance(each, clench.GraspSolution):
            _check_hand(each, the_hand, source, read[0][0])
            solutions, obj = [each], objects.of_solution(each, source)
        else:
            obj = objects.of(each)
            solutions = _solved(each, the_hand, obj)
        found.solutions.extend(solutions)
        found.objects.extend([obj] * len(solutions))
        found.sources.extend([source] * len(solutions))
    if not found.solutions:
        raise CommandError(f"No pose of {', '.join(source for source, _ in read)} is a grasp: nothing is written.")
    return replace(found, notes=tuple(dict.fromkeys(notes)))


def refuse_several(read: ReadGrasps, format: str) -> None:
    """Refuse grasps of several hands or objects, for a format that has one of each in a file.

    Raises:
        CommandError: with two files that do not go together.
    """
    from clench.execution.formats.outgoing import first_other

    other = first_other(read.solutions)
    if other is not None:
        a, b = (f"'{read.sources[i]}' ({read.solutions[i].hand} on {read.solutions[i].object})" for i in (0, other))
        raise CommandError(
            f"{format}: one file holds grasps of one hand and one object; {a} and {b} are of different ones. Export "
            "them separately."
        )


class _Objects:
    """Load objects, each once.

    Args:
        given: model of the object of all grasps; None: the models that the files name. scale: of it; None: the files'
            own. scene: what is around it. hand: of the grasps, None when it is not known.
        notes: collects sentences about missing data.
    """

    def __init__(
        self, given: str | None, scale: float | None, scene: SceneOptions, hand: Hand | None, notes: list[str]
    ) -> None:
        self._given, self._scale, self._scene, self._hand, self._notes = given, scale, scene, hand, notes
        self._loaded: dict[tuple[Any, ...], GraspObject | None] = {}

    def of(self, named: GraspSolution | SavedBatch) -> GraspObject | None:
        """Return the named object, or the given one; None, with a note, if it cannot be loaded."""
        import clench

        scale, source = named.object_scale if self._scale is None else self._scale, named.object_collision_source
        key: tuple[Any, ...] = (self._given or named.object_model, scale, source)
        if key not in self._loaded:
            self._loaded[key] = _load(
                lambda model: clench.GraspObject.load(model, scale=scale, collision_source=source),
                self._given,
                named.object_model,
                self._notes,
            )
        loaded, pose = self._loaded[key], named.object_pose
        if loaded is None or self._scene == (None, ()):
            return loaded
        key = (*key, None if pose is None else pose.wxyz_xyz.tobytes())
        if key not in self._loaded:
            self._loaded[key] = with_scene(loaded, pose, *self._scene)
        return self._loaded[key]

    def of_solution(self, solution: GraspSolution, source: str) -> GraspObject | None:
        """Return the object of a solution; None, with a note, if the named model has another geometry.

        Raises:
            CommandError: the given model has another geometry.
        """
        from clench.execution.executing import check_geometry

        obj = self.of(solution)
        if obj is None or self._hand is None:
            return obj
        try:
            check_geometry(solution, self._hand, obj)
        except CommandError as error:
            if self._given is not None or self._scale is not None or self._scene != (None, ()):
                raise CommandError(f"{source}: {error}") from None
            self._notes.append(f"Written without the object: {error}")
            return None
        return obj


def _contents(file: Path) -> list[tuple[str, GraspSolution | SavedBatch]]:
    """Return the solutions of a file, or the batch that it is, each with its name for messages."""
    import clench
    from clench.core.files.json_files import read_json
    from clench.solver.batch.saved_question import SavedBatch

    if file.suffix == ".npz":
        return [(str(file), SavedBatch(file))]
    data = read_json(file, "a solution, a list of solutions or a plan")
    if isinstance(data, dict) and str(data.get("schema")).startswith("clench.plan/"):
        data = [grasp.get("solution") if isinstance(grasp, dict) else grasp for grasp in _grasps(data, file)]
    listed = [(f"{file}[{i}]", each) for i, each in enumerate(data)] if isinstance(data, list) else [(str(file), data)]
    return [(source, clench.GraspSolution.from_dict(each, source)) for source, each in listed]


def _grasps(plan: dict[str, Any], file: Path) -> list[Any]:
    """Return the entries of a plan.

    Raises:
        FileError: it has no list of them.
    """
    grasps = plan.get("grasps")
    if not isinstance(grasps, list):
        raise FileError(file, "grasps: expected a list of planned grasps.")
    return grasps


def _check_hand(solution: GraspSolution, hand: Hand | None, source: str, first: str) -> None:
    """Check that a solution is of the hand that was loaded.

    Raises:
        CommandError: its hand differs from that of the first grasp, or from the given one.
    """
    from clench.execution.executing import check_geometry

    if hand is None:
        return
    other = "" if source == first else f" '{first}' and '{source}' are of different hands: export them separately."
    if solution.hand != hand.name:
        raise CommandError(f"{source}: the solution is for hand '{solution.hand}', not for '{hand.name}'.{other}")
    try:
        check_geometry(solution, hand, None)
    except CommandError as error:
        raise CommandError(f"{source}: {error}{other}") from None


def _solved(batch: SavedBatch, hand: Hand | None, obj: GraspObject | None) -> list[GraspSolution]:
    from clench.kernels.runtime.warming import warm_up

    if hand is None or obj is None:
        what, model = ("hand", batch.hand_model) if hand is None else ("object", batch.object_model)
        raise FileError(batch.path, f"{what}_model: '{model}' cannot be loaded; give --{what}.")
    warm_up()
    return list(batch.solutions(hand, obj))


def _load(load: Any, given: str | None, named: str, notes: list[str]) -> Any:
    """Return the given model, or the named one; None, and a note, if no model of this name can be loaded."""
    if given is not None or not named:
        return load(given) if given is not None else None
    try:
        return load(named)
    except (FileError, UnknownNameError) as error:
        notes.append(f"Written without the model that the solution names: {error}")
        return None
