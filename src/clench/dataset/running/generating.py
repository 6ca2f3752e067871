"""Generate a dataset: do the units of a shard that are not done yet, and merge when all units of the job are."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError
from clench.dataset.jobs.job import DatasetJob, check_objects
from clench.dataset.jobs.shards import Shard
from clench.dataset.jobs.sources import load_hand
from clench.dataset.jobs.units import Unit
from clench.dataset.storage.columns import need_pyarrow
from clench.dataset.storage.folder import DatasetFolder
from clench.dataset.storage.merging import Merged, merge

from .unit_run import UnitRecord, UnitResult
from .workers import run_units

#: A manifest is written at most this often [s], and at the end; parts describe their own content.
MANIFEST_INTERVAL: Final = 5.0
#: A process that has had more memory than this is replaced [GB].
MEMORY: Final = 4.0
#: Units of a shard at most: its manifest is one file.
MOST_UNITS: Final = 10_000

#: Runs units and yields the result of each.
Runner = Callable[[DatasetJob, list[Unit]], Iterator[UnitResult]]
#: Called first with the records of earlier runs, then with every new record.
Told = Callable[[UnitRecord], None]


@dataclass
class GenerateReport:
    """The result of a run.

    Args:
        folder: of the dataset. shard: of the run. units: of the shard. found: of them were done before.
        records: of the units of the shard, in order. seconds: that this run took.
        merged: the merged dataset, None while units of other shards are missing. missing: how many these are.
    """

    folder: Path
    shard: Shard
    units: int
    found: int
    records: list[UnitRecord] = field(default_factory=list)
    seconds: float = 0.0
    merged: Merged | None = None
    missing: int = 0

    @property
    def failed(self) -> list[UnitRecord]:
        """The units that could not be done."""
        return [record for record in self.records if record.status == "failed"]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, schema `clench.generate/1`."""
        rejected: Counter[str] = Counter()
        for record in self.records:
            rejected.update(record.rejected)
        closed = sum(record.closed for record in self.records)
        return {
            "schema": "clench.generate/1",
            "out": str(self.folder),
            "shard": str(self.shard),
            "units": self.units,
            "done_before": self.found,
            "failed": [{"unit": r.unit, "hand": r.hand, "object": r.object, "reason": r.reason} for r in self.failed],
            "rows": sum(record.rows for record in self.records),
            "ok": sum(record.ok for record in self.records),
            "proposed": sum(record.proposed for record in self.records),
            "closed": closed,
            "yield": sum(record.force_closed for record in self.records) / closed if closed else None,
            "rejected": dict(sorted(rejected.items())),
            "seconds": self.seconds,
            "missing_units": self.missing,
            "merged": None if self.merged is None else self.merged.to_dict(),
        }


def generate(
    job: DatasetJob,
    out: str | Path,
    *,
    shard: Shard | None = None,
    workers: int | None = None,
    memory: float = MEMORY,
    tell: Told | None = None,
    runner: Runner | None = None,
) -> GenerateReport:
    """Generate the grasps of a job, or of a shard of it, in a folder; go on where an ended run stopped.

    Every unit that is done is a whole file. When all units of the job exist, the rows are merged into `grasps.parquet`.
    Its bytes are the same for any number of workers, shards and interruptions (docs/dataset.md).

    Args:
        job: content of the dataset. out: the folder; it is made. shard: which units are this run's; all by default.
        workers: processes; all cores by default, 0 works in this process.
        memory: a process that has had more is replaced after its unit [GB].
        tell: called with the record of every unit. runner: does the units instead of processes of this machine.

    Raises:
        ClenchError: pyarrow is missing, a hand does not load, an object does not exist, or the folder holds something
            else. Nothing is written then.
    """
    need_pyarrow()
    count = (os.cpu_count() or 1) if workers is None else workers
    if count < 0:
        raise CommandError(f"workers: expected a whole number of at least 0, got {count}.")
    if not memory > 0.0:
        raise CommandError(f"memory: expected a number above 0 GB, got {memory!r}.")
    folder, shard = DatasetFolder(out, job), shard or Shard()
    folder.check()
    check_objects(job)
    for model in job.hands:
        job.options(1, 0).sets_of_fingers(load_hand(model))
    units = [unit for unit in job.units() if shard.has(unit)]
    if len(units) > MOST_UNITS:
        raise CommandError(
            f"shard: {len(units)} units are too many for one run; give larger ones with unit, or more shards: "
            f"up to {MOST_UNITS} units each."
        )
    records = folder.done(units)
    waiting = [unit for unit in units if unit.key not in records]
    report = GenerateReport(folder.path, shard, len(units), len(records))
    folder.prepare()
    folder.clear(units)
    for record in records.values():
        if tell is not None:
            tell(record)
    run = runner or (lambda asked, some: run_units(asked, some, count, memory))
    began = time.perf_counter()
    _keep_all(folder, shard, units, records, run(job, waiting), tell)
    report.records = [records[unit.key] for unit in units]
    report.seconds = time.perf_counter() - began
    known = folder.manifests()
    report.missing = sum(unit.key not in known for unit in job.units())
    if not report.missing and any(record.status == "done" for record in known.values()):
        report.merged = merge(folder.path)
    return report


def _keep_all(
    folder: DatasetFolder,
    shard: Shard,
    units: list[Unit],
    records: dict[str, UnitRecord],
    results: Iterable[UnitResult],
    tell: Told | None,
) -> None:
    """Write the results of units, and the manifest from time to time and at the end, even after an interruption."""
    written = time.monotonic()
    folder.write_manifest(shard, records, units)
    try:
        for result in results:
            folder.keep(result)
            records[result.record.unit] = result.record
            if tell is not None:
                tell(result.record)
            if time.monotonic() - written > MANIFEST_INTERVAL:
                folder.write_manifest(shard, records, units)
                written = time.monotonic()
    finally:
        folder.write_manifest(shard, records, units)
