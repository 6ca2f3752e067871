"""Examples to calibrate by: a file of pairs and outcomes, whose sides are scores or solves of a record.

{"schema": "clench.examples/1", "record": "record.sqlite",
"pairs": [{"better": {"solve": 3}, "worse": {"solve": 5}},
{"better": {"solve": 3, "finger": "index", "candidate": 4}, "worse": {"solve": 3, "finger": "index", "candidate": 0}},
{"better": {"scores": {"range_of_motion": 1.2}}, "worse": {"scores": {"range_of_motion": 2.0}}}],
"outcomes": [{"of": {"solve": 3}, "held": true}]}
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from clench.core.exceptions import ClenchError, FileError
from clench.core.files.form_errors import form_sentence
from clench.core.files.json_files import non_finite_path, read_json
from clench.core.pose import FloatArray
from clench.scoring.calibration import Calibration
from clench.scoring.criterion_registry import check_numbers, find_criterion
from clench.scoring.fitting import Examples
from clench.solver.solution import GraspSolution, solve_scores

from .record import Record

SCHEMA = "clench.examples/1"


class _Side(msgspec.Struct, forbid_unknown_fields=True):
    scores: dict[str, float] | None = None
    solve: int | None = None
    finger: str | None = None
    candidate: int | None = None


class _Pair(msgspec.Struct, forbid_unknown_fields=True):
    better: _Side
    worse: _Side


class _Outcome(msgspec.Struct, forbid_unknown_fields=True):
    of: _Side
    held: bool


class _File(msgspec.Struct, forbid_unknown_fields=True):
    schema: str
    record: str | None = None
    pairs: list[_Pair] = []
    outcomes: list[_Outcome] = []


@dataclass(frozen=True)
class ScoredExamples:
    """Examples for a calibration, as scores by criterion.

    Args:
        pairs: better and worse. outcomes: scores, and whether it was held.
    """

    pairs: Sequence[tuple[Mapping[str, float], Mapping[str, float]]]
    outcomes: Sequence[tuple[Mapping[str, float], bool]]

    def __add__(self, other: ScoredExamples) -> ScoredExamples:
        return ScoredExamples([*self.pairs, *other.pairs], [*self.outcomes, *other.outcomes])

    def in_numbers(self, calibration: Calibration) -> Examples:
        """Return the examples as numbers by the criteria that all of them have, signed and scaled.

        Raises:
            UnknownNameError: a criterion that does not exist.
        """
        sides = [side for pair in self.pairs for side in pair] + [scores for scores, _ in self.outcomes]
        names = [n for n in dict.fromkeys(n for side in sides for n in side) if all(n in side for side in sides)]
        unit = {name: self._unit(name, calibration) for name in names}

        def rows(found: Sequence[Mapping[str, float]]) -> FloatArray:
            return np.array([[side[n] / unit[n] for n in names] for side in found]).reshape(len(found), len(names))

        return Examples(
            tuple(names),
            rows([better for better, _ in self.pairs]),
            rows([worse for _, worse in self.pairs]),
            rows([scores for scores, _ in self.outcomes]),
            np.array([held for _, held in self.outcomes], dtype=np.bool_),
        )

    @staticmethod
    def _unit(name: str, calibration: Calibration) -> float:
        larger = find_criterion(name, "examples").larger_is_better
        return calibration.scale(name) * (1.0 if larger else -1.0)


def read_examples(path: str | Path) -> ScoredExamples:
    """Read an examples file, with the solves of its record.

    Raises:
        FileError: the file is missing or malformed, or names a solve, a finger or a candidate that is not there. The
            message names the key.
    """
    data = read_json(path, "an examples file")
    bad = non_finite_path(data)
    if bad is not None:
        raise FileError(path, f"{bad}: expected a finite number.")
    try:
        file = msgspec.convert(data, _File)
    except msgspec.ValidationError as error:
        raise FileError(path, form_sentence(error, _File)) from None
    if file.schema != SCHEMA:
        raise FileError(path, f"schema: expected '{SCHEMA}', got {file.schema!r}.")
    solves: dict[int, GraspSolution] = {}
    if file.record is not None:
        with _existing(Path(path).parent / file.record) as record:
            wanted = [side.solve for _, side in _sides(file) if side.solve is not None]
            solves = {number: record.read(number) for number in dict.fromkeys(wanted)}
    scores = {key: _scores(side, solves, f"{path}: {key}", file.record) for key, side in _sides(file)}
    return ScoredExamples(
        [(scores[f"pairs[{i}].better"], scores[f"pairs[{i}].worse"]) for i in range(len(file.pairs))],
        [(scores[f"outcomes[{i}].of"], outcome.held) for i, outcome in enumerate(file.outcomes)],
    )


def recorded_outcomes(path: str | Path) -> ScoredExamples:
    """Return the outcomes that a record holds, see `Record.note_outcome`.

    Raises:
        FileError: the file is missing or is no record.
    """
    with _existing(Path(path)) as record:
        return ScoredExamples([], [(solve_scores(record.read(n)), held) for n, held in record.outcomes()])


def _existing(path: Path) -> Record:
    if not os.path.isfile(path):
        raise FileError(path, "no such record.")
    return Record(path)


def _sides(file: _File) -> list[tuple[str, _Side]]:
    """Return every side of the examples with its key."""
    sides = [(f"pairs[{i}].{key}", getattr(p, key)) for i, p in enumerate(file.pairs) for key in ("better", "worse")]
    return [*sides, *((f"outcomes[{i}].of", outcome.of) for i, outcome in enumerate(file.outcomes))]


def _scores(side: _Side, solves: Mapping[int, GraspSolution], where: str, record: str | None) -> Mapping[str, float]:
    """Return the scores of one side.

    Raises:
        FileError: it names nothing, or something that is not there.
    """
    if (side.scores is None) == (side.solve is None) or (side.finger is None) != (side.candidate is None):
        expected = "'scores' by criterion, or a 'solve' of the record, of which 'finger' and 'candidate' may be told"
        raise FileError(where, f"expected {expected}.")
    if side.scores is not None:
        try:
            return check_numbers(side.scores, "scores", float("-inf"), above=False)
        except ClenchError as error:
            raise FileError(where, str(error)) from None
    assert side.solve is not None
    if record is None:
        raise FileError(where, "names a solve, but the file has no 'record'.")
    solution = solves[side.solve]
    if side.finger is None:
        return solve_scores(solution)
    finger = solution.fingers.get(side.finger)
    if finger is None:
        raise FileError(
            where, f"solve {side.solve} has no finger '{side.finger}'; it has {', '.join(solution.fingers)}."
        )
    if side.candidate is None or not 0 <= side.candidate < len(finger.candidates):
        raise FileError(where, f"candidate: expected 0 to {len(finger.candidates) - 1}, got {side.candidate}.")
    return finger.candidates[side.candidate].scores
