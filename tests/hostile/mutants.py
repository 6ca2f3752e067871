"""Good files with some bytes or numbers wrong: each is read, or refused with one sentence, in little time and memory.

`cd tests && python -m hostile.mutants --count 20000` prints a row per kind of file. One other process reads the
files; where one ends it, or takes too long, that is a mistake like any other, and the run goes on.
"""

import argparse
import io
import json
import os
import re
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.mutation import Rng, pick

from .good_files import KINDS, Original, originals

#: What reading one file may take: memory beyond what the process has [bytes], and time [s].
MEMORY = 1 << 30
SECONDS = 20
#: What the process may have [bytes].
ALL_MEMORY = 4 << 30
#: The first file of a process may wait for kernels to be compiled [s].
PATIENCE = 400
NUMBERS = (b"1e308", b"-1", b"nan", b"9223372036854775808", b"0", b"-1e308", b"1e-320", b"inf", b"4294967295")
PACKED = (
    *(struct.pack("<d", value) for value in (1e308, -1.0, float("nan"), float("inf"), 5e-324)),
    *(struct.pack("<f", value) for value in (3e38, -1.0, float("nan"))),
    *(struct.pack("<q", value) for value in (2**63 - 1, -1, -(2**63))),
    *(struct.pack("<I", value) for value in (2**32 - 1, 2**31, 0)),
)
_NUMBER = re.compile(rb"(?<![\w.])-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def mutated(rng: Rng, data: bytes) -> bytes:
    """Return data with one to three things wrong."""
    for _ in range(pick(rng, (1, 1, 1, 2, 3))):
        data = pick(rng, _CHANGES)(rng, data)
    return data


def _flipped(rng: Rng, data: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 5)) if data else 0):
        changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _cut(rng: Rng, data: bytes) -> bytes:
    return data[: int(rng.integers(len(data) + 1))]


def _doubled(rng: Rng, data: bytes) -> bytes:
    start, end = sorted(rng.integers(0, len(data) + 1, 2).tolist())
    block = data[start : min(end, start + 4096)]
    return data[:start] + block * int(pick(rng, [2, 2, 3, 50])) + data[start + len(block) :]


def _other_number(rng: Rng, data: bytes) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return _other_word(rng, data)
    place = pick(rng, found)
    return data[: place.start()] + pick(rng, NUMBERS) + data[place.end() :]


def _other_word(rng: Rng, data: bytes) -> bytes:
    word = pick(rng, PACKED)
    at = int(rng.integers(len(data) + 1))
    at -= at % 4
    return data[:at] + word + data[at + len(word) :]


_CHANGES = (_flipped, _cut, _doubled, *(_other_number,) * 6, _other_word)


def mutant(rng: Rng, original: Original) -> bytes:
    """Return a changed file; half of the archives have a changed entry, and are whole otherwise."""
    if not zipfile.is_zipfile(io.BytesIO(original.data)) or rng.random() < 0.5:
        return mutated(rng, original.data)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(original.data)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        chosen = pick(rng, names)
        for name in names:
            new.writestr(name, mutated(rng, old.read(name)) if name == chosen else old.read(name))
    return out.getvalue()


@dataclass
class Report:
    """Hold counts of outcomes by kind of file, the largest time [s] and memory [bytes], and every mistake."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    seconds: Counter[str] = field(default_factory=Counter)
    memory: Counter[str] = field(default_factory=Counter)
    mistakes: list[str] = field(default_factory=list)

    def add(self, number: int, kind: str, outcome: str, text: str, seconds: float, memory: int) -> None:
        """Count one file."""
        if outcome in ("read", "refused") and (seconds > SECONDS or memory > MEMORY):
            outcome, text = "slow" if seconds > SECONDS else "memory", f"{seconds:.1f} s, {memory >> 20} MB"
        self.counts[kind, outcome] += 1
        self.seconds[kind] = max(self.seconds[kind], seconds)  # type: ignore[assignment]
        self.memory[kind] = max(self.memory[kind], memory)
        if outcome not in ("read", "refused"):
            self.mistakes.append(f"--first {number} --count 1  [{kind}]  {outcome}: {text}")

    def table(self) -> str:
        """Return the counts as text, a row per kind of file."""
        rows = [f"{'kind':14} {'read':>8} {'refused':>8} {'mistakes':>8} {'most s':>8} {'most MB':>8}"]
        for kind in [*sorted({kind for kind, _ in self.counts}), "all"]:
            outcomes = Counter(dict.fromkeys(("read", "refused"), 0))
            for (of, outcome), count in self.counts.items():
                outcomes[outcome] += count if kind in (of, "all") else 0
            wrong = sum(outcomes.values()) - outcomes["read"] - outcomes["refused"]
            most = max(self.seconds.values(), default=0) if kind == "all" else self.seconds[kind]
            memory = max(self.memory.values(), default=0) if kind == "all" else self.memory[kind]
            rows.append(
                f"{kind:14} {outcomes['read']:8} {outcomes['refused']:8} {wrong:8} {most:8.2f} {memory / 2**20:8.1f}"
            )
        return "\n".join(rows)


def run(count: int, seed: int, first: int = 0) -> Report:
    """Read the files `first` to `first + count` of a seed."""
    report, number = Report(), first
    while number < first + count:
        number = _run_process(seed, number, first + count, report)
    return report


def _run_process(seed: int, start: int, stop: int, report: Report) -> int:
    """Read files in one process until all are read or one ends it; return the next number."""
    command = [sys.executable, "-m", "hostile.mutants", "--worker", "--seed", str(seed), "--first", str(start)]
    process = subprocess.Popen(
        [*command, "--count", str(stop - start)],
        cwd=Path(__file__).parents[1],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdout is not None
    number, patience = start, threading.Timer(PATIENCE, process.kill)
    patience.start()
    try:
        for line in process.stdout:
            patience.cancel()
            report.add(*json.loads(line))
            number += 1
            patience = threading.Timer(2 * SECONDS, process.kill)
            patience.start()
    finally:
        patience.cancel()
        process.kill()
    code = process.wait()
    if number < stop:
        report.add(number, KINDS[number % len(KINDS)], "ended", f"the process ended with {code}", 0.0, 0)
        number += 1
    return number


class TookTooLongError(BaseException):
    """Say that a file took too long."""


def _alarm(*_: Any) -> None:
    raise TookTooLongError


def _peak() -> Iterator[int]:
    """Give the memory of this process, then again and again the most that it had since the last time [bytes]."""
    while True:
        status = Path("/proc/self/status").read_text()
        yield int(re.search(r"VmHWM:\s+(\d+)", status)[1]) << 10  # type: ignore[index]


def _outcome(original: Original, path: Path) -> tuple[str, str]:
    from clench.core.exceptions import ClenchError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            original.read(path)
    except ClenchError as error:
        text = str(error)
        return ("refused", "") if 15 < len(text) < 3000 and "\n" not in text else ("no sentence", repr(text[:200]))
    except TookTooLongError:
        return "slow", f"more than {SECONDS} s"
    except Exception as error:
        return "exception", f"{type(error).__name__}: {error}"[:300]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return "read", ""


def work(seed: int, start: int, count: int) -> None:
    """Read files in this process, and write a line for each to standard output."""
    resource.setrlimit(resource.RLIMIT_DATA, (ALL_MEMORY, ALL_MEMORY))
    signal.signal(signal.SIGALRM, _alarm)
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        made = originals(Path(folder))
        for number in range(start, start + count):
            original, rng = made[KINDS[number % len(KINDS)]], np.random.default_rng([seed, number])
            for left in Path(folder).glob("solves.sqlite*"):
                left.unlink()  # with the journals beside it
            path = original.write(mutant(rng, original))
            Path("/proc/self/clear_refs").write_text("5")
            peak = _peak()
            before, begun = next(peak), time.perf_counter()
            signal.setitimer(signal.ITIMER_REAL, SECONDS)
            outcome, text = _outcome(original, path)
            seconds, memory = time.perf_counter() - begun, next(peak) - before
            out.write(json.dumps([number, original.kind, outcome, text, seconds, memory]) + "\n")
            out.flush()


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.worker:
        work(given.seed, given.first, given.count)
        return 0
    report = run(given.count, given.seed, given.first)
    print(report.table())
    print("\n".join(f"--seed {given.seed} {mistake}" for mistake in report.mistakes))
    return 1 if report.mistakes else 0


if __name__ == "__main__":
    raise SystemExit(main())
