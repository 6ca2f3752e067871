"""Judge a solution by itself: list the reasons that make it unfit to execute."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from clench.core.caching.deferring import DeferredMapping
from clench.core.tolerances import ALLOWED_PENETRATION, CONTACT_OVERLAP, PASSED_GAP

from .solution import Contact, FingerResult, FingerStatus, GraspSolution

#: If a candidate is not certified over its width, links may overlap this far between two curl planes [m].
SAMPLED_PENETRATION = 1e-3
#: Angles may exceed a limit by rounding only [rad].
LIMIT_SLACK = 1e-9
#: Normals are unit up to this [-].
UNIT_SLACK = 1e-6


def violations(solution: GraspSolution) -> tuple[str, ...]:
    """Return a sentence for everything that makes a solution unfit to execute; empty when there is nothing.

    Checks: all numbers present are finite; no penetration exceeds the allowance; the chosen candidates are feasible and
    give the solution's angles; angles are inside the joints' limits; contacts that did not pass touch.
    """
    numbers = tuple(_non_finite(solution))
    if numbers:
        return numbers  # comparisons with NaN would add nothing true
    return (
        *_penetration(solution),
        *_limits(solution),
        *(sentence for name, finger in solution.fingers.items() for sentence in _finger(name, finger, solution)),
        *(sentence for i, contact in enumerate(solution.contacts) for sentence in _contact(i, contact, solution)),
    )


def _penetration(solution: GraspSolution) -> Iterator[str]:
    depth = solution.max_penetration
    allowed = ALLOWED_PENETRATION if solution.certified else SAMPLED_PENETRATION
    if depth is not None and depth > allowed:
        yield f"The hand penetrates the object by {depth:.3g} m; allowed: {allowed:g} m."


def _limits(solution: GraspSolution) -> Iterator[str]:
    for name, angle in solution.joint_angles.items():
        lower, upper = solution.joint_limits.get(name, (-math.inf, math.inf))
        if not lower - LIMIT_SLACK <= angle <= upper + LIMIT_SLACK:
            yield f"Joint '{name}' is at {angle:.6g} rad, outside its limits {lower:.6g} to {upper:.6g} rad."


def _finger(name: str, finger: FingerResult, solution: GraspSolution) -> Iterator[str]:
    chosen = finger.best
    if chosen is None:
        count = len(finger.candidates)
        if count:
            yield f"Finger '{name}' has {count} candidates, but number {finger.chosen} is the chosen one."
        elif finger.status is FingerStatus.TOUCH:
            yield f"Finger '{name}' is said to touch but has no candidate."
        return
    sampled = not solution.certified and chosen.penetration is not None and chosen.penetration <= SAMPLED_PENETRATION
    if chosen.feasible is False and not sampled:
        depth = f" by {chosen.penetration:.3g} m" if chosen.penetration else ""
        yield f"The chosen candidate of finger '{name}' is not feasible: it or its path penetrates{depth}."
    for joint, angle in chosen.joint_angles.items():
        given = solution.joint_angles.get(joint)
        if given is None:
            yield f"Joint '{joint}' of finger '{name}' has no angle in the solution."
        elif given != angle:
            yield f"Joint '{joint}' is at {given:.9g} rad in the solution, at {angle:.9g} rad in the chosen candidate."


def _contact(index: int, contact: Contact, solution: GraspSolution) -> Iterator[str]:
    where = f"Contact {index} ({contact.finger}, {contact.link})"
    if contact.finger not in solution.fingers:
        yield f"{where} belongs to a finger that the solution does not have."
    if contact.gap < -CONTACT_OVERLAP:
        yield f"{where} overlaps the object by {-contact.gap:.3g} m."
    if not contact.passed and contact.gap > PASSED_GAP:
        yield f"{where} is {contact.gap:.3g} m away from the object but not marked as passed."
    length = math.hypot(*contact.normal)
    if abs(length - 1.0) > UNIT_SLACK:
        yield f"{where} has a normal of length {length:.6g}, expected 1."


def _non_finite(solution: GraspSolution) -> Iterator[str]:
    parts: dict[str, Any] = {
        "joint_angles": solution.joint_angles,
        "open_angles": solution.open_angles,
        "decomposition": solution.decomposition,
        "max_penetration": solution.max_penetration,
        "pregrasp": solution.pregrasp,
        "contacts": solution.contacts,
        "fingers": solution.fingers,
    }
    for name, part in parts.items():
        yield from (f"{path} is not a finite number." for path in _bad_numbers(part, name))


def _bad_numbers(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, float | np.floating | np.ndarray):
        if not np.isfinite(value).all():
            yield path
    elif isinstance(value, DeferredMapping) and not value.is_made:
        return
    elif isinstance(value, FingerResult):
        for i, candidate in value.made.items():
            yield from _bad_numbers(candidate, f"{path}.candidates[{i}]")
        yield from _bad_numbers(value.cause, f"{path}.cause")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _bad_numbers(item, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            yield from _bad_numbers(item, f"{path}[{i}]")
    elif hasattr(value, "__dataclass_fields__"):
        for key in value.__dataclass_fields__:
            yield from _bad_numbers(getattr(value, key), f"{path}.{key}")
