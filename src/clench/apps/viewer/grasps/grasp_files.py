"""Files of grasps as lists to look through: solutions, plans, records, batches, datasets, and other programs' files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

import clench
from clench.core.exceptions import CommandError, FileError
from clench.core.files.json_files import read_json
from clench.core.pose import FloatArray, Pose
from clench.execution.executing import missing_obstacles
from clench.execution.simulation.piece_hold import command_of
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

from .listed_grasp import ListedGrasp

#: So many grasps of a file are listed.
MOST_LISTED: Final = 5000
#: So many rows of a dataset are read at once.
_AT_ONCE: Final = 500
_SQLITE: Final = b"SQLite format 3\x00"


@dataclass(eq=False)
class GraspFiles:
    """Read files of grasps, and collect the hands and objects that they name.

    Args:
        load_hand, load_object: load a model by its name; the object's scale and geometry are given, too.
        hand, object: models that were given, instead of those that files name.
        around: adds what is around an object at its pose; None: nothing.
        hands, objects: the loaded models, by the name on the shelf. hand_models, object_models: their names in files.
    """

    load_hand: Callable[[str], Hand]
    load_object: Callable[[str, float, str], GraspObject]
    hand: str | None = None
    object: str | None = None
    around: Callable[[GraspObject, Pose | None], GraspObject] | None = None
    hands: dict[str, Hand] = field(default_factory=dict)
    objects: dict[str, GraspObject] = field(default_factory=dict)
    hand_models: dict[str, str] = field(default_factory=dict)
    object_models: dict[str, str] = field(default_factory=dict)
    _known: dict[tuple[Any, ...], str] = field(default_factory=dict)

    def read(self, path: Path) -> list[ListedGrasp]:
        """Return the grasps of a file or of the folder of a dataset.

        Raises:
            FileError: missing, malformed, or it names no model and none was given. ClenchError: a model is missing.
        """
        if os.path.isdir(path) or path.suffix == ".parquet":
            found = self._dataset(path)
        elif not os.path.isfile(path):
            raise FileError(path, "no such file.")
        elif _begins(path, _SQLITE):
            found = self._record(path)
        elif path.suffix == ".npz":
            found = self._batch(path)
        elif path.suffix == ".json":
            found = self._json(path)
        else:
            found = self._foreign(path)
        listed = [grasp for _, grasp in zip(range(MOST_LISTED), found, strict=False)]
        if not listed:
            raise FileError(path, "holds no grasps.")
        return listed

    def _json(self, path: Path) -> Iterator[ListedGrasp]:
        data = read_json(path)
        schema = str(data.get("schema", "")) if isinstance(data, dict) else ""
        if schema.startswith("clench.plan/"):
            return self._plan(path, data)
        listed = data if isinstance(data, list) else [data]
        if all(isinstance(each, dict) and str(each.get("schema", "")).startswith("clench.") for each in listed):
            return self._solutions(path, listed)
        return self._foreign(path)

    def _solutions(self, path: Path, listed: list[Any]) -> Iterator[ListedGrasp]:
        for number, document in enumerate(listed):
            source = f"{path}[{number}]" if len(listed) > 1 else str(path)
            solution = GraspSolution.from_dict(document, source)
            name = f"{path.stem} {number + 1}" if len(listed) > 1 else path.stem
            yield self.of_solution(solution, name, source, score=_epsilon(solution))

    def _plan(self, path: Path, data: dict[str, Any]) -> Iterator[ListedGrasp]:
        grasps = data.get("grasps")
        if not isinstance(grasps, list):
            raise FileError(path, "grasps: expected a list of planned grasps.")
        for number, entry in enumerate(grasps):
            if not isinstance(entry, dict):
                raise FileError(path, f"grasps[{number}]: expected an object.")
            source = f"{path}: grasps[{number}].solution"
            solution = GraspSolution.from_dict(entry.get("solution"), source)
            test = entry.get("hold")
            held = bool(test.get("held")) if isinstance(test, dict) else None
            score = entry.get("score")
            grasp = self.of_solution(solution, f"grasp {number + 1}", source, score=score, held=held)
            yield replace(grasp, kind=str(entry.get("kind") or ""))

    def _record(self, path: Path) -> Iterator[ListedGrasp]:
        with clench.Record(path) as record:
            held = dict(record.outcomes())
            for entry in record.find(limit=MOST_LISTED):
                solution = record.read(entry.id)
                source = f"{path}, solve {entry.id}"
                score = _epsilon(solution)
                yield self.of_solution(solution, f"solve {entry.id}", source, score=score, held=held.get(entry.id))

    def _batch(self, path: Path) -> Iterator[ListedGrasp]:
        from clench.solver.batch.saved_question import SavedBatch

        batch = SavedBatch(path)
        hand = self._hand(batch.hand_model, str(path))
        geometry = batch.object_scale, batch.object_collision_source
        obj = self._object(batch.object_model, *geometry, str(path), batch.object_pose)
        for number, solution in enumerate(batch.solutions(self.hands[hand], self.objects[obj])):
            yield _listed(solution, f"pose {number + 1}", hand, obj, self.hands[hand], _epsilon(solution), None)

    def _dataset(self, path: Path) -> Iterator[ListedGrasp]:
        import clench.dataset

        dataset = clench.dataset.open(path)
        rows = (row for table in dataset.tables(_AT_ONCE) for row in table.to_pylist())
        for number, row in enumerate(rows):
            source = f"{path}: row {number}"
            hand = self._hand(row["hand_model"], source)
            there = Pose(row["T_world_object"][4:], row["T_world_object"][:4])
            obj = self._object(row["object_model"], row["scale"], row["object_collision_source"], source, there)
            reason = "" if row["ok"] else f"{row['stage'] or 'failed'}: {row['reason'] or 'no reason'}"
            yield ListedGrasp(
                f"row {number}",
                hand,
                obj,
                Pose(row["T_object_palm"][4:], row["T_object_palm"][:4]),
                command=partial(_of_row, dataset, number, there),
                status="grasp" if row["ok"] else "",
                kind=row["kind"],
                score=row["score"],
                held=row["held"],
                rejected=reason,
                posture=partial(np.array, row["touch"]),
            )

    def _foreign(self, path: Path) -> Iterator[ListedGrasp]:
        """Read the grasps of another program, which name neither a hand nor an object of ours."""
        for grasp in clench.import_grasps(path):
            hand = self._hand("", str(path))
            obj = self._object("", 1.0, CollisionSource.RAW, str(path), grasp.object_pose)
            command = grasp.command(self.hands[hand])
            T = grasp.object_pose.inverse() @ command.hand_pose
            yield ListedGrasp(grasp.name, hand, obj, T, command=partial(_same, command), score=grasp.confidence)

    def of_solution(
        self, solution: GraspSolution, name: str, source: str, score: float | None = None, held: bool | None = None
    ) -> ListedGrasp:
        """Return a solution as a grasp of the list.

        Raises:
            FileError: it names no models, and none were given. ClenchError: a model is missing, or another one.
        """
        hand = self._hand(solution.hand_model, source)
        geometry = solution.object_scale, solution.object_collision_source
        obj = self._object(solution.object_model, *geometry, source, solution.object_pose)
        missing = missing_obstacles(solution, self.objects[obj])
        if missing:
            warnings.warn(f"{source}: the solution was computed {missing}.", stacklevel=2)
        return _listed(solution, name, hand, obj, self.hands[hand], score, held)

    def _hand(self, model: str, source: str) -> str:
        model = self.hand or model
        if not model:
            raise FileError(source, "names no hand; give --hand.")
        key = ("hand", model)
        if key not in self._known:
            hand = self.load_hand(model)
            self._known[key] = _free_name(hand.name, self.hands)
            self.hands[self._known[key]] = hand
            self.hand_models[self._known[key]] = model
        return self._known[key]

    def _object(self, model: str, scale: float, geometry: str, source: str, pose: Pose | None) -> str:
        model = self.object or model
        if not model:
            raise FileError(source, "names no object; give --object.")
        place = None if self.around is None or pose is None else pose.wxyz_xyz.tobytes()
        key = ("object", model, scale, str(geometry), place)
        if key not in self._known:
            obj = self.load_object(model, scale, geometry)
            obj = obj if self.around is None else self.around(obj, pose)
            self._known[key] = _free_name(obj.name, self.objects)
            self.objects[self._known[key]] = obj
            self.object_models[self._known[key]] = model
        return self._known[key]


def same_command(solution: GraspSolution, hand: Hand) -> GraspCommand:
    """Return a command that solves to a solution.

    Raises:
        CommandError: the solution is of another hand.
    """
    missing = [name for name in hand.joint_names if name not in solution.open_angles]
    if missing:
        raise CommandError(f"the solution does not fit hand '{hand.name}': joint '{missing[0]}' is missing.")
    return replace(command_of(solution, hand), next_steps=solution.next_steps)


def _listed(
    solution: GraspSolution, name: str, hand: str, obj: str, model: Hand, score: float | None, held: bool | None
) -> ListedGrasp:
    return ListedGrasp(
        name,
        hand,
        obj,
        solution.object_pose.inverse() @ solution.hand_pose,
        command=partial(same_command, solution, model),
        status=solution.status.value,
        kind=_kind(solution, model),
        score=score,
        held=held,
        posture=partial(_angles, solution, model),
    )


def _kind(solution: GraspSolution, hand: Hand) -> str:
    found = clench.mechanics.grasp_kind(solution, hand) if solution.contacts else None
    return "" if found is None else str(found)


def _angles(solution: GraspSolution, hand: Hand) -> FloatArray:
    return np.array([solution.joint_angles.get(j.name, j.open_value) for j in hand.joints])


def _of_row(dataset: Any, number: int, object_pose: Pose) -> GraspCommand:
    command: GraspCommand = dataset.command(number)
    return replace(command, object_pose=object_pose, planes=GraspCommand.planes)


def _same(command: GraspCommand) -> GraspCommand:
    return command


def _epsilon(solution: GraspSolution) -> float | None:
    found = (solution.quality or {}).get("epsilon")
    return float(found) if isinstance(found, int | float) else None


def _begins(path: Path, with_bytes: bytes) -> bool:
    try:
        with open(path, "rb") as file:
            return file.read(len(with_bytes)) == with_bytes
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None


def _free_name(name: str, taken: Mapping[str, Any]) -> str:
    return next(n for n in (name, *(f"{name} ({k})" for k in range(2, 10_000))) if n not in taken)
