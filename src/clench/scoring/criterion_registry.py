"""The registry of criteria: built-in ones, ones that users register, and ones of installed packages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from numbers import Real
from typing import Final, TypeGuard

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.pose import FloatArray

from .criterion_types import Criterion, HandCriterion, ScoringContext
from .finger_criteria import (
    Clearance,
    LimitDistance,
    NextStepDistance,
    NextStepTime,
    PadIndentation,
    PoseSensitivity,
    RangeOfMotion,
    TouchingLinks,
)
from .hand_criteria import (
    ActuationForce,
    ActuationForceAnyWay,
    ActuationForceSixPulls,
    ActuationForceTask,
    EpsilonQuality,
    TendonTension,
)

#: Installed packages name their criteria under this group of entry points: `name = "module:Class"`.
ENTRY_POINTS: Final = "clench.criteria"
#: Every candidate has the scores of these criteria, whatever the weights. They cost little, and readers expect them.
ALWAYS: Final = ("range_of_motion", "touching_links", "limit_distance")

_KINDS: Final = {"name": str, "unit": str, "source": str, "scale": Real, "larger_is_better": bool}
_SAID: Final = {str: "text", Real: "a number above 0", bool: "True or False"}
_BUILT_IN: Final[Mapping[str, Criterion | HandCriterion]] = {
    c.name: c
    for c in (
        RangeOfMotion(),
        TouchingLinks(),
        LimitDistance(),
        NextStepTime(),
        NextStepDistance(),
        PadIndentation(),
        Clearance(),
        PoseSensitivity(),
        EpsilonQuality(),
        ActuationForce(),
        ActuationForceAnyWay(),
        ActuationForceSixPulls(),
        ActuationForceTask(),
        TendonTension(),
    )
}
_registry: dict[str, Criterion | HandCriterion] = dict(_BUILT_IN)


def register_criterion(criterion: Criterion | HandCriterion) -> None:
    """Add a criterion, or replace the one of the same name.

    Raises:
        CommandError: it is a class, lacks a member of `Criterion` or `HandCriterion`, or has one of another kind; its
            scale is not above 0.
    """
    if isinstance(criterion, type):
        raise CommandError(
            f"criterion {criterion.__name__}: expected an object, got its class; register what it makes."
        )
    what = type(criterion).__name__
    missing = [name for name in _KINDS if not hasattr(criterion, name)]
    if not isinstance(criterion, Criterion | HandCriterion):
        missing = missing or ["score (or score_hand)"]
    if missing:
        raise CommandError(f"criterion {what}: has no {', '.join(missing)}; see clench.Criterion.")
    for name, kind in _KINDS.items():
        value = getattr(criterion, name)
        if not isinstance(value, kind) or (kind is Real and isinstance(value, bool)):
            raise CommandError(f"criterion {what}: {name}: expected {_SAID[kind]}, got {value!r}.")
    if not (math.isfinite(criterion.scale) and criterion.scale > 0.0):
        raise CommandError(f"criterion {what}: scale: expected a number above 0, got {criterion.scale!r}.")
    _registry[criterion.name] = criterion


def criterion_names() -> tuple[str, ...]:
    """Return the names of all criteria, including those of installed packages."""
    _load_installed()
    return tuple(_registry)


def find_criterion(name: str, source: str) -> Criterion | HandCriterion:
    """Return a criterion by name; installed packages are looked at only for names that are not known yet.

    Raises:
        UnknownNameError: no such criterion; `source` says which text named it.
    """
    if name not in _registry:
        _load_installed()
    if name not in _registry:
        raise UnknownNameError("criterion", name, source, _registry)
    return _registry[name]


@cache
def _load_installed() -> None:
    """Register the criteria of installed packages.

    Raises:
        CommandError: a criterion cannot be loaded.
    """
    from importlib.metadata import entry_points

    for point in entry_points(group=ENTRY_POINTS):
        try:
            criterion = point.load()()
        except Exception as error:  # whatever a package of somebody else raises
            raise CommandError(
                f"criterion '{point.name}' of package '{point.value}' cannot be loaded: {error}."
            ) from None
        register_criterion(criterion)


def is_built_in(names: Iterable[str]) -> bool:
    """Say whether the given and the always-scored criteria are built in, and none is a replacement."""
    return all(_registry[name] is _BUILT_IN.get(name) for name in (*ALWAYS, *names))


def is_of_hand(criterion: Criterion | HandCriterion) -> TypeGuard[HandCriterion]:
    """Say whether a criterion judges all fingers together; asking the protocol takes a hundred times as long."""
    return hasattr(criterion, "score_hand")


def is_of_finger(criterion: Criterion | HandCriterion) -> TypeGuard[Criterion]:
    """Say whether a criterion judges the candidates of one finger."""
    return not is_of_hand(criterion)


def score_candidates(candidates: Sequence[FingerCandidate], names: Iterable[str], context: ScoringContext) -> None:
    """Fill the scores of candidates for the always-scored and the named criteria; a criterion may give no score.

    Raises:
        CommandError: a criterion gave a value that is not a finite number.
    """
    requested = dict.fromkeys([*ALWAYS, *names])
    criteria = [c for c in map(_registry.__getitem__, requested) if is_of_finger(c)]
    for candidate in candidates:
        for criterion in criteria:
            value = criterion.score(candidate, context)
            if value is not None:
                candidate.scores[criterion.name] = checked_value(criterion, value)


def prepare_hand(candidates: Sequence[FingerCandidate], names: Iterable[str], context: ScoringContext) -> None:
    """Give all candidates to the named criteria that prepare for judging combinations."""
    for name in names:
        prepare = getattr(_registry[name], "prepare", None)
        if prepare is not None:
            prepare(candidates, context)


def ideal_value(name: str) -> float | None:
    """Return the value that no candidates of the whole hand can beat, where a criterion says one."""
    ideal = getattr(_registry[name], "ideal", None)
    return None if ideal is None else float(ideal)


def bound_hand(
    name: str, groups: Sequence[Sequence[FingerCandidate]], places: tuple[int, ...], context: ScoringContext
) -> FloatArray | None:
    """Return a criterion's bounds of all combinations, if it gives any; see `HandCriterion`."""
    bound = getattr(_registry[name], "bound", None)
    found = None if bound is None else bound(groups, places, context)
    return None if found is None else np.asarray(found, dtype=np.float64)


def score_hand(chosen: Sequence[FingerCandidate], names: Iterable[str], context: ScoringContext) -> dict[str, float]:
    """Return the values of the named whole-hand criteria for one candidate per finger.

    Raises:
        CommandError: a criterion gave a value that is not a finite number.
    """
    scores = {}
    for name in names:
        criterion = _registry[name]
        value = criterion.score_hand(chosen, context) if is_of_hand(criterion) else None
        if value is not None:
            scores[name] = checked_value(criterion, value)
    return scores


def checked_value(criterion: Criterion | HandCriterion, value: float) -> float:
    """Return a criterion's value as a plain number.

    Raises:
        CommandError: it is not a finite number, or too large to be summed.
    """
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise CommandError(f"criterion '{criterion.name}': gave {value!r}; expected a finite number or None.")
    if abs(number) > LARGEST_VALUE:
        raise CommandError(f"criterion '{criterion.name}': gave {value!r}; expected {LARGEST_VALUE:g} at most in size.")
    return number


#: Weights, scales and limits are at most this, and scales at least its inverse, so that no sum of them overflows [-].
LARGEST = 1e12
#: Values that a criterion gives are at most this in size, for the same reason [the criterion's unit].
LARGEST_VALUE: Final = 1e100


def check_numbers(values: Mapping[str, float], source: str, least: float, above: bool) -> dict[str, float]:
    """Return numbers by criterion whose names exist and which are finite and not too small.

    Args:
        values: by criterion. source: names them in messages. least: smallest allowed. above: it is not allowed itself.

    Raises:
        UnknownNameError: no such criterion. CommandError: a number that is too small or not finite.
    """
    for name, value in values.items():
        find_criterion(name, source)
        if not abs(value) <= LARGEST or value < least or (above and value < 1.0 / LARGEST):
            expected = (
                "a finite number" if math.isinf(least) else f"a number {'above' if above else 'of at least'} {least:g}"
            )
            if math.isfinite(value) and value > least:
                expected += f", between {1.0 / LARGEST:g} and {LARGEST:g} in size"
            raise CommandError(f"{source}.{name}: expected {expected}, got {value!r}.")
    return {name: float(value) for name, value in values.items()}
