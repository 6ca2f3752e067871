"""The folder of a dataset: the job, a part per unit, a manifest per shard. All files are whole, so a run can go on."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import msgspec

from clench import __version__
from clench.core.exceptions import ClenchError, FileError
from clench.core.files.file_bytes import read_file
from clench.core.files.file_limits import ARRAY_BYTES
from clench.core.files.json_files import check_folder, read_json, write_atomically, write_json
from clench.dataset.jobs.job import SCHEMA as JOB_SCHEMA
from clench.dataset.jobs.job import DatasetJob, job_from
from clench.dataset.jobs.shards import Shard
from clench.dataset.jobs.units import Unit
from clench.dataset.running.unit_run import UnitRecord, UnitResult

from .part_files import CONTENT_KEY, metadata_of, open_parquet, read_rows, sha256

MANIFEST_SCHEMA: Final = "clench.dataset_manifest/1"
JOB_FILE: Final = "job.json"
#: The merged rows, and the merged manifest.
ROWS_FILE: Final = "grasps.parquet"
MANIFEST_FILE: Final = "manifest.json"
#: A merged file that nothing was written to for so long will not be finished [s].
_LEFT: Final = 3600.0
_ADVICE: Final = "give --out another folder, or remove this one."


class DatasetFolder:
    """The folder of a job's dataset, which may still be empty.

    Args:
        path: the folder. job: its content.
    """

    def __init__(self, path: str | Path, job: DatasetJob) -> None:
        self.path, self.job = Path(path), job

    @classmethod
    def open(cls, path: str | Path) -> DatasetFolder:
        """Return a folder with the job that it holds.

        Raises:
            FileError: no folder of a dataset, or of another version.
        """
        folder = Path(path)
        if not folder.is_dir():
            raise FileError(path, "no such folder.")
        if not (folder / JOB_FILE).is_file():
            raise FileError(path, f"holds no dataset: it has no '{JOB_FILE}'.")
        document = _document(folder / JOB_FILE, JOB_SCHEMA, "begin a new dataset with this version")
        if not isinstance(document.get("job"), dict):
            raise FileError(folder / JOB_FILE, "job: expected keys and values.")
        found = cls(folder, job_from(document["job"], str(folder / JOB_FILE)))
        if document.get("hash") != found.job.hash:
            raise FileError(folder / JOB_FILE, "hash: is not that of the job; the file was changed.")
        return found

    def check(self) -> None:
        """Refuse a folder that holds something else than this job's dataset; write nothing.

        Raises:
            FileError: it holds other files, another dataset or that of another version, or cannot be written to.
        """
        check_folder(self.path)
        if not self.path.exists():
            return
        names = sorted(os.listdir(self.path))
        if JOB_FILE not in names:
            first = next((name for name in names if not name.startswith(".")), None)
            if first is not None:
                raise FileError(self.path, f"holds other files ('{first}') and no dataset; {_ADVICE}")
            return
        found = DatasetFolder.open(self.path).job
        if found.hash != self.job.hash:
            was, asked = found.document(), self.job.document()
            keys = ", ".join(key for key in asked if was[key] != asked[key])
            raise FileError(self.path, f"holds another dataset: it differs in {keys}; {_ADVICE}")
        self.manifests()

    def prepare(self) -> None:
        """Create the folder, and write the job if it is missing.

        Raises:
            FileError: it cannot be written.
        """
        _make(self.path)
        # Before the others: a run that begins at the same time knows the folder by it.
        if not (self.path / JOB_FILE).is_file():
            document = {"schema": JOB_SCHEMA, "clench_version": __version__, "hash": self.job.hash}
            write_json(self.path / JOB_FILE, document | {"job": self.job.document()}, "job")
        for name in ("parts", "manifests"):
            _make(self.path / name)

    def part(self, key: str) -> Path:
        """Return the file of a unit's part."""
        return self.path / "parts" / f"{key}.parquet"

    def keep(self, result: UnitResult) -> None:
        """Write the part of a unit.

        Raises:
            FileError: it cannot be written.
        """
        if result.part is not None:
            write_atomically(self.part(result.record.unit), result.part)

    def clear(self, units: Sequence[Unit]) -> None:
        """Remove half-written files of some units that interrupted runs left."""
        mine = {unit.key for unit in units}
        for file in (self.path / "parts").glob(".*.part"):
            if file.name[1:].partition(".")[0] in mine:
                file.unlink(missing_ok=True)
        for file in self.path.glob(f".{ROWS_FILE}.*.part"):
            # Another run may be merging at this moment.
            if time.time() - file.stat().st_mtime > _LEFT:
                file.unlink(missing_ok=True)

    def manifests(self) -> dict[str, UnitRecord]:
        """Return the manifests' records of units, over all shards, by key; a unit that is done in any shard is done.

        Raises:
            FileError: a manifest cannot be read, or is of another job or version.
        """
        found: dict[str, UnitRecord] = {}
        for file in sorted((self.path / "manifests").glob("*.json")):
            document = _document(file, MANIFEST_SCHEMA, "remove it and the parts of its shard")
            if document.get("job") != self.job.hash:
                raise FileError(file, f"is of another dataset than '{self.path / JOB_FILE}'; remove it.")
            try:
                records = msgspec.convert(document.get("units"), list[UnitRecord])
            except msgspec.ValidationError as error:
                raise FileError(file, f"units: {error}.") from None
            for record in records:
                if record.unit not in found or record.status == "done":
                    found[record.unit] = record
        return found

    def done(self, units: Sequence[Unit]) -> dict[str, UnitRecord]:
        """Return the records of those units whose parts are there and whole, by key.

        Raises:
            FileError: a part cannot be read, was changed, or is of another job.
        """
        known, found = self.manifests(), {}
        for unit in units:
            if self.part(unit.key).exists():
                found[unit.key] = self._whole(unit, known.get(unit.key))
        return found

    def write_manifest(self, shard: Shard, records: Mapping[str, UnitRecord], units: Sequence[Unit]) -> None:
        """Write the records of a shard's units so far.

        Raises:
            FileError: it cannot be written.
        """
        document = {
            "schema": MANIFEST_SCHEMA,
            "clench_version": __version__,
            "job": self.job.hash,
            "shard": str(shard),
            "complete": all(unit.key in records for unit in units),
            "waiting": sum(unit.key not in records for unit in units),
            "units": [asdict(records[unit.key]) for unit in units if unit.key in records],
        }
        name = f"{shard.number}-of-{shard.of}.json"
        write_json(self.path / "manifests" / name, document, "manifest")

    def _whole(self, unit: Unit, known: UnitRecord | None) -> UnitRecord:
        file, again = self.part(unit.key), "remove it, and 'clench generate' makes it again."
        content = read_file(file, ARRAY_BYTES)
        said = sha256(content)
        if known is not None and known.sha256 is not None and known.sha256 != said:
            raise FileError(file, f"was changed after it was written; {again}")
        try:
            import pyarrow as pa

            read = open_parquet(pa.BufferReader(content), str(file))
            document = metadata_of(read, CONTENT_KEY, str(file))
            if known is None:
                read_rows(read, str(file))
            job = document.pop("job", None)
            record = msgspec.convert(document | {"sha256": said}, UnitRecord)
        except FileError as error:
            raise ClenchError(f"{str(error).rstrip('.')}; {again}") from None
        except msgspec.ValidationError as error:
            raise FileError(file, f"{CONTENT_KEY.decode()}: {error}; {again}") from None
        if job != self.job.hash or record.unit != unit.key or record.rows != read.metadata.num_rows:
            raise FileError(file, f"is a part of another dataset; {again}")
        return known if known is not None and known.status == "done" else record


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the path of a temporary file, which takes the place of another one once it is written.

    Raises:
        FileError: it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error}).") from None
    finally:
        temporary.unlink(missing_ok=True)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be made a folder ({error.strerror or error}).") from None


def _document(file: Path, schema: str, advice: str) -> dict[str, Any]:
    """Return a JSON document of one of our schemas and of this version."""
    document = read_json(file)
    said = document.get("schema") if isinstance(document, dict) else None
    if said != schema:
        raise FileError(file, f"schema: expected '{schema}', got '{said}'.")
    version = document.get("clench_version")
    if version != __version__:
        raise FileError(file, f"is of clench {version}, this is {__version__}; use that version, or {advice}.")
    found: dict[str, Any] = document
    return found
