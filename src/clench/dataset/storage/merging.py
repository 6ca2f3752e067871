"""Merge the parts of a dataset into one file, with a manifest and a card.

The bytes of the file do not depend on who made the parts.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from clench import __version__
from clench.core.exceptions import FileError
from clench.core.files.json_files import write_json
from clench.dataset.jobs.units import Unit
from clench.dataset.running.unit_run import UnitRecord

from .columns import need_pyarrow
from .folder import MANIFEST_FILE, MANIFEST_SCHEMA, ROWS_FILE, DatasetFolder, whole_file
from .part_files import HANDS_KEY, metadata_of, open_parquet, read_rows, with_metadata, writing_options

if TYPE_CHECKING:
    import pyarrow

#: Rows per group of the merged file: the unit of reading.
GROUP: Final = 4096
#: Bytes of a file per step of hashing.
_BLOCK: Final = 1 << 20


@dataclass(frozen=True)
class Merged:
    """The merged dataset.

    Args:
        file: with all rows. sha256: of it. rows: how many, and how many of them are `ok`. bytes: its size.
        units, failed: how many units there are, and how many of them could not be done.
    """

    file: Path
    sha256: str
    rows: int
    ok: int
    bytes: int
    units: int
    failed: int

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form."""
        return {**self.__dict__, "file": str(self.file)}


def merge(path: str | Path) -> Merged:
    """Merge the parts of a folder into `grasps.parquet`, and write `manifest.json` and `DATASET.md`.

    Folders that several machines wrote may be copied over one another first: no two parts have one name.

    Args:
        path: the folder.

    Raises:
        ClenchError: pyarrow is missing. FileError: no dataset, a unit of the job is missing, a part cannot be read, or
            two parts were made from different models.
    """
    from .card import write_card

    need_pyarrow()
    folder = DatasetFolder.open(path)
    units = list(folder.job.units())
    done, known = folder.done(units), folder.manifests()
    records = {unit.key: done.get(unit.key) or known.get(unit.key) for unit in units}
    missing = [unit for unit in units if not _is_there(unit, done, records)]
    if missing:
        raise FileError(
            path,
            f"{len(missing)} of {len(units)} units are missing, first {missing[0].in_words()}; run their shards, or "
            "'clench generate' without --shard, and merge then.",
        )
    found = [record for record in records.values() if record is not None]
    _check_models(folder, found)
    if not done:
        raise FileError(path, f"holds no part: all {len(units)} units failed, first with: {found[0].reason}")
    hands = _hands(folder, [unit for unit in units if unit.key in done])
    content = {"job": folder.job.hash, "keys": folder.job.document(), "clench_version": __version__}
    file = folder.path / ROWS_FILE
    with whole_file(file) as temporary:
        _write(temporary, _tables(folder, [unit for unit in units if unit.key in done]), with_metadata(content, hands))
    merged = Merged(
        file,
        _hash(file),
        rows=sum(record.rows for record in found),
        ok=sum(record.ok for record in found),
        bytes=file.stat().st_size,
        units=len(units),
        failed=sum(record.status == "failed" for record in found),
    )
    _write_manifest(folder, found, merged)
    write_card(folder, found, merged)
    return merged


def _is_there(unit: Unit, done: Mapping[str, UnitRecord], records: Mapping[str, UnitRecord | None]) -> bool:
    record = records[unit.key]
    return unit.key in done or (record is not None and record.status == "failed")


def _check_models(folder: DatasetFolder, records: list[UnitRecord]) -> None:
    """Refuse parts that were made from different files of one model.

    Raises:
        FileError: there are some.
    """
    first: dict[tuple[Any, ...], tuple[str, UnitRecord]] = {}
    for record in records:
        hashes = ((record.hand,), record.hand_hash), ((record.object, record.scale), record.object_hash)
        for model, found in hashes:
            if found is None:
                continue
            seen, other = first.setdefault(model, (found, record))
            if seen != found:
                raise FileError(
                    folder.part(record.unit),
                    f"was made from another '{model[0]}' than '{folder.part(other.unit).name}': the model has changed "
                    "since, or differs between machines. Remove the parts of one of them, and generate them again.",
                )


def _hands(folder: DatasetFolder, units: list[Unit]) -> dict[str, Any]:
    """Return the parts' data about hands, by model, including parts without a row."""
    found: dict[str, Any] = {}
    for unit in units:
        if unit.hand not in found:
            file = folder.part(unit.key)
            found |= metadata_of(open_parquet(file, str(file)), HANDS_KEY, str(file))
    return found


def _tables(folder: DatasetFolder, units: list[Unit]) -> Iterator[pyarrow.Table]:
    """Yield the rows of all parts, in the order of the units.

    Raises:
        FileError: a part cannot be read.
    """
    for unit in units:
        file = folder.part(unit.key)
        yield read_rows(open_parquet(file, str(file)), str(file)).replace_schema_metadata(None)


def _write(path: Path, tables: Iterator[pyarrow.Table], schema: pyarrow.Schema) -> None:
    """Write rows in groups of one size, however they come."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    with pq.ParquetWriter(path, schema, **writing_options()) as writer:
        waiting = schema.empty_table()
        for table in tables:
            waiting = pa.concat_tables([waiting, table.replace_schema_metadata(schema.metadata)])
            while len(waiting) >= GROUP:
                writer.write_table(_copied(waiting.slice(0, GROUP)), row_group_size=GROUP)
                waiting = waiting.slice(GROUP)
        if len(waiting):
            writer.write_table(_copied(waiting), row_group_size=GROUP)


def _copied(table: pyarrow.Table) -> pyarrow.Table:
    """Return the rows in one piece: the written bytes must not depend on the pieces."""
    return table.combine_chunks()


def _write_manifest(folder: DatasetFolder, records: list[UnitRecord], merged: Merged) -> None:
    rejected: Counter[str] = Counter()
    for record in records:
        rejected.update(record.rejected)
    document = {
        "schema": MANIFEST_SCHEMA,
        "clench_version": __version__,
        "job": folder.job.hash,
        "file": ROWS_FILE,
        "sha256": merged.sha256,
        "rows": merged.rows,
        "ok": merged.ok,
        "rejected": dict(sorted(rejected.items())),
        "units": [record.same() for record in records],
    }
    write_json(folder.path / MANIFEST_FILE, document, "manifest")


def _hash(path: Path) -> str:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()
