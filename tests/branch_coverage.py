"""Measure which branches of kernels and steps the tests take: ``cd tests && python -m branch_coverage``.

Kernels are seen only while they run as Python (see `interpreted`), which is slow: for them a part of the tests runs,
and tests that take longer than `--at-most` seconds of processor time are ended. The tests of the steps run with kernels
compiled, as always. The exit code is 1 where fewer than `--least` per cent of the branches of a package are taken.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("kernels", "closing", "mechanics", "scoring")
#: What holds the kernels in short tests, what does so in longer ones; and the steps.
BRIEF = (
    "kernels",
    "mutation/few_planar.py",
    "closing/test_link_bodies.py",
    "closing/test_containment.py",
    "closing/test_depths.py",
    "benchmarks/test_bench_peers.py",
)
WHOLE = (
    *("solver/batch/test_batch_of_small_hands.py", "closing/test_kernel_run.py", "mutation/few_width.py"),
    *("kernels/toi/test_full_width.py", "solver/test_close_by.py", "solver/test_orders.py"),
)
STEP_TESTS = ("closing", "mechanics", "scoring", "solver", "kernels/runtime/test_warming.py")


def run_tests(files: Sequence[str], options: Sequence[str], data: Path) -> None:
    """Run tests with their branches noted in a file beside `data`."""
    command = [sys.executable, "-m", "coverage", "run", f"--data-file={data}", f"--rcfile={ROOT / 'pyproject.toml'}"]
    command += ["-m", "pytest", "-n0", "-p", "no:cacheprovider", *options, *(f"tests/{name}" for name in files)]
    path = os.pathsep.join([str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    subprocess.run(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": path}, check=False)


def measured(data: Path) -> dict[str, dict[str, int]]:
    """Return the summary of every file: lines and branches there are, and those taken."""
    report = data.with_suffix(".json")
    for command in (["combine", "-q"], ["json", "-q", "-o", str(report)]):
        options = [f"--data-file={data}", f"--rcfile={ROOT / 'pyproject.toml'}"]
        subprocess.run([sys.executable, "-m", "coverage", *command, *options], cwd=ROOT, check=True)
    files = json.loads(report.read_text())["files"]
    return {name.partition("clench/")[2]: file["summary"] for name, file in files.items()}


def share(rows: Sequence[dict[str, int]], what: str, there: str) -> float:
    """Return the percentage that is taken; 100 of nothing."""
    total = sum(row[there] for row in rows)
    return 100.0 * sum(row[what] for row in rows) / total if total else 100.0


def print_table(files: dict[str, dict[str, int]]) -> dict[str, float]:
    """Print a row per file that is not taken in full and per package; return the percentage of branches of these."""
    print("| file | lines | of them run | branches | of them taken |\n|---|---|---|---|---|")
    found = {}
    for package in PACKAGES:
        mine = {name: row for name, row in files.items() if name.startswith(f"{package}/")}
        rows = {**mine, f"**{package}**": None}
        for name, row in rows.items():
            of = list(mine.values()) if row is None else [row]
            lines, branches = (
                share(of, "covered_lines", "num_statements"),
                share(of, "covered_branches", "num_branches"),
            )
            if row is None:
                found[package] = branches
            if row is None or min(lines, branches) < 100.0:
                counts = sum(r["num_statements"] for r in of), sum(r["num_branches"] for r in of)
                print(f"| {name} | {counts[0]} | {lines:.1f} % | {counts[1]} | {branches:.1f} % |")
    return found


def main() -> int:
    """Measure, and print what is not taken."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--at-most", type=float, default=3.0, help="for a test with kernels as Python, ten times that for a few [s]"
    )
    parser.add_argument("--least", type=float, default=95.0, help="branches of each package [%%]")
    parser.add_argument("--keep", type=Path, help="folder for the data, for `coverage html` and the like")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data = (asked.keep or Path(folder)).absolute() / "coverage"
        data.parent.mkdir(parents=True, exist_ok=True)
        interpreted = ["-p", "interpreted", "--ignore=tests/kernels/runtime/test_warming.py", "--at-most"]
        run_tests(BRIEF, [*interpreted, str(asked.at_most)], data)
        run_tests(WHOLE, [*interpreted, str(10.0 * asked.at_most)], data)
        run_tests(STEP_TESTS, [], data)
        found = print_table(measured(data))
    return 0 if min(found.values()) >= asked.least else 1


if __name__ == "__main__":
    raise SystemExit(main())
