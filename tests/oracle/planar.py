"""The planar oracle: close a finger by conservative advancement on exact distances, with no closed form anywhere.

A stage stops at the first place from which going on would open a gap below ``-tolerance`` (judge by gap, not by angle).
Touching at the start needs no rule here: a pair that leaves never violates, a pair that blocks violates at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from .compiled import Floats
from .distances import finger_gap
from .marching import BUDGET, VIOLATED, march_all
from .scene import PlanarCurve, PlanarFinger, PlanarOutline

__all__ = [
    "PlanarCurve",
    "PlanarFinger",
    "PlanarOutline",
    "StageAnswer",
    "Violation",
    "earliest_violation",
    "gap_at",
    "oracle_close",
    "oracle_stage",
    "overlaps_at_start",
]

Ended = Literal["contact", "limit"]
BUDGET_PER_OUTLINE = 300_000


@dataclass(frozen=True)
class StageAnswer:
    """How one stage ended: the degree of freedom's parameter there (at least 0), and by what. Blocked at once:
    ``contact`` at 0.
    """

    dof: int
    parameter: float
    ended: Ended


@dataclass(frozen=True)
class Violation:
    """The first place on a path with a gap of ``-tolerance`` or less; not ``proven``: the walk gave up there."""

    dof: int
    parameter: float
    outline: int
    last_open: float
    proven: bool


@dataclass(frozen=True)
class Walk:
    """What a walk along one stage found: a violation or none, the least gap seen, the evaluations it took."""

    violation: Violation | None
    least_gap: float
    looks: int


def gap_at(finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, first_joint: int = 0) -> float:
    """Return the least signed gap [m] of the outlines from ``first_joint`` outwards at degree of freedom parameters
    (G,).
    """
    return float(finger_gap(finger.packed, curve.packed, finger.angles(parameters), first_joint)[0])


def overlaps_at_start(finger: PlanarFinger, curve: PlanarCurve) -> bool:
    """Tell whether the open finger is already deeper in the curve than the tolerance."""
    return gap_at(finger, curve, np.zeros(finger.dofs)) < -finger.tolerance


def pieces(
    finger: PlanarFinger, parameters: Floats, dof: int, start: float, end: float
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield (base, rates, span) of a stage, cut where a follower reaches its limit; angles are base + rates * s."""
    members = finger.dof == dof
    arrests = np.where(members, finger.limits / np.abs(finger.rates), np.inf)
    arrests[finger.leader(dof)] = np.inf
    cuts = [start, *sorted({float(a) for a in arrests if start < a < end}), end]
    held = finger.angles(parameters)
    for a, b in pairwise(cuts):
        moving = members & (arrests >= b)
        still = np.where(members, np.sign(finger.rates) * finger.limits, held)
        yield np.where(moving, 0.0, still), np.where(moving, finger.rates, 0.0), np.array([a, b])


def walk_stage(
    finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, dof: int, start: float, end: float
) -> Walk:
    """Walk a stage from ``start`` to ``end``, the other degrees of freedom at ``parameters``, and report the first
    violation.
    """
    leader = finger.leader(dof)
    least, looks, last_open = np.inf, 0, np.nan
    for base, rate, span in pieces(finger, parameters, dof, start, end):
        status, s, open_at, low, outline, count = march_all(
            finger.packed, curve.packed, base, rate, span, leader, finger.tolerance, BUDGET_PER_OUTLINE
        )
        least, looks = min(least, low), looks + count
        last_open = last_open if np.isnan(open_at) else open_at
        if status in (VIOLATED, BUDGET):
            return Walk(Violation(dof, s, outline, last_open, status == VIOLATED), least, looks)
    return Walk(None, least, looks)


def oracle_stage(finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, dof: int) -> StageAnswer:
    """Advance one degree of freedom from 0, the others at ``parameters`` (G,), to its first contact or its leader's
    limit.

    Raises ``ArithmeticError`` where the walk takes too many steps to prove anything.
    """
    travel = finger.travel(dof)
    violation = walk_stage(finger, curve, parameters, dof, 0.0, travel).violation
    if violation is None:
        return StageAnswer(dof, travel, "limit")
    if not violation.proven:
        raise ArithmeticError(f"group {dof} could not be walked past {violation.parameter}")
    return StageAnswer(dof, _last_touch(finger, curve, parameters, violation), "contact")


def _last_touch(finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, violation: Violation) -> float:
    """Return the parameter of gap 0 next before a violation, by bisection; 0 if the gap was never open."""
    leader = finger.leader(violation.dof)
    open_at, shut_at = violation.last_open, violation.parameter
    if np.isnan(open_at):
        return 0.0
    trial = parameters.copy()
    for _ in range(200):
        middle = 0.5 * (open_at + shut_at)
        if middle in (open_at, shut_at):
            break
        trial[violation.dof] = middle
        if gap_at(finger, curve, trial, leader) >= 0.0:
            open_at = middle
        else:
            shut_at = middle
    return open_at


def oracle_close(finger: PlanarFinger, curve: PlanarCurve) -> tuple[StageAnswer, ...]:
    """Close proximal first: one stage per degree of freedom, each from the posture where the ones before it ended."""
    parameters = np.zeros(finger.dofs)
    answers = []
    for dof in range(finger.dofs):
        answers.append(oracle_stage(finger, curve, parameters, dof))
        parameters[dof] = answers[-1].parameter
    return tuple(answers)


def earliest_violation(finger: PlanarFinger, curve: PlanarCurve, stages: Sequence[StageAnswer]) -> Violation | None:
    """Walk the path of an answer and return where the gap first falls to ``-tolerance``; None: nowhere.

    Not a sampling: the steps are bounded such that nothing between two evaluations can be deeper.
    """
    parameters = np.zeros(finger.dofs)
    for stage in stages:
        walk = walk_stage(finger, curve, parameters, stage.dof, 0.0, stage.parameter)
        if walk.violation is not None:
            return walk.violation
        parameters[stage.dof] = stage.parameter
    return None
