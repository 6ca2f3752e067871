"""`clench generate`: datasets of grasps, in shards that continue after an interruption."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.choices import Kind
from clench.core.exceptions import CommandError

if TYPE_CHECKING:
    from clench.dataset.jobs.job import DatasetJob
    from clench.dataset.running.generating import GenerateReport, Told
    from clench.dataset.storage.merging import Merged

# The values of `GraspKind`, written out so that the command line loads without NumPy.


def generate(
    *,
    out: Path | None = None,
    job: Path | None = None,
    hands: tuple[str, ...] = (),
    objects: tuple[str, ...] = (),
    scales: tuple[float, ...] = (),
    count: int | None = None,
    seed: int | None = None,
    unit: int | None = None,
    hold: bool = False,
    friction: tuple[float, ...] = (),
    mass: tuple[float, ...] = (),
    gravity: tuple[float, float, float] | None = None,
    kinds: tuple[Kind, ...] = (),
    fingers: tuple[str, ...] = (),
    min_fingers: int | None = None,
    approach: tuple[float, float, float] | None = None,
    approach_angle: float | None = None,
    pose_sigma: tuple[float, ...] = (),
    apart: float | None = None,
    effort: int | None = None,
    most: int | None = None,
    without_path: bool = False,
    shard: str | None = None,
    workers: int | None = None,
    memory: float | None = None,
    merge: Path | None = None,
    json: bool = False,
) -> int:
    """Generate a dataset of grasps on all cores, continue interrupted runs, and merge it (docs/dataset.md).

    Args:
        out: folder of the dataset; the same call continues an interrupted run.
        job: file (TOML or JSON) with these options as keys; options on the command line override it.
        hands: built-in names, paths to .urdf or .xml files, or names that clench[hands] finds (docs/own-hand.md).
        objects: built-in names, paths to meshes, or shapes such as cylinder:r=0.03,h=0.1.
        scales: factors for the objects' lengths, e.g. 0.001 for meshes in millimetres; every object is used at every
            scale; 1 by default.
        count: number of grasps per hand, object and scale; 100 by default.
        seed: seed; the same seed gives the same grasps for any number of workers and shards; 0 by default.
        unit: largest number of grasps that are planned together; an interruption loses at most one unit per worker;
            50 by default.
        hold: test every grasp in simulation, in six directions; grasps are planned on convex pieces.
        friction: friction between links and object; two numbers are a range; by default the values of hand file and
            object, else 0.6.
        mass: mass of the objects [kg]; two numbers are a range; 0.1 by default.
        gravity: direction of gravity; by default every direction.
        kinds: kinds of grasps; all by default.
        fingers: names of the fingers that may close; all by default.
        min_fingers: smallest number of fingers that touch; 2 by default.
        approach: direction in which the palm approaches.
        approach_angle: largest angle between the palm's direction and --approach [degrees]; 45 by default.
        pose_sigma: standard deviations of the object's position [m] and rotation [rad]; clench prefers grasps that
            hold when the object is displaced.
        apart: smallest difference of two grasps of a unit: a root mean square over all links [m]; 0.02 by default.
        effort: number of proposals per grasp; the best of them is kept; 40 by default.
        most: largest number of proposals of a unit.
        without_path: leave out the path from the open hand to the touch, and the pregrasp.
        shard: i/n: run only part i of n; by default as the variables of a SLURM array say, else everything.
        workers: number of processes; all cores by default; 0 works in this process.
        memory: clench replaces a process that used more memory than this, after its unit [GB]; 4 by default.
        merge: merge the parts in this folder, and do nothing else.
        json: print one JSON document on standard output.
    """
    from clench.apps.cli.parsing import as_angle
    from clench.dataset.storage.columns import need_pyarrow

    need_pyarrow()
    given = {
        **{key: value for key, value in (("hands", hands), ("objects", objects), ("scales", scales)) if value},
        **{key: value for key, value in (("kinds", kinds), ("fingers", fingers)) if value},
        **{key: _range(value, key) for key, value in (("friction", friction), ("mass", mass)) if value},
        **({"pose_sigma": _range(pose_sigma, "pose_sigma")} if pose_sigma else {}),
        **({"hold": True} if hold else {}),
        **({"path": False} if without_path else {}),
    }
    numbers: dict[str, float | None] = {"count": count, "seed": seed, "unit": unit, "min_fingers": min_fingers}
    numbers["approach_angle"] = None if approach_angle is None else as_angle(approach_angle, "--approach-angle")
    numbers |= {"apart": apart, "effort": effort, "most": most}
    given |= {key: value for key, value in numbers.items() if value is not None}
    given |= {key: value for key, value in (("gravity", gravity), ("approach", approach)) if value is not None}
    if merge is not None:
        if given or out is not None or job is not None:
            raise CommandError("--merge: merges a folder as it is; leave out all options but --json.")
        return _merge(merge, json)
    if out is None:
        raise CommandError("--out: missing; expected the folder of the dataset.")
    asked = _job(job, given)
    return _generate(asked, out, shard, workers, memory, json)


def _job(file: Path | None, given: dict[str, Any]) -> DatasetJob:
    """Return the job of a file and of options, which count instead of the file's keys."""
    from clench.dataset.jobs.job import job_from, read_job

    if file is None:
        return job_from(given, "options")
    return job_from(read_job(file) | given, str(file))


def _range(values: tuple[float, ...], key: str) -> Any:
    from clench.apps.cli.parsing import as_range

    return as_range(values, f"--{key.replace('_', '-')}")


def _merge(folder: Path, json: bool) -> int:
    import clench.dataset
    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json

    merged = clench.dataset.merge(folder)
    if json:
        print_json({"schema": "clench.merge/1", **merged.to_dict()})
    else:
        _say_merged(merged)
        print_files([merged.file])
    return 0 if merged.ok else 1


def _generate(
    job: DatasetJob, out: Path, shard: str | None, workers: int | None, memory: float | None, json: bool
) -> int:
    import clench.dataset
    from clench.apps.cli.interrupts import stopped_by_signals
    from clench.apps.cli.output.results import print_json
    from clench.dataset.storage.folder import DatasetFolder
    from clench.kernels.runtime.warming import warm_up

    part = clench.dataset.Shard.parse(shard) if shard is not None else clench.dataset.Shard.of_environment()
    # Report impossible requests before compiling anything.
    DatasetFolder(out, job).check()
    options: dict[str, Any] = {} if memory is None else {"memory": memory}
    warm_up(motions=True)
    units = sum(part.has(unit) for unit in job.units())
    try:
        with stopped_by_signals(), _progress(units, not json) as tell:
            report = clench.dataset.generate(job, out, shard=part, workers=workers, tell=tell, **options)
    except KeyboardInterrupt:
        if (out / "job.json").is_file():
            # Quoted by hand: the call may have come from a program.
            same = shlex.join(sys.argv[1:]) if sys.argv[1:2] == ["generate"] else f"generate --out {out} ..."
            sys.stderr.write(f"clench: whole units are in '{out}'; the same call goes on: clench {same}\n")
        raise
    if json:
        print_json(report.to_dict())
    else:
        _say(report)
    return 0 if any(record.ok for record in report.records) or not report.units else 1


@contextmanager
def _progress(units: int, show: bool) -> Iterator[Told]:
    """Give a function that counts a unit, and shows rate, yield and remaining time on standard error."""
    import time

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("units, {task.description}"), TimeRemainingColumn())
    began = time.monotonic()
    rows = closed = force_closed = 0
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not show) as progress:
        task = progress.add_task("0 grasps", total=units)

        def tell(record: Any) -> None:
            nonlocal rows, closed, force_closed
            rows, closed = rows + record.ok, closed + record.closed
            force_closed += record.force_closed
            rate = rows / max(time.monotonic() - began, 1e-9)
            share = f", yield {100 * force_closed / closed:z.0f} %" if closed else ""
            progress.update(task, advance=1, description=f"{rows} grasps, {rate:.3g} per second{share}")

        yield tell


def _say(report: GenerateReport) -> None:
    """Print the result of a run."""
    from clench.apps.cli.output.printing import print_files

    rows, ok = sum(record.rows for record in report.records), sum(record.ok for record in report.records)
    before = f" ({report.found} of them before)" if report.found else ""
    sys.stdout.write(
        f"Shard {report.shard}: {report.units} units{before}, {ok} grasps and {rows - ok} that failed, "
        f"{report.seconds:.3g} s.\n"
    )
    for record in report.failed:
        sys.stderr.write(f"clench: warning: '{record.hand}' on '{record.object}' failed: {record.reason}\n")
    if report.merged is not None:
        _say_merged(report.merged)
        print_files([report.merged.file])
    elif report.missing:
        sys.stdout.write(f"{report.missing} units of other shards are missing; the last one of them merges.\n")


def _say_merged(merged: Merged) -> None:
    size = f"{merged.bytes / merged.rows:z.0f} bytes each" if merged.rows else "empty"
    sys.stdout.write(f"Merged {merged.rows} rows, {merged.ok} of them grasps, {size}. SHA-256 {merged.sha256}\n")
