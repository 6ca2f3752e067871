"""Shards: share the units of a job among independent runs."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

from clench.core.exceptions import CommandError

from .units import Unit

#: Names of SLURM's variables of an array: the task, and how tasks are counted.
SLURM = "SLURM_ARRAY_TASK"


@dataclass(frozen=True)
class Shard:
    """One of several runs that share the units of a job.

    Args:
        number: of this run, from 1. of: how many runs there are.

    Raises:
        CommandError: there is no such run.
    """

    number: int = 1
    of: int = 1

    def __post_init__(self) -> None:
        """Refuse invalid shards."""
        if not 1 <= self.number <= self.of:
            raise CommandError(f"shard: expected i/n with i from 1 to n, got {self}.")

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def has(self, unit: Unit) -> bool:
        """Return whether the unit is this run's: the hash of the unit decides."""
        return int(unit.key, 16) % self.of == self.number - 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Return the shard that text like "2/8" names.

        Raises:
            CommandError: it names none.
        """
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip(), re.ASCII)
        if found is None:
            raise CommandError(f"shard: expected i/n with i from 1 to n, such as 2/8, got '{text}'.")
        return cls(int(found[1]), int(found[2]))

    @classmethod
    def of_environment(cls, environment: Mapping[str, str] | None = None) -> Shard:
        """Return the shard of a task of a SLURM array; without an array, the only one.

        The defaults of `SLURM_ARRAY_TASK_MIN` and `SLURM_ARRAY_TASK_STEP` are 0 and 1.

        Raises:
            CommandError: a variable is no number, or tasks of the array are missing between the first and the last.
        """
        variables = os.environ if environment is None else environment
        if f"{SLURM}_ID" not in variables:
            return cls()
        task, first = _number(variables, "ID", None), _number(variables, "MIN", 0)
        count, step = _number(variables, "COUNT", None), _number(variables, "STEP", 1)
        number, rest = divmod(task - first, max(step, 1))
        if rest or not 0 <= number < count:
            raise CommandError(
                f"{SLURM}_ID: expected one of {count} tasks from {first} in steps of {step}, got {task}; "
                "give --shard i/n for an array with gaps."
            )
        return cls(number + 1, count)


def _number(variables: Mapping[str, str], name: str, default: int | None) -> int:
    text = variables.get(f"{SLURM}_{name}", "" if default is None else str(default))
    if not re.fullmatch(r"\d{1,9}", text, re.ASCII):
        raise CommandError(f"{SLURM}_{name}: expected a whole number, got '{text}'; or give --shard i/n.")
    return int(text)
