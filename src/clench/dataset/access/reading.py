"""Read a dataset: rows, batches as arrays, and grasps that are solved again."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import ClenchError, CommandError, FileError, UnknownNameError
from clench.core.pose import Pose
from clench.dataset.jobs.sources import load_hand, load_object
from clench.dataset.storage.columns import COLUMNS, need_pyarrow
from clench.dataset.storage.folder import ROWS_FILE, DatasetFolder
from clench.dataset.storage.part_files import CONTENT_KEY, HANDS_KEY, metadata_of, open_parquet
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

if TYPE_CHECKING:
    import pyarrow

#: Largest difference between the angles of a dataset and of a repeated solve on another machine [rad].
_SAME = 1e-6


def open(path: str | Path) -> GraspDataset:
    """Return the dataset of a folder, or of a Parquet file of grasps; its rows are read when they are asked for.

    Raises:
        ClenchError: pyarrow is missing. FileError: the file is no dataset, is not merged, or has another schema.
    """
    need_pyarrow()
    file = Path(path)
    if file.is_dir():
        folder, file = DatasetFolder.open(file), file / ROWS_FILE
        if not file.is_file():
            done = len(list((folder.path / "parts").glob("*.parquet")))
            raise FileError(
                path,
                f"is not merged: {done} of {len(list(folder.job.units()))} units are there; run the others, or "
                f"'clench generate --merge {path}'.",
            )
    if not file.is_file():
        raise FileError(path, "no such file or folder.")
    return GraspDataset(file)


class GraspDataset:
    """A dataset of grasps, one row per grasp (docs/dataset.md).

    Args:
        path: the Parquet file. chosen: numbers of its rows that count, in order; None is all.

    Raises:
        FileError: no Parquet file, of another schema, or larger than any that clench writes.
    """

    def __init__(self, path: str | Path, chosen: NDArray[np.int64] | None = None) -> None:
        self.path = Path(path)
        sizes = [self._file.metadata.row_group(k).num_rows for k in range(self._file.metadata.num_row_groups)]
        self._first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        self._chosen = np.arange(self._first[-1]) if chosen is None else chosen

    def __len__(self) -> int:
        return len(self._chosen)

    def __repr__(self) -> str:
        return f"GraspDataset('{self.path}', {len(self)} grasps of {', '.join(self.hands)})"

    def __getstate__(self) -> dict[str, Any]:
        """Leave the open file out: another process opens it anew."""
        return {key: value for key, value in self.__dict__.items() if key != "_file"}

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns; docs/dataset.md explains them."""
        return tuple(COLUMNS)

    @cached_property
    def hands(self) -> dict[str, dict[str, Any]]:
        """Names of the joints and links of every hand, by model; joint angles of rows have this order."""
        return metadata_of(self._file, HANDS_KEY, str(self.path))

    @cached_property
    def job(self) -> dict[str, Any]:
        """Keys and values of the job that the dataset was made with."""
        keys = metadata_of(self._file, CONTENT_KEY, str(self.path)).get("keys")
        return keys if isinstance(keys, dict) else {}

    def filter(self, **conditions: Any) -> GraspDataset:
        """Return the rows for which all conditions hold.

        Args:
            conditions: by column. A value means equality, and `None` means null. A list has allowed values. A tuple
                `(least, largest)` is a range; `None` in it is an open end.

        Raises:
            UnknownNameError: no such column. CommandError: a column of lists, or a range of text.
        """
        for name in conditions:
            _check_columns([name])
            if COLUMNS[name].type not in ("text", "whole", "number", "truth"):
                raise CommandError(f"filter: '{name}' is a column of lists; expected one of single values.")
        kept = []
        for rows, table in self._parts(list(conditions)):
            fits = np.ones(len(table), dtype=np.bool_)
            for name, condition in conditions.items():
                fits &= _fits(table.column(name), condition, name)
            kept.append(rows[fits])
        return GraspDataset(self.path, np.concatenate(kept) if kept else np.empty(0, dtype=np.int64))

    def batches(self, size: int, columns: Sequence[str] | None = None) -> Iterator[dict[str, NDArray[Any]]]:
        """Yield the rows as arrays, so many at a time, in order; the last batch may have fewer.

        Nulls are NaN, and lists are padded with NaN to the longest of the batch. A truth value that may be null is 1, 0
        or -1. The joints of hands differ: filter by `hand_model` first for columns of joints that mean the same.

        Args:
            size: rows of a batch. columns: names; all by default.

        Raises:
            CommandError: a size below 1. UnknownNameError: no such column. FileError: rows cannot be read.
        """
        from .arrays import to_arrays

        for table in self.tables(size, columns):
            yield to_arrays(table)

    def torch(self, size: int, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
        """Yield batches as PyTorch tensors; columns of text are left out.

        Args, errors: as for `batches`. ClenchError: PyTorch is not installed.
        """
        try:
            import torch
        except ImportError:
            raise ClenchError("Batches of tensors need PyTorch: pip install torch.") from None
        requested = _check_columns(columns)
        numbers = [name for name in requested if COLUMNS[name].type not in ("text", "texts")]
        for batch in self.batches(size, numbers):
            yield {name: torch.from_numpy(np.array(array)) for name, array in batch.items()}

    def tables(self, size: int, columns: Sequence[str] | None = None) -> Iterator[pyarrow.Table]:
        """Yield the rows as tables of pyarrow, so many at a time; arguments and errors as `batches`."""
        import pyarrow as pa

        if size < 1:
            raise CommandError(f"size: expected a whole number of at least 1, got {size}.")
        waiting: pyarrow.Table | None = None
        for _, table in self._parts(_check_columns(columns)):
            waiting = table if waiting is None else pa.concat_tables([waiting, table])
            while len(waiting) >= size:
                yield waiting.slice(0, size)
                waiting = waiting.slice(size)
        if waiting is not None and len(waiting):
            yield waiting

    def row(self, number: int) -> dict[str, Any]:
        """Return a row as plain values; null is None.

        Raises:
            CommandError: there is no such row. FileError: it cannot be read.
        """
        if not -len(self) <= number < len(self):
            raise CommandError(f"row: expected a number below {len(self)}, got {number}.")
        place = int(self._chosen[number])
        group = int(np.searchsorted(self._first, place, side="right")) - 1
        found: dict[str, Any] = self._group(group, list(COLUMNS)).slice(place - self._first[group], 1).to_pylist()[0]
        return found

    def command(self, number: int) -> GraspCommand:
        """Return the command of a row; it solves to the same answer.

        Raises:
            CommandError: there is no such row, or its values are malformed. FileError: it cannot be read.
        """
        return _command(self.row(number), f"{self.path}: row {number}")

    def solution(self, number: int, hand: Hand | None = None, obj: GraspObject | None = None) -> GraspSolution:
        """Solve the command of a row again: the same answer, to the bit on the same kind of machine.

        Args:
            number: of the row. hand, obj: hand and object of the row; by default the models that the row names.

        Raises:
            FileError: the models differ from those of the dataset, or the answer differs.
            ClenchError: a model cannot be loaded.
        """
        from clench.solver.solve import solve

        row, name = self.row(number), f"{self.path}: row {number}"
        hand = hand or load_hand(row["hand_model"])
        obj = (obj or _object(row)).posed(_pose(row["T_world_object"], f"{name}: T_world_object"))
        solution = solve(hand, obj, _command(row, name))
        if solution.geometry_hash != f"{row['hand_hash']}+{row['object_hash']}":
            which = "hand" if solution.geometry_hash.partition("+")[0] != row["hand_hash"] else "object"
            raise FileError(name, f"was made from another model of {which} '{row[which]}' than is loaded here.")
        touch = [solution.joint_angles[joint] for joint in hand.joint_names]
        if len(touch) != len(row["touch"]) or not np.allclose(touch, row["touch"], rtol=0.0, atol=_SAME):
            raise FileError(name, "solved again, it has other joint angles than the dataset says.")
        pregrasp = row["pregrasp"]
        if pregrasp is None or len(pregrasp) != len(touch):
            return solution
        return replace(solution, pregrasp=dict(zip(hand.joint_names, pregrasp, strict=True)))

    @cached_property
    def _file(self) -> Any:
        return open_parquet(os.fspath(self.path), str(self.path))

    def _parts(self, columns: list[str]) -> Iterator[tuple[NDArray[np.int64], pyarrow.Table]]:
        """Yield the chosen rows group by group: their numbers, and some columns of them."""
        for group in range(len(self._first) - 1):
            low, high = self._first[group], self._first[group + 1]
            rows = self._chosen[(self._chosen >= low) & (self._chosen < high)]
            if len(rows):
                table = self._group(group, columns)
                yield rows, table if len(rows) == high - low else table.take(rows - low)

    def _group(self, number: int, columns: list[str]) -> pyarrow.Table:
        import pyarrow as pa

        try:
            table = self._file.read_row_group(number, columns=columns)
            table.validate(full=True)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise FileError(self.path, f"its rows cannot be read ({' '.join(str(error).split())}).") from None
        return table


def _check_columns(columns: Sequence[str] | None) -> list[str]:
    for name in columns or ():
        if name not in COLUMNS:
            raise UnknownNameError("column", name, "the dataset", COLUMNS)
    return list(COLUMNS if columns is None else columns)


def _fits(column: pyarrow.ChunkedArray, condition: Any, name: str) -> NDArray[np.bool_]:
    """Return which values of a column fit a condition; null fits None alone."""
    import pyarrow as pa
    import pyarrow.compute as pc

    try:
        if condition is None:
            found = pc.is_null(column)
        elif isinstance(condition, tuple):
            least, largest = condition
            found = pc.is_valid(column)
            if least is not None:
                found = pc.and_(found, pc.greater_equal(column, least))
            if largest is not None:
                found = pc.and_(found, pc.less_equal(column, largest))
        elif isinstance(condition, list):
            found = pc.is_in(column, value_set=pa.array(condition, column.type))
        else:
            found = pc.equal(column, pa.scalar(condition, column.type))
    except (pa.ArrowException, ValueError, TypeError):
        raise CommandError(
            f"filter: {name}: expected a value of type {column.type}, a list of them, (least, largest) or None, "
            f"got {condition!r}."
        ) from None
    return np.asarray(pc.fill_null(found, False).to_numpy(), dtype=np.bool_)


def _object(row: dict[str, Any]) -> GraspObject:
    return load_object(row["object_model"], row["scale"], row["object_collision_source"] == CollisionSource.ENGINE)


def _command(row: dict[str, Any], name: str) -> GraspCommand:
    joints, angles = row["preshape_joints"], row["preshape_angles"]
    if len(joints) != len(angles):
        raise CommandError(f"{name}: preshape_angles: expected {len(joints)} angles, got {len(angles)}.")
    return GraspCommand(
        hand_pose=_pose(row["T_world_palm"], f"{name}: T_world_palm"),
        preshape=dict(zip(joints, angles, strict=True)),
        fingers=None if row["fingers"] is None else tuple(row["fingers"]),
        planes=1,
    )


def _pose(numbers: Sequence[float], name: str) -> Pose:
    return Pose(numbers[4:], wxyz=numbers[:4], key=name)
