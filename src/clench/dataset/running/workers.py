"""Worker processes: each does one unit at a time, on one thread, and is replaced when it ends or grows too large."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Final

from clench.dataset.jobs.job import DatasetJob
from clench.dataset.jobs.units import Unit

from .unit_run import UnitRecord, UnitResult, run_unit

if TYPE_CHECKING:
    from multiprocessing.context import SpawnProcess

#: One thread per process; libraries read this when they are loaded.
THREADS: Final = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: A unit during which the process ended is tried so often.
TRIES: Final = 2
#: Time limit for a process to end on request [s].
_PATIENCE: Final = 5.0
_GB: Final = 1 << 30


class Worker:
    """A process and the unit that it works on.

    Args:
        job: the job, which the process keeps.
    """

    def __init__(self, job: DatasetJob) -> None:
        context = get_context("spawn")
        self.connection, other = context.Pipe()
        self.unit: Unit | None = None
        with _one_thread(), _ignoring_interrupts():
            self.process: SpawnProcess = context.Process(target=_serve, args=(other, job), daemon=True)
            self.process.start()
        other.close()

    def give(self, unit: Unit) -> None:
        """Send a unit; its result arrives at `connection`."""
        self.unit = unit
        try:
            self.connection.send(unit)
        except OSError:
            return  # the process has ended, which is noticed when its answer is read

    def stop(self) -> None:
        """End the process, even in the middle of work."""
        self.connection.close()
        self.process.terminate()
        self.process.join(_PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def run_units(job: DatasetJob, units: Iterable[Unit], workers: int, memory: float) -> Iterator[UnitResult]:
    """Yield the results of units, in the order in which they end.

    Args:
        job: the options. units: the units. workers: processes; 0 works in this one.
        memory: a process that has had more than this is replaced after its unit [GB].
    """
    if workers == 0:
        yield from (run_unit(job, unit) for unit in units)
        return
    waiting = deque(units)
    tries: dict[str, int] = {}
    pool = [Worker(job) for _ in range(min(workers, len(waiting)))]
    try:
        for worker in pool:
            worker.give(waiting.popleft())
        while any(worker.unit for worker in pool):
            ready = wait([worker.connection for worker in pool if worker.unit])
            for number, worker in enumerate(pool):
                if worker.connection not in ready or worker.unit is None:
                    continue
                unit, (result, used) = worker.unit, _answer(worker)
                worker.unit = None
                if result is None:
                    tries[unit.key] = tries.get(unit.key, 0) + 1
                    if tries[unit.key] < TRIES:
                        waiting.appendleft(unit)
                    else:
                        yield UnitResult(UnitRecord.of(unit, status="failed", reason=_ended(worker)), None)
                else:
                    yield result
                if waiting:
                    if result is None or used > memory * _GB:
                        worker.stop()
                        pool[number] = worker = Worker(job)
                    worker.give(waiting.popleft())
    finally:
        for worker in pool:
            worker.stop()


def _answer(worker: Worker) -> tuple[UnitResult | None, int]:
    """Return a worker's result and the memory that it has used [bytes], or None if it has ended."""
    try:
        found: tuple[UnitResult, int] = worker.connection.recv()
    except (EOFError, OSError):
        worker.process.join(_PATIENCE)
        return None, 0
    return found


def _ended(worker: Worker) -> str:
    code = worker.process.exitcode
    how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
    return f"The process ended with {how} in {TRIES} of {TRIES} tries; it may have run out of memory."


def _serve(connection: Connection, job: DatasetJob) -> None:
    """Do units until there are no more, or the process that sends them has ended."""
    while True:
        try:
            unit = connection.recv()
            connection.send((run_unit(job, unit), _peak()))
        except (EOFError, OSError):
            return


def _peak() -> int:
    """Return the most memory that this process has had [bytes]; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else 1024 * most


@contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Have processes that start meanwhile ignore Ctrl-C, which goes to all processes of a terminal.

    The process that shares out the units heeds it, and ends the others.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Have processes that start meanwhile use one thread."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
