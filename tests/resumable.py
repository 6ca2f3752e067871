"""Run many independent pieces of work on several cores, keep what each one gave, and go on where a run was ended."""

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

#: The least time between two lines about the progress [s].
_QUIET = 10.0


def each(
    work: Callable[..., Any],
    pieces: Sequence[tuple[Any, ...]],
    processes: int,
    file: Path | None = None,
    seconds: float | None = None,
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield every piece with what `work(*piece)` gives, in the order in which they end.

    Args:
        pieces: arguments that JSON can hold; so can what `work` returns. processes: at once; 1 uses none but this.
        file: what was found is appended to it, and what it has already is not done again.
        seconds: no piece is begun after so long.
    """
    found = _read(file)
    for piece in pieces:
        if _key(piece) in found:
            yield piece, found[_key(piece)]
    waiting = [piece for piece in pieces if _key(piece) not in found]
    done, begun, told = len(pieces) - len(waiting), time.monotonic(), 0.0
    for piece, answer in _run(work, waiting, processes, begun, seconds):
        if file is not None:
            with file.open("a") as out:
                out.write(json.dumps([list(piece), answer]) + "\n")
        done += 1
        if time.monotonic() - told > _QUIET or done == len(pieces):
            told = time.monotonic()
            print(f"{done} of {len(pieces)} after {told - begun:.0f} s", file=sys.stderr, flush=True)
        yield piece, answer


def _run(
    work: Callable[..., Any], pieces: list[tuple[Any, ...]], processes: int, begun: float, seconds: float | None
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    def late() -> bool:
        return seconds is not None and time.monotonic() - begun > seconds

    if processes == 1:
        for piece in pieces:
            if late():
                return
            yield piece, work(*piece)
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        jobs = {pool.submit(work, *piece): piece for piece in pieces}
        for job in as_completed(jobs):
            yield jobs[job], job.result()
            if late():
                pool.shutdown(wait=False, cancel_futures=True)
                return


def _key(piece: tuple[Any, ...]) -> str:
    return json.dumps(list(piece))


def _read(file: Path | None) -> dict[str, Any]:
    if file is None or not file.exists():
        return {}
    with file.open() as lines:
        return {json.dumps(piece): answer for piece, answer in map(json.loads, lines)}
