"""Commands of the benchmarks of what users wait for: `clench bench hands`, `commands` and `planning`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from clench.apps.cli.inputs.choices import Order, Source
from clench.core.exceptions import CommandError

from .bench_options import Case, Common, Hands, Objects, Runs, at_least, print_report, writable

_COMMON: Final = Common()
_CASE: Final = Case()
_HANDS: Final = Hands()
_OBJECTS: Final = Objects(("mug", "cylinder:r=0.03,h=0.12"))
_RUNS: Final = Runs(64, 5)


def hands(
    *,
    hands: Hands = _HANDS,
    objects: Objects = _OBJECTS,
    runs: Runs = _RUNS,
    order: tuple[Order, ...] = ("proximal-first",),
    collision_source: Source | None = None,
    other: str | None = None,
    keep: Path | None = None,
    common: Common = _COMMON,
) -> int:
    """Time batches of several hands, beside the first hand and beside another version, in turns on one thread.

    Args:
        order: in which the joints close; the first one is what the others are compared with.
        collision_source: geometry of the hands; their default without it.
        other: Python of an environment with another version of clench.
        keep: file (CSV) that gets a row per case, with the commit and the ratio to the other version.
    """
    from .users.hand_times import HandBench, bench_hands
    from .users.kept_ratios import check_header

    runs.check()
    if not order:
        raise CommandError("--order: expected at least one order, got none.")
    if keep is not None:
        if other is None:
            raise CommandError("--keep: expected --other, whose ratios the file has.")
        writable(keep)
        check_header(keep)
    asked = HandBench(runs, tuple(order), collision_source, other, keep, common.seed)
    return print_report(bench_hands(hands, objects, asked), common)


def commands(
    *,
    case: Case = _CASE,
    passes: int = 5,
    cold: bool = False,
    other: str | None = None,
    common: Common = _COMMON,
) -> int:
    """Time whole commands, from the start of the process to its end.

    Args:
        passes: how often each is timed, in turns.
        cold: also time a first demo, which compiles its kernels.
        other: Python of an environment with another version of clench.
    """
    from .users.command_times import CommandBench, bench_commands

    at_least(1, passes=passes)
    return print_report(bench_commands(case, CommandBench(passes, cold, other, common.seed)), common)


def planning(
    *,
    hands: Hands = _HANDS,
    objects: Objects = _OBJECTS,
    grasps: int = 10,
    proposals: int = 512,
    threads: int | None = None,
    common: Common = _COMMON,
) -> int:
    """Time how long a first planned grasp takes and all, and how many grasps a second of the search closes.

    Args:
        grasps: how many are returned.
        proposals: how many wrist poses are proposed at most.
        threads: how many are used; all cores without it.
    """
    from .users.planning_times import PlanningBench, bench_planning

    at_least(1, grasps=grasps, proposals=proposals)
    if threads is not None:
        at_least(1, threads=threads)
    return print_report(bench_planning(hands, objects, PlanningBench(grasps, proposals, threads, common.seed)), common)
