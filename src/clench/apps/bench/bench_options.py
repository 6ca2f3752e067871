"""What all benchmarks do with their options and their reports."""

from __future__ import annotations

import sys
from pathlib import Path

from clench.apps.cli.results import print_json
from clench.base.errors import CommandError
from clench.base.json_files import check_writable
from clench.base.visible_text import visible

from .report import BenchReport

SCHEMA = "clench.bench/1"


def at_least(least: int, **counts: int) -> None:
    """Refuse counts below a least one.

    Raises:
        CommandError: with the option.
    """
    for key, count in counts.items():
        if count < least:
            raise CommandError(f"--{key}: expected at least {least}, got {count}.")


def drawable(plot: Path | None) -> None:
    """Refuse a file that no picture can be written to, before anything is measured."""
    if plot is not None:
        from clench.apps.figures.style import check_figure

        check_figure(plot)


def writable(*files: Path | None) -> None:
    """Refuse files that cannot be written, before anything is measured."""
    for file in files:
        if file is not None:
            check_writable(file)


def print_report(report: BenchReport, json: bool) -> int:
    """Print what was measured; return 1 where answers are wrong, else 0."""
    if json:
        print_json({"schema": SCHEMA, **report.values, "errors": list(report.errors)})
    else:
        sys.stdout.write("".join(f"{visible(line)}\n" for line in report.lines()))
    for error in report.errors:
        sys.stderr.write(f"clench: wrong answer: {visible(str(error))}\n")
    return 1 if report.errors else 0
