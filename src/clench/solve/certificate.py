"""Say what is promised about a solution, and why, or why nothing is (METHOD.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from clench.base.tolerances import ALLOWED_PENETRATION
from clench.grasp.candidates import FingerCandidate
from clench.grasp.containment import contained_link
from clench.grasp.depths import LinkDepth
from clench.grasp.exact import swept_deviation

if TYPE_CHECKING:
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


def certify(problem: Problem, best: Sequence[FingerCandidate], at_start: Sequence[LinkDepth]) -> Certificate:
    """Judge the chosen sets: swept over their whole width, from a start that is free.

    Args:
        problem: the three inputs. best: one set per finger. at_start: depths of the links that rest.
    """
    hand = problem.hand
    for found in at_start:
        if found.depth > ALLOWED_PENETRATION:
            return Certificate(False, f"{hand.links[found.link].name} overlaps the object before anything moves.")
    for c in best:
        name = c.plan.finger.name
        if c.overlap is not None:
            return Certificate(False, f"{name} overlaps the object before it moves.")
        if c.plane is not None:
            return Certificate(False, f"The set of {name} was computed on one plane; between planes nothing is known.")
        if not c.exact:
            return Certificate(False, f"Links of {name} overlap other links of the hand before it moves.")
        # Surfaces that never cross on the way keep what is inside inside: it is enough that nothing is at the start.
        links = c.plan.finger.links
        if (
            contained_link(hand, c.plan.posture, problem.packed, problem.T_palm_object, problem.source, links)
            is not None
        ):
            return Certificate(False, f"{name} overlaps the object before it moves.")
    deviation = swept_deviation(hand, problem.source, problem.packed)
    text = f"No link overlaps the object or, where it must not, the hand itself ({problem.source} geometry)"
    if deviation > 0.0:
        return Certificate(True, f"{text}, but for {deviation * 1e6:.2g} um at cylinders and ellipsoids.", deviation)
    return Certificate(True, f"{text}.")
