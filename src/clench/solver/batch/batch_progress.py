"""A progress bar that appears once something takes longer than a second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

#: Nothing is shown before [s].
PATIENCE: Final = 1.0


@contextmanager
def shown(total: int, wanted: bool | None) -> Iterator[Callable[[int], None]]:
    """Give a function that notes the number of further solved poses, and draws a bar on standard error after a second.

    Args:
        total: number of poses. wanted: whether a bar may appear; None where standard error is a terminal.
    """
    may = sys.stderr.isatty() if wanted is None else wanted
    began, done = time.monotonic(), 0
    bar: tuple[Progress, TaskID] | None = None
    with ExitStack() as stack:

        def advance(count: int) -> None:
            nonlocal bar, done
            done += count
            if bar is None and may and time.monotonic() - began > PATIENCE and done < total:
                bar = _start(stack, total)
            if bar is not None:
                bar[0].update(bar[1], completed=done)

        yield advance


def _start(stack: ExitStack, total: int) -> tuple[Progress, TaskID]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    progress = Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True)
    stack.enter_context(progress)
    return progress, progress.add_task("Solving", total=total)
