"""Run a unit: plan its grasps, test them if asked, and return the rows as a part."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from clench.core.defaults import FRICTION
from clench.core.exceptions import ClenchError
from clench.dataset.jobs.job import DatasetJob
from clench.dataset.jobs.sources import hand_source, load_hand, load_object
from clench.dataset.jobs.units import Unit
from clench.dataset.storage.columns import COLUMNS
from clench.dataset.storage.part_files import encode_part, sha256
from clench.dataset.storage.rows import row_of
from clench.execution.simulation.hold import Hold, HoldReport
from clench.mechanics.grasp.contacts import friction_range
from clench.mechanics.grasp.loads import mass_range
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.planner.grasp_plan import PlannedGrasp, UnfinishedGrasp
from clench.planner.search import GraspSearch


@dataclass(frozen=True)
class UnitRecord:
    """A manifest's record of a unit.

    Args:
        unit: its key. hand, object, scale, part, count: see `Unit`.
        status: "done", or "failed" with a sentence in `reason`: the hand or the object could not be used.
        rows: how many grasps were written, and how many of them are `ok`.
        proposed, closed, force_closed, rejected: see `clench.GraspPlan`; reasons that rejected none are left out.
        hand_hash, object_hash: of the geometry; None without a row.
        sha256: of the part's file; None for a unit that failed. seconds: that it took; None where this is not known.
    """

    unit: str
    hand: str
    object: str
    scale: float
    part: int
    count: int
    status: str = "done"
    reason: str | None = None
    rows: int = 0
    ok: int = 0
    proposed: int = 0
    closed: int = 0
    force_closed: int = 0
    rejected: dict[str, int] = field(default_factory=dict)
    hand_hash: str | None = None
    object_hash: str | None = None
    sha256: str | None = None
    seconds: float | None = None

    @classmethod
    def of(cls, unit: Unit, **values: Any) -> UnitRecord:
        """Return the record of a unit."""
        return cls(unit.key, unit.hand, unit.object, unit.scale, unit.part, unit.count, **values)

    def content(self, job: str) -> dict[str, Any]:
        """Return the part's description in its file: the hash of the job, and the record without hash and time."""
        return {"job": job, **{key: value for key, value in self.same().items() if key != "sha256"}}

    def same(self) -> dict[str, Any]:
        """Return the record without the time that it took."""
        return {key: value for key, value in asdict(self).items() if key != "seconds"}


@dataclass(frozen=True)
class UnitResult:
    """The result of a unit: its record, and the bytes of its part; None for a unit that failed."""

    record: UnitRecord
    part: bytes | None


def run_unit(job: DatasetJob, unit: Unit) -> UnitResult:
    """Plan the grasps of a unit; an error becomes the record of a unit that failed.

    Args:
        job: the options. unit: the unit.
    """
    began = time.perf_counter()
    try:
        return _planned(job, unit, began)
    except ClenchError as error:
        reason = str(error)
    except Exception as error:
        reason = f"Internal error ({' '.join(f'{type(error).__name__}: {error}'.split())})."
    return UnitResult(UnitRecord.of(unit, status="failed", reason=reason, seconds=time.perf_counter() - began), None)


def _planned(job: DatasetJob, unit: Unit, began: float) -> UnitResult:
    hand, obj = load_hand(unit.hand), load_object(unit.object, unit.scale, job.hold)
    search = GraspSearch(hand, obj, job.options(unit.count, unit.seed))
    unfinished: list[UnfinishedGrasp] = []
    search.tell_unfinished(unfinished.append)
    for _ in search:
        pass
    plan = search.plan()
    hold = _test(job) if job.hold else None
    reports = [None if hold is None else _tested(hand, obj, grasp, hold) for grasp in plan.grasps]
    rows = [row_of(unit, hand, obj, grasp, report) for grasp, report in zip(plan.grasps, reports, strict=True)]
    rows += [row_of(unit, hand, obj, grasp, None) for grasp in sorted(unfinished, key=lambda each: each.number)]
    assert all(row.keys() == COLUMNS.keys() for row in rows)
    record = UnitRecord.of(
        unit,
        rows=len(rows),
        ok=sum(row["ok"] for row in rows),
        proposed=plan.proposed,
        closed=plan.closed,
        force_closed=plan.force_closed,
        rejected={reason: count for reason, count in plan.rejected.items() if count},
        hand_hash=rows[0]["hand_hash"] if rows else None,
        object_hash=rows[0]["object_hash"] if rows else None,
    )
    source = json.loads(json.dumps(asdict(hand_source(hand, unit.hand))))
    part = encode_part(rows, record.content(job.hash), {unit.hand: source})
    return UnitResult(replace(record, sha256=sha256(part), seconds=time.perf_counter() - began), part)


def _test(job: DatasetJob) -> Hold:
    """Return the hold test at the hard end of the planned range: the heaviest mass, the lowest friction."""
    lowest = friction_range(FRICTION if job.friction is None else job.friction)[0]
    return Hold(
        mass=mass_range(job.mass)[1],
        friction=lowest,
        planned_mass=job.mass,
        planned_friction=FRICTION if job.friction is None else job.friction,
    )


def _tested(hand: Hand, obj: GraspObject, grasp: PlannedGrasp, hold: Hold) -> HoldReport:
    from clench.execution.simulation.pulling import hold_and_pull
    from clench.execution.trajectory import plan_trajectory

    way = grasp.trajectory or plan_trajectory(grasp.solution, hand, obj=obj, force=True)
    return hold_and_pull(grasp.solution, hand, obj, hold, way)
