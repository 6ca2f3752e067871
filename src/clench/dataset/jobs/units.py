"""Units of work: a part of the grasps of one hand, object and scale."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from clench.core.caching.fingerprint import fingerprint


@dataclass(frozen=True)
class Unit:
    """A piece of work. Its result depends only on the unit and on the options of the job.

    Args:
        job_seed: seed of the job. hand, object: models. scale: of the object [-].
        part: which part of the grasps of these, from 0. count: how many grasps are wanted.
    """

    job_seed: int
    hand: str
    object: str
    scale: float
    part: int
    count: int

    @cached_property
    def key(self) -> str:
        """A name of 24 hexadecimal digits, from the hash of the unit."""
        return self._hash("unit")[:24]

    @cached_property
    def seed(self) -> int:
        """The seed of the planner for this unit, from the hash of the unit."""
        return int(self._hash("seed")[:15], 16)

    def in_words(self) -> str:
        """Return how messages name the unit."""
        scale = "" if self.scale == 1.0 else f" at scale {self.scale:g}"
        return f"'{self.hand}' on '{self.object}'{scale}, part {self.part + 1}"

    def _hash(self, what: str) -> str:
        return fingerprint(what, self.job_seed, self.hand, self.object, self.scale, self.part, self.count)
