"""Criteria that judge a candidate: each a number with a unit and a direction (METHOD.md section 6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from clench.base.errors import CommandError, UnknownNameError
from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .candidates import FingerCandidate


@dataclass(frozen=True, eq=False)
class Setting:
    """Hold what a candidate is judged in: the hand, and the posture it starts from, shape (J,) [rad]."""

    hand: Hand
    start: FloatArray


@runtime_checkable
class Criterion(Protocol):
    """Judge a candidate by one number; write a class with these members and `register` it to add your own.

    Attributes:
        name: as weights name it. unit: of the value. scale: the value that counts as 1 in the weighted sum.
        larger_is_better: the direction.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    scale: ClassVar[float]
    larger_is_better: ClassVar[bool]

    def score(self, candidate: FingerCandidate, setting: Setting) -> float:
        """Return the value of a candidate."""
        ...


class RangeOfMotion:
    """Sum |Δq| from the start over the finger's own joints [rad]: least motion is best."""

    name: ClassVar[str] = "range_of_motion"
    unit: ClassVar[str] = "rad"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate: FingerCandidate, setting: Setting) -> float:
        """Return Σ |Δq| [rad]."""
        own = list(candidate.plan.finger.joints)
        return float(np.abs(candidate.q[own] - setting.start[own]).sum())


class TouchingLinks:
    """Count the links that touch the object at the end: more links share the load."""

    name: ClassVar[str] = "touching_links"
    unit: ClassVar[str] = "links"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = True

    def score(self, candidate: FingerCandidate, setting: Setting) -> float:
        """Return the number of touching links."""
        return float(len({t.link for t in candidate.holding}))


class LimitDistance:
    """Measure how far the closing joints stay from their limits, as a fraction of their range, the nearest one."""

    name: ClassVar[str] = "limit_distance"
    unit: ClassVar[str] = "fraction of the range"
    scale: ClassVar[float] = 0.5
    larger_is_better: ClassVar[bool] = True

    def score(self, candidate: FingerCandidate, setting: Setting) -> float:
        """Return the least distance to a limit in the closing direction, 0 to 1."""
        least = 1.0
        for p in candidate.plan.joints:
            joint = setting.hand.joints[p.joint]
            limit = joint.upper if joint.direction > 0 else joint.lower
            span = joint.upper - joint.lower
            if span > 0.0:
                least = min(least, abs(limit - candidate.q[p.joint]) / span)
        return float(least)


_REGISTRY: dict[str, Criterion] = {c.name: c for c in (RangeOfMotion(), TouchingLinks(), LimitDistance())}

#: Weights used unless a command or a calibration file gives others.
DEFAULT_WEIGHTS: Mapping[str, float] = {"range_of_motion": 1.0, "touching_links": 1.0, "limit_distance": 0.2}


def register(criterion: Criterion) -> None:
    """Add a criterion, or replace the one of the same name."""
    _REGISTRY[criterion.name] = criterion


def criterion_names() -> tuple[str, ...]:
    """Return the names of all criteria."""
    return tuple(_REGISTRY)


def check_weights(weights: Mapping[str, float], source: str) -> dict[str, float]:
    """Return weights whose names exist and whose values are finite and not negative.

    Raises:
        UnknownNameError: no such criterion. CommandError: a weight that is negative or not finite.
    """
    for name, weight in weights.items():
        if name not in _REGISTRY:
            raise UnknownNameError("criterion", name, source, _REGISTRY)
        if not np.isfinite(weight) or weight < 0.0:
            raise CommandError(f"{source}.{name}: expected a weight of at least 0, got {weight!r}.")
    return dict(weights)


def score_all(candidate: FingerCandidate, setting: Setting) -> dict[str, float]:
    """Return the value of every criterion for a candidate."""
    return {name: criterion.score(candidate, setting) for name, criterion in _REGISTRY.items()}


def weigh(scores: Mapping[str, float], weights: Mapping[str, float]) -> float:
    """Return the weighted sum of scaled scores, larger is better [-]."""
    total = 0.0
    for name, weight in weights.items():
        criterion = _REGISTRY[name]
        sign = 1.0 if criterion.larger_is_better else -1.0
        total += sign * weight * scores[name] / criterion.scale
    return total
