"""A unit's result made up from its seed at once, and a program that generates a dataset of such, to be killed."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

import numpy as np

from clench.dataset.jobs.job import DatasetJob, job_from, read_job
from clench.dataset.jobs.units import Unit
from clench.dataset.running.generating import generate
from clench.dataset.running.unit_run import UnitRecord, UnitResult
from clench.dataset.storage.columns import COLUMNS
from clench.dataset.storage.part_files import encode_part, sha256

JOINTS = ("a", "b", "c")


def make_result(job: DatasetJob, unit: Unit) -> UnitResult:
    """Return rows that have every type of column, and nulls."""
    rng = np.random.default_rng(unit.seed)
    rows = [make_row(unit, number, rng) for number in range(unit.count)]
    record = UnitRecord.of(
        unit,
        rows=len(rows),
        ok=sum(row["ok"] for row in rows),
        proposed=4 * unit.count,
        closed=3 * unit.count,
        force_closed=2 * unit.count,
        rejected={"no opposition": unit.count},
        hand_hash="h",
        object_hash="o",
    )
    part = encode_part(rows, record.content(job.hash), {unit.hand: {"joints": JOINTS, "links": ["palm"]}})
    return UnitResult(UnitRecord(**(record.__dict__ | {"sha256": sha256(part)})), part)


def make_row(unit: Unit, number: int, rng: np.random.Generator) -> dict[str, object]:
    ok, contacts = bool(number % 3), 1 + number % 4
    of = {
        "text": "x",
        "whole": number,
        "number": float(rng.random()),
        "truth": bool(number % 2),
        "pose": [1.0, 0.0, 0.0, 0.0, *rng.random(3).tolist()],
        "texts": ["f"] * contacts,
        "numbers": rng.random(len(JOINTS)).tolist(),
        "points": rng.random((contacts, 3)).tolist(),
    }
    row = {name: None if column.nullable and not ok else of[column.type] for name, column in COLUMNS.items()}
    known = {"hand_model": unit.hand, "object_model": unit.object, "scale": unit.scale, "unit": unit.key, "ok": ok}
    failed = {"stage": None, "reason": None} if ok else {"stage": "squeeze", "reason": "no squeeze within limits"}
    return row | known | failed | {"proposal": number}


def slowly(job: DatasetJob, units: list[Unit], seconds: float = 0.02) -> Iterator[UnitResult]:
    for unit in units:
        time.sleep(seconds)
        yield make_result(job, unit)


if __name__ == "__main__":
    generate(job_from(read_job(sys.argv[1]), "job"), sys.argv[2], runner=slowly)
