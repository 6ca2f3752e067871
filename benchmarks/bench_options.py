"""Options that several benchmarks share, and what all of them do with options and reports."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import clench
from clench.apps.cli.output.results import print_json
from clench.core.exceptions import CommandError
from clench.core.files.json_files import check_writable
from clench.core.showing.visible_text import visible
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

from .bench_report import BenchReport

SCHEMA = "clench.bench/1"


@dataclass(frozen=True)
class Common:
    """Options of every benchmark.

    Args:
        seed: of everything that is drawn at random.
        json: print one JSON document on standard output.
    """

    seed: int = 0
    json: bool = False


@dataclass(frozen=True)
class Runs:
    """How much is timed.

    Args:
        poses: how many approach poses are solved.
        passes: how often each is timed.
    """

    poses: int
    passes: int

    def check(self) -> None:
        """Refuse counts of nothing.

        Raises:
            CommandError: with the option.
        """
        at_least(1, poses=self.poses, passes=self.passes)


@dataclass(frozen=True)
class Case:
    """One hand and one object.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
    """

    hand: str = "robonaut2"
    object: str = "mug"
    scale: float = 1.0

    def load(self) -> tuple[Hand, GraspObject]:
        """Load both."""
        return clench.Hand.load(self.hand), clench.GraspObject.load(self.object, scale=self.scale)


@dataclass(frozen=True)
class Objects:
    """Several objects.

    Args:
        object: built-in names, paths to meshes, or shapes such as cylinder:r=0.03,h=0.1.
        scale: multiplies the objects' lengths, e.g. 0.001 for meshes in millimetres.
    """

    object: tuple[str, ...]
    scale: float = 1.0

    def load(self) -> list[GraspObject]:
        """Load all."""
        return [clench.GraspObject.load(model, scale=self.scale) for model in self.object]


@dataclass(frozen=True)
class Hands:
    """Several hands.

    Args:
        hand: built-in names, or paths to .urdf or .xml files.
    """

    hand: tuple[str, ...] = ("robonaut2",)

    def load(self) -> list[Hand]:
        """Load all."""
        return [clench.Hand.load(model) for model in self.hand]


@dataclass(frozen=True)
class Pages:
    """Files for what was measured.

    Args:
        plot: file (.png, .pdf, .svg, …) for a picture.
        table: file for a table (Markdown).
    """

    plot: Path | None = None
    table: Path | None = None

    def check(self) -> None:
        """Refuse files that cannot be written, before anything is measured.

        Raises:
            ClenchError: with the file.
        """
        drawable(self.plot)
        writable(self.table)


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
        from clench.apps.figures.drawing.style import check_figure

        check_figure(plot)


def writable(*files: Path | None) -> None:
    """Refuse files that cannot be written, before anything is measured."""
    for file in files:
        if file is not None:
            check_writable(file)


def print_report(report: BenchReport, common: Common) -> int:
    """Print what was measured; return 1 where answers are wrong, else 0."""
    if common.json:
        print_json({"schema": SCHEMA, **report.values, "errors": list(report.errors)})
    else:
        sys.stdout.write("".join(f"{visible(line)}\n" for line in report.lines()))
    for error in report.errors:
        sys.stderr.write(f"clench: wrong answer: {visible(str(error))}\n")
    return 1 if report.errors else 0
