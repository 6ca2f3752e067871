"""Write a dataset in other formats: HDF5, DexGraspBench npy, isaac_grasp YAML."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.exceptions import ClenchError, FileError, UnknownNameError
from clench.core.extras import how_to_install
from clench.core.files.json_files import check_folder, check_writable
from clench.dataset.jobs.sources import load_hand, load_object
from clench.dataset.storage.columns import COLUMNS, SCHEMA
from clench.dataset.storage.folder import whole_file
from clench.execution.formats.dexgraspbench import write_dexgraspbench
from clench.execution.formats.grasp_posture import BASE
from clench.execution.formats.isaac_grasp import write_isaac_grasp
from clench.execution.formats.outgoing import HELD, ExportSettings, OutgoingGrasp, outgoing

from .arrays import spans, to_arrays
from .reading import GraspDataset

#: Columns with as many numbers as the hand has joints.
_JOINTS: Final = ("pregrasp", "touch", "squeeze")
#: Rows per write to HDF5.
_ROWS: Final = 4096


class DatasetFormat(StrEnum):
    """Name the formats that a dataset is written in."""

    HDF5 = "hdf5"
    """one file with all rows, a group for every hand"""
    DEXGRASPBENCH = "dexgraspbench"
    """a folder for every hand, object and scale, with an npy file for every grasp"""
    ISAAC_GRASP = "isaac_grasp"
    """a YAML file for every hand, object and scale"""


def export(dataset: GraspDataset, path: str | Path, format: DatasetFormat | str) -> tuple[Path, ...]:
    """Write a dataset in another format, and return the files.

    HDF5 has all rows. The other formats have the rows that are `ok`, solved again; `confidence` is 1 for a grasp that
    was held in simulation.

    Args:
        dataset: the dataset; filter it first to write a part. path: the HDF5 file, or the folder.
        format: see `DatasetFormat`.

    Raises:
        UnknownNameError: no such format. FileError: a file cannot be written, or a model is another one than that of
            the dataset. ClenchError: h5py is missing, or no row is `ok`.
    """
    if format not in list(DatasetFormat):
        raise UnknownNameError("format", str(format), "datasets", [each.value for each in DatasetFormat])
    if format == DatasetFormat.HDF5:
        check_writable(path)
        _write_hdf5(dataset, Path(path))
        return (Path(path),)
    check_folder(path)
    good = dataset.filter(ok=True)
    if not len(good):
        raise ClenchError(f"{dataset.path}: none of {len(dataset)} grasps is ok; nothing to export.")
    files: list[Path] = []
    for name, rows in _pairs(good):
        grasps = [_outgoing(good, number, format) for number in rows]
        if format == DatasetFormat.ISAAC_GRASP:
            files.append(_folder(Path(path)) / f"{name}.yaml")
            write_isaac_grasp(files[-1], grasps)
            continue
        folder = _folder(Path(path) / name)
        for number, grasp in enumerate(grasps):
            files.append(folder / f"grasp_{number}.npy")
            write_dexgraspbench(files[-1], grasp)
    return tuple(files)


def _pairs(dataset: GraspDataset) -> Iterator[tuple[str, list[int]]]:
    """Yield the rows of every hand, object and scale, with a name for a file."""
    keys = ("hand_model", "object_model", "scale")
    found: dict[tuple[Any, ...], list[int]] = {}
    count = itertools.count()
    for batch in dataset.batches(_ROWS, (*keys, "hand", "object")):
        for row in zip(*(batch[key] for key in (*keys, "hand", "object")), strict=True):
            found.setdefault(row, []).append(next(count))
    for number, ((_, _, _, hand, obj), rows) in enumerate(found.items()):
        yield re.sub(r"[^A-Za-z0-9._=-]+", "_", f"{number:04d}_{hand}_{obj}")[:100], rows


def _outgoing(dataset: GraspDataset, number: int, format: DatasetFormat | str) -> OutgoingGrasp:
    """Return a row in the form that the formats write."""
    row = dataset.row(number)
    hand = load_hand(row["hand_model"])
    obj = load_object(row["object_model"], row["scale"], row["object_collision_source"] == "engine")
    solution = dataset.solution(number, hand, obj)
    friction, mass = dataset.job.get("friction"), dataset.job.get("mass")
    settings = ExportSettings(
        hand,
        obj,
        root=BASE if format == DatasetFormat.DEXGRASPBENCH else None,
        friction=tuple(friction) if isinstance(friction, list) else friction,
        mass=tuple(mass) if isinstance(mass, list) else mass,
    )
    solution = replace(solution, hand_model=row["hand_model"], object_model=row["object_model"])
    grasp = outgoing(solution, settings)
    return replace(grasp, confidence=HELD) if row["held"] else grasp


def _folder(path: Path) -> Path:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(path, f"cannot be made a folder ({error.strerror or error}).") from None
    return path


def _write_hdf5(dataset: GraspDataset, path: Path) -> None:
    """Write all rows: a group for every hand, a dataset for every column.

    Lists that differ in length lie one after another; `NAME_first` says where the list of each row begins.
    """
    try:
        import h5py
    except ImportError:
        raise ClenchError(f"HDF5 files need h5py: {how_to_install('data')}.") from None
    with whole_file(path) as temporary, h5py.File(temporary, "w", track_order=True) as file:
        file.attrs["schema"] = SCHEMA
        for number, (model, about) in enumerate(dataset.hands.items()):
            group = file.create_group(f"hand_{number}", track_order=True)
            group.attrs["hand_model"] = model
            for key in ("joints", "links"):
                group.attrs[key] = [str(name) for name in about.get(key, ())]
            rows = dataset.filter(hand_model=model)
            for table in rows.tables(_ROWS):
                _append_table(group, table, len(group.attrs["joints"]))


def _append_table(group: Any, table: Any, joints: int) -> None:
    for name, column in COLUMNS.items():
        if column.type in ("texts", "numbers", "points") and name not in _JOINTS:
            elements, first = spans(table.column(name).combine_chunks(), column.type)
            before = len(group[name]) if name in group else 0
            _append(group, name, elements, column.type == "texts")
            _append(group, f"{name}_first", first[1:] + before if f"{name}_first" in group else first, False)
            continue
        values = to_arrays(table.select([name]))[name]
        if name in _JOINTS:
            # Without any angle in the table, there is no column yet.
            values = values if values.shape[1] else np.full((len(values), joints), np.nan)
            if values.shape[1] != joints:
                raise ClenchError(f"{name}: expected {joints} angles in every row, got {values.shape[1]}.")
        if column.type == "truth" and column.nullable:
            values = values.astype(np.int8)
        _append(group, name, values, column.type == "text")


def _append(group: Any, name: str, values: Any, is_text: bool) -> None:
    """Append rows to a dataset of a group; create it if missing."""
    import h5py

    if is_text:
        values = np.array(["" if value is None else value for value in values], dtype=object)
    if name not in group:
        kind = h5py.string_dtype() if is_text else values.dtype
        shape = values.shape[1:]
        group.create_dataset(name, (0, *shape), kind, maxshape=(None, *shape), chunks=(1024, *shape))
    target = group[name]
    target.resize(len(target) + len(values), axis=0)
    target[len(target) - len(values) :] = values
