"""`clench record`: list and show recorded solves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from clench.apps.cli.inputs.choices import Status
from clench.core.exceptions import CommandError, FileError


def record(
    path: Path,
    /,
    *,
    id: int | None = None,
    outcome: Literal["held", "dropped"] | None = None,
    hand: str | None = None,
    object: str | None = None,
    status: Status | None = None,
    limit: int = 20,
    json: bool = False,
) -> int:
    """List a record of solves, newest first, or show one of them.

    Args:
        path: the record (SQLite file).
        id: show the solution with this number.
        outcome: record the outcome of its execution, for `clench calibrate`.
        hand: only solves of this hand.
        object: only solves of this object.
        status: only solves that ended so.
        limit: how many to list.
        json: print one JSON document on standard output.
    """
    from dataclasses import asdict

    import clench
    from clench.apps.cli.output.printing import print_entries, print_solution
    from clench.apps.cli.output.results import print_json

    if not os.path.isfile(path):
        raise FileError(path, "no such record.")
    if outcome is not None and id is None:
        raise CommandError("record: --outcome belongs to a solve; give its --id.")
    if limit < 1:
        raise CommandError(f"--limit: expected at least 1, got {limit}.")
    with clench.Record(path) as recorded:
        if id is not None and outcome is not None:
            recorded.note_outcome(id, held=outcome == "held")
        if id is not None:
            solution = recorded.read(id)
            if json:
                print_json(solution.to_dict())
            else:
                print_solution(solution, [], [])
            return 0
        entries = recorded.find(hand=hand, object=object, status=status, limit=limit)
        if json:
            print_json({"schema": "clench.record/1", "solves": [asdict(entry) for entry in entries]})
        else:
            print_entries(entries, len(recorded))
    return 0
