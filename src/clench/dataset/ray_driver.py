"""Generate a dataset on a Ray cluster: `python -m clench.dataset.ray_driver JOB OUT` on one machine of it.

The driver writes all files, so that the machines need no common folder. Each machine needs clench and the models, under
the paths that the job names.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import ClenchError, CommandError
from clench.core.extras import how_to_install

from .jobs.job import DatasetJob, job_from, read_job
from .jobs.units import Unit
from .running.generating import GenerateReport, Told, generate
from .running.unit_run import UnitRecord, UnitResult, run_unit
from .running.workers import THREADS, TRIES

#: Units that are handed out per core of the cluster, so that none waits.
_AHEAD: Final = 2


def generate_on_ray(
    job: DatasetJob, out: str | Path, *, address: str | None = None, tell: Told | None = None
) -> GenerateReport:
    """Generate a dataset on all cores of a Ray cluster; go on where an ended run stopped.

    The merged file is byte-identical to the result of `clench.dataset.generate`.

    Args:
        job, out, tell: see `clench.dataset.generate`.
        address: of the cluster; None: the cluster that Ray finds, or else this machine.

    Raises:
        ClenchError: Ray is missing, or no cluster is at the address; otherwise as `clench.dataset.generate`.
    """
    try:
        import ray
    except ImportError:
        raise ClenchError(f"Datasets on several machines need Ray: {how_to_install('scale')}.") from None
    own = not ray.is_initialized()
    if own:
        try:
            ray.init(address=address, log_to_driver=False, include_dashboard=False)
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise ClenchError(f"Ray: {' '.join(str(error).split())}") from None
    try:
        return generate(job, out, tell=tell, runner=_run)
    finally:
        if own:
            ray.shutdown()


def _run(job: DatasetJob, units: list[Unit]) -> Iterator[UnitResult]:
    """Yield the results of units, in the order in which they end."""
    import ray

    environment = {"env_vars": dict.fromkeys(THREADS, "1")}
    task = ray.remote(num_cpus=1, max_retries=TRIES - 1, runtime_env=environment)(run_unit)
    asked = ray.put(job)
    waiting, running = deque(units), dict[Any, Unit]()
    most = _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
    while waiting or running:
        while waiting and len(running) < most:
            unit = waiting.popleft()
            running[task.remote(asked, unit)] = unit
        (ended,), _ = ray.wait(list(running), num_returns=1)
        unit = running.pop(ended)
        try:
            yield ray.get(ended)
        except ray.exceptions.RayError as error:
            reason = f"Ray: {' '.join(str(error).split())}"
            yield UnitResult(UnitRecord.of(unit, status="failed", reason=reason), None)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the driver: a job file, the folder of the dataset, and the address of the cluster if Ray does not find it."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        if len(arguments) not in (2, 3):
            raise CommandError(f"expected JOB OUT [ADDRESS], got {len(arguments)} arguments.")
        file, out, *address = arguments
        job = job_from(read_job(file), file)
        report = generate_on_ray(job, out, address=address[0] if address else None, tell=_say)
    except ClenchError as error:
        sys.stderr.write(f"clench: error: {error}\n")
        return 2
    rows = sum(record.ok for record in report.records)
    sys.stdout.write(f"{rows} grasps in '{report.folder}', {len(report.failed)} of {report.units} units failed.\n")
    return 0 if rows else 1


def _say(record: UnitRecord) -> None:
    sys.stderr.write(f"{record.hand} on {record.object}, part {record.part + 1}: {record.ok} grasps\n")


if __name__ == "__main__":
    sys.exit(main())
