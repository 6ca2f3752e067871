"""What may come of an input: a finite answer, or one sentence that names what is wrong; all else is a mistake."""

import contextlib
import io
import math
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from clench.core.exceptions import ClenchError

#: No input may take longer [s].
SLOW = 60.0
#: No sentence may be longer; lists of names are cut to this.
LONG = 3000


@dataclass(frozen=True)
class Outcome:
    """Hold what came of one input: `answer`, `error`, or a mistake, with details."""

    kind: str
    text: str = ""

    @property
    def fine(self) -> bool:
        """Whether nothing is wrong."""
        return self.kind in ("answer", "error")


@dataclass(frozen=True)
class Trial:
    """Hold one input to try.

    Args:
        kind: of input. run: gives an answer, or raises. names: a message must have one of these, unless empty.
    """

    kind: str
    run: Callable[[], Any]
    names: tuple[str, ...] = ()


class WrongAnswerError(Exception):
    """Say that an answer is not what it should be."""


def outcome_of(trial: Trial) -> Outcome:
    """Try an input and judge what comes of it."""
    start = time.perf_counter()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("error", RuntimeWarning)
            answer = trial.run()
        bad = next(not_finite(answer, "answer"), None)
        result = Outcome("answer") if bad is None else Outcome("not finite", bad)
    except ClenchError as error:
        result = _sentence(str(error), trial.names)
    except WrongAnswerError as error:
        result = Outcome("wrong", str(error))
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)
        ours = [f for f in where if "/clench/" in f.filename] or where
        place = f"{ours[-1].filename.rpartition('/clench/')[2]}:{ours[-1].lineno} {ours[-1].name}"
        result = Outcome("exception", f"{type(error).__name__} at {place}: {str(error)[:300]}")
    seconds = time.perf_counter() - start
    return Outcome("slow", f"{seconds:.1f} s") if result.fine and seconds > SLOW else result


def _sentence(text: str, names: tuple[str, ...]) -> Outcome:
    if "\n" in text or "\0" in text:
        return Outcome("several lines", repr(text[:300]))
    if len(text) > LONG:
        return Outcome("long", text[:300])
    if len(text) < 15 or (names and not any(name in text for name in names)):
        return Outcome("names nothing", text[:300])
    return Outcome("error", text[:300])


def not_finite(value: Any, path: str) -> Iterator[str]:
    """Give the path of every number that is NaN or infinite in an answer."""
    if isinstance(value, float | np.floating):
        if not math.isfinite(value) and "t_max" not in path:
            yield path
    elif isinstance(value, np.ndarray):
        # No limit is a limit: `t_max` of tendons.
        if not path.endswith("t_max") and value.dtype.kind == "f" and not np.isfinite(value).all():
            yield path
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from not_finite(item, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            yield from not_finite(item, f"{path}[{i}]")
    elif is_dataclass(value) and not isinstance(value, Enum | type):
        for field in fields(value):
            yield from not_finite(getattr(value, field.name), f"{path}.{field.name}")
