"""Say what is promised about a solution, and why, or why nothing is (METHOD.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clench.base.pose import FloatArray
from clench.base.tolerances import ALLOWED_PENETRATION
from clench.grasp.candidates import FingerCandidate
from clench.grasp.containment import contained_link, link_within_link
from clench.grasp.depths import LinkDepth
from clench.grasp.exact import hand_bodies, swept_deviation

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays

    from .controller import Problem


@dataclass(frozen=True)
class Certificate:
    """Promise that no link overlaps anything it must not, at the grasp and on the way to it; or say why not.

    Args:
        holds: whether it is promised. text: a sentence.
        deviation: how far round shapes that are swept as polyhedra may lie outside of these [m].
    """

    holds: bool
    text: str
    deviation: float = 0.0


def certify(
    problem: Problem,
    best: Sequence[FingerCandidate],
    at_start: Sequence[LinkDepth],
    final: FloatArray,
    exact: ExactArrays,
) -> Certificate:
    """Judge the chosen sets: swept over their whole width, from a start that is free; and the whole hand at the end.

    Args:
        problem: the three inputs. best: one set per finger. at_start: depths of the links that rest.
        final: posture at the end, shape (J,) [rad]. exact: the hand as it was swept.
    """
    hand = problem.hand
    for found in at_start:
        if found.depth > ALLOWED_PENETRATION:
            return Certificate(False, f"{hand.links[found.link].name} overlaps the object before anything moves.")
    opened = problem.start.copy()
    for c in best:
        name = c.plan.finger.name
        if c.overlap is not None:
            return Certificate(False, f"{name} overlaps the object before it moves.")
        if c.plane is not None:
            return Certificate(False, f"The set of {name} was computed on one plane; between planes nothing is known.")
        if not c.exact:
            return Certificate(False, f"Links of {name} overlap other links of the hand before it moves.")
        own = list(c.plan.finger.joints)
        opened[own] = c.plan.posture[own]
    overlap = _overlap(problem, opened, final, exact)
    if overlap:
        return Certificate(False, overlap)
    deviation = swept_deviation(hand, problem.source, problem.packed)
    text = f"No link overlaps the object or, where it must not, the hand itself ({problem.source} geometry)"
    if deviation > 0.0:
        return Certificate(True, f"{text}, but for {deviation * 1e6:.2g} um at cylinders and ellipsoids.", deviation)
    return Certificate(True, f"{text}.")


def _overlap(problem: Problem, opened: FloatArray, final: FloatArray, exact: ExactArrays) -> str:
    """Return a sentence about links that overlap something at the end, or lie in the object at the start; else empty.

    Surfaces that never cross on the way keep what is inside inside: it is enough that nothing is at the start.
    """
    from clench.kernels.exact import find_link_overlap

    hand, T = problem.hand, problem.T_palm_object
    links = [link for finger in hand.fingers for link in finger.links]
    inside = contained_link(hand, opened, problem.packed, T, problem.source, links)
    if inside is not None:
        return f"{hand.links[inside].name} overlaps the object before anything moves."
    checked = hand_bodies(hand, problem.source).across
    pair = link_within_link(hand, opened, problem.source, checked)
    if pair is not None:
        return f"{hand.links[pair[0]].name} lies inside {hand.links[pair[1]].name} before anything moves."
    everything = exact._replace(object=problem.packed.bodies, checked=checked)
    poses = np.ascontiguousarray(hand.link_poses(final)[:, :3])
    one, other = find_link_overlap(everything, poses, np.ascontiguousarray(T[:3]), ALLOWED_PENETRATION)
    if one < 0:
        return ""
    what = hand.links[other].name if other < len(hand.links) else "the object"
    return f"{hand.links[one].name} overlaps {what} at the end."
