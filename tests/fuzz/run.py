"""Try many spoiled inputs, and report what came of them: `cd tests && python -m fuzz.run --count 1000 --seed 0`.

Trials run in another process: one that ends it, or that never ends, is a mistake like any other, and the run goes on.
"""

import argparse
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

#: A trial that has not ended after this long never will [s].
PATIENCE = 120.0
#: The first trial of a process may have to compile kernels [s].
FIRST_PATIENCE = 400.0


@dataclass
class Report:
    """Hold counts of outcomes by kind of input, and every mistake: its number, kind of input and what happened."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    mistakes: list[tuple[int, str, str]] = field(default_factory=list)

    def add(self, number: int, kind: str, outcome: str, text: str) -> None:
        """Count one trial."""
        self.counts[kind, outcome] += 1
        if outcome not in ("answer", "error"):
            self.mistakes.append((number, kind, f"{outcome}: {text}"))

    def table(self) -> str:
        """Return the counts as text, a row per kind of input."""
        outcomes = sorted({outcome for _, outcome in self.counts})
        kinds = sorted({kind for kind, _ in self.counts})
        rows = [["input", *outcomes], *([kind, *(str(self.counts[kind, o]) for o in outcomes)] for kind in kinds)]
        rows.append(["all", *(str(sum(self.counts[k, o] for k in kinds)) for o in outcomes)])
        return "\n".join("  ".join(f"{cell:>16}" for cell in row) for row in rows)


def run(count: int, seed: int, first: int = 0) -> Report:
    """Try the inputs `first` to `first + count` of a seed."""
    report, number = Report(), first
    while number < first + count:
        number = _run_process(seed, number, first + count, report)
    return report


def _run_process(seed: int, start: int, stop: int, report: Report) -> int:
    """Run trials in one process until all are done or one ends it; return the next number."""
    command = [sys.executable, "-m", "fuzz.run", "--worker", "--seed", str(seed), "--first", str(start)]
    process = subprocess.Popen(
        [*command, "--count", str(stop - start)],
        cwd=Path(__file__).parents[1],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    lines: queue.Queue[str | None] = queue.Queue()
    assert process.stdout is not None
    threading.Thread(target=_read_lines, args=(process.stdout, lines), daemon=True).start()
    number, kind, patience = start, "?", FIRST_PATIENCE
    try:
        while number < stop:
            try:
                line = lines.get(timeout=patience)
            except queue.Empty:
                report.add(number, kind, "hang", f"no outcome after {patience:.0f} s")
                return number + 1
            if line is None:
                report.add(number, kind, "crash", f"the process ended with {process.wait()}")
                return number + 1
            found = json.loads(line)
            if len(found) == 1:
                (kind,) = found
                continue
            number, kind, outcome, text = found
            report.add(number, kind, outcome, text)
            number, patience = number + 1, PATIENCE
    finally:
        process.kill()
        process.wait()
    return number


def _read_lines(stream: "object", lines: "queue.Queue[str | None]") -> None:
    for line in stream:  # type: ignore[attr-defined]
        lines.put(line)
    lines.put(None)


def work(seed: int, start: int, count: int) -> None:
    """Run trials in this process, and write a line for each to standard output."""
    from .outcomes import outcome_of
    from .trials import emptied
    from .values import KINDS

    makers, weights = list(KINDS), np.array(list(KINDS.values()), dtype=float)
    out = sys.stdout
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # where engines leave their logs
        for number in range(start, start + count):
            rng = np.random.default_rng([seed, number])
            maker = makers[int(rng.choice(len(makers), p=weights / weights.sum()))]
            out.write(json.dumps([maker.__name__]) + "\n")
            out.flush()
            trial = maker(rng, emptied(Path(folder) / "trial"))
            outcome = outcome_of(trial)
            out.write(json.dumps([number, trial.kind, outcome.kind, outcome.text]) + "\n")
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
    start = time.perf_counter()
    report = run(given.count, given.seed, given.first)
    print(report.table())
    for number, kind, text in report.mistakes:
        print(f"--seed {given.seed} --first {number} --count 1  [{kind}]  {text}")
    print(f"{given.count} inputs, {len(report.mistakes)} mistakes, {time.perf_counter() - start:.0f} s")
    return 1 if report.mistakes else 0


if __name__ == "__main__":
    raise SystemExit(main())
