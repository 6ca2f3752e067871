"""Processes that time batches, each with its own version of the package; see `batch_worker`."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray

_PROGRAM: Final = Path(__file__).with_name("batch_worker.py")
#: Angles that differ by more than this are other answers [rad].
AGREEMENT: Final = 1e-9


class BatchCase(NamedTuple):
    """One hand in one geometry, one object, one order, and the palm's poses; see `batch_worker.load`."""

    hand: str
    geometry: str | None
    object: str
    scale: float
    order: str
    poses: list[list[float]]


class Worker:
    """A process that times batches.

    Args:
        python: the interpreter of an environment with the package. cases: what it times.

    Raises:
        CommandError: the interpreter does not start, or has no such package.
    """

    def __init__(self, python: str, cases: Sequence[BatchCase]) -> None:
        self._python = python
        pipe = subprocess.PIPE
        try:
            # Without the folder of the program, which has modules of names of its own.
            self._process = subprocess.Popen([python, "-P", str(_PROGRAM)], stdin=pipe, stdout=pipe, text=True)
        except OSError as error:
            raise CommandError(f"{python}: expected a Python of an environment with clench ({error}).") from error
        self.answers: list[dict[str, Any]] = self._ask(json.dumps([case._asdict() for case in cases]))["answers"]

    def time(self, case: int) -> float:
        """Return the processor time of one batch [s]."""
        return float(self._ask(str(case)))

    def angles(self, case: int) -> FloatArray:
        """Return the joint angles of a batch [rad], (N, J)."""
        return np.array(self.answers[case]["angles"], dtype=np.float64)

    def _ask(self, line: str) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(line + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            answer = ""
        else:
            answer = self._process.stdout.readline()
        if not answer:
            raise CommandError(f"{self._python}: expected clench in its environment; the process ended.")
        return json.loads(answer)

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.kill()
        self._process.communicate()


def differing(ours: FloatArray, theirs: FloatArray) -> int:
    """Return at how many poses two versions end at other angles."""
    if ours.shape != theirs.shape:
        return len(ours)
    return int((np.abs(ours - theirs).max(axis=1, initial=0.0) > AGREEMENT).sum())
