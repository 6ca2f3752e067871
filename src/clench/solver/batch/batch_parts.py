"""Keep the parts of a batch on disk: after an interruption, the next run continues from the solved parts."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

import msgspec

from clench.core.caching.fingerprint import fingerprint
from clench.core.exceptions import FileError
from clench.core.files.array_files import read_arrays
from clench.core.files.json_files import check_folder, check_writable, read_json, write_json
from clench.core.pose import FloatArray, Pose
from clench.scoring.calibration import calibration_of

from .batch_loading import COLUMNS, batch_of, is_whole
from .grasp_batch import GraspBatch, Question

SCHEMA: Final = "clench.batch_parts/1"
#: Attributes of a hand that do not affect a solve.
_UNUSED: Final = frozenset({"path", "findings", "spec_xml", "assets"})


class PartsNote(msgspec.Struct):
    """Describe the parts in a folder: fingerprint of their question, and the largest number of poses of each."""

    schema: str
    question: str
    hand: str
    object: str
    poses: int
    chunk: int


class BatchParts:
    """Keep the parts of a batch in `FILE.parts`, a folder beside the file that the whole batch is written to.

    Args:
        path: the file (.npz) to come. question: the request. chunk: poses of a part; a continued run keeps the chunk of
            the run before.
        asked: everything else that the answers depend on, arrays and plain values.

    Raises:
        FileError: the file or the folder cannot be written, or the folder holds parts of another batch.
    """

    def __init__(self, path: str | Path, question: Question, chunk: int, poses: int, asked: tuple[Any, ...]) -> None:
        check_batch_file(path)
        self._path, self._folder = Path(path), parts_folder(path)
        self._note = PartsNote(
            SCHEMA, question_fingerprint(question, asked), question.hand.name, question.obj.name, poses, chunk
        )
        if self._question.exists() or self._parts():
            self._note.chunk = self._found().chunk
        self.chunk = self._note.chunk

    def part(
        self, number: int, names: Mapping[str, Any], rows: FloatArray, solve: Callable[[], GraspBatch]
    ) -> GraspBatch:
        """Return a part as an earlier run wrote it, or solve and write it.

        Args:
            number: of the part. names: the fields of a batch that are not per pose.
            rows: its poses of the hand, (N, 7).

        Raises:
            FileError: it cannot be written.
        """
        part = self._read(number, names, rows)
        if part is None:
            part = solve()
            self._write(number, part)
        return part

    def _write(self, number: int, part: GraspBatch) -> None:
        if not self._question.is_file():
            try:
                self._folder.mkdir(exist_ok=True)
            except OSError as error:
                raise FileError(self._folder, f"cannot be made a folder ({error.strerror or error}).") from None
            write_json(self._question, msgspec.to_builtins(self._note), "question")
        part.save(self._part(number))

    def finish(self, batch: GraspBatch) -> None:
        """Write the whole batch to its file, and remove the parts.

        Raises:
            FileError: the file cannot be written.
        """
        batch.save(self._path)
        # The note goes last: a run that is ended here leaves a folder that the next one can go on with.
        for part in self._parts():
            part.unlink(missing_ok=True)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _read(self, number: int, names: Mapping[str, Any], rows: FloatArray) -> GraspBatch | None:
        """Return a part that is there and whole, or None."""
        try:
            found = read_arrays(self._part(number), COLUMNS)
        except FileError:
            return None
        if not is_whole(found, names, rows):
            return None
        return batch_of(found, names)

    @property
    def _question(self) -> Path:
        return self._folder / "question.json"

    def _parts(self) -> list[Path]:
        return sorted(self._folder.glob("*.npz"))

    def _part(self, number: int) -> Path:
        return self._folder / f"{number:08d}.npz"

    def _found(self) -> PartsNote:
        """Return the note of a folder of parts.

        Raises:
            FileError: there is none, or it is about something else.
        """
        advice = "give --out another name, or remove the folder."
        try:
            note = msgspec.convert(read_json(self._question), PartsNote)
        except (FileError, msgspec.ValidationError):
            raise FileError(self._folder, f"holds no parts of a batch that could be gone on with; {advice}") from None
        if (note.schema, note.question) != (SCHEMA, self._note.question) or note.chunk < 1:
            raise FileError(
                self._folder,
                f"holds parts of another batch ({note.hand} on {note.object}, {note.poses} poses): hand, object, "
                f"poses, command or version differ; {advice}",
            )
        return note


def parts_folder(path: str | Path) -> Path:
    """Return the folder of the parts of a file."""
    return Path(f"{path}.parts")


def check_batch_file(path: str | Path) -> None:
    """Refuse a file that a batch and its parts cannot be written to.

    Raises:
        FileError: no .npz, or it cannot be written.
    """
    if Path(path).suffix != ".npz":
        raise FileError(path, "expected a file that ends in .npz.")
    check_writable(path)
    check_folder(parts_folder(path))


def question_fingerprint(question: Question, asked: tuple[Any, ...]) -> str:
    """Return the fingerprint of everything that the answers of a batch depend on.

    Args:
        question: hand, object and command, whose own poses play no part. asked: the rest.
    """
    from clench import __version__

    hand = [getattr(question.hand, f.name) for f in fields(question.hand) if f.name not in _UNUSED]
    criteria = calibration_of(question.command.criteria)
    command = replace(question.command, criteria=None, hand_pose=Pose.identity(), seed=None)
    # Convex pieces are for simulation. If a solve uses them, they are the shapes.
    bodies = [(b.name, b.shapes, b.role, b.closed, b.friction) for b in question.obj.bodies]
    obj = (bodies, question.obj.pose, question.obj.collision_source)
    return fingerprint(__version__, hand, obj, command, criteria, question.preshapes, asked)
