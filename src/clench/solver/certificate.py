"""Judge the certificate of a solution: the guarantee, or the reason why it fails (docs/method.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.closing.collision.containment import contained_link, link_within_link
from clench.closing.collision.depths import LinkDepth, hand_depths
from clench.closing.link_bodies import hand_bodies, swept_deviation
from clench.closing.linkage import placed_links
from clench.core.pose import FloatArray
from clench.core.tolerances import ALLOWED_PENETRATION

if TYPE_CHECKING:
    from clench.kernels.toi.full_width import FullWidthArrays

    from .problem import Problem


class CertificateCode(StrEnum):
    """Name the guarantee, or the reason why there is none."""

    CERTIFIED = "certified"
    """no link overlaps anything forbidden, at the grasp or on the way"""
    BLOCKED_AT_START = "blocked_at_start"
    """a link overlaps the object or an obstacle before anything moves"""
    ONE_PLANE = "one_plane"
    """a candidate was computed on one plane, and nothing is known beside it"""
    SELF_COLLISION_AT_START = "self_collision_at_start"
    """links of the hand overlap, or one lies inside another, before anything moves"""
    OVERLAP_AT_END = "overlap_at_end"
    """links overlap something at the grasp"""


@dataclass(frozen=True)
class Certificate:
    """Promise that no link overlaps anything it must not, at the grasp and on the way to it; or say why not.

    Args:
        holds: whether it is promised. text: a sentence.
        deviation: largest distance of links or object from their swept shapes [m], for round shapes swept as polyhedra.
        code: see `CertificateCode`. links: names of those that overlap. finger: the finger in question, or None.
    """

    holds: bool
    text: str
    deviation: float = 0.0
    code: CertificateCode = CertificateCode.CERTIFIED
    links: tuple[str, ...] = ()
    finger: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {**values, "links": list(self.links)}


def _refused(code: CertificateCode, text: str, links: Sequence[str] = (), finger: str | None = None) -> Certificate:
    return Certificate(False, text, code=code, links=tuple(links), finger=finger)


def judge(
    problem: Problem,
    best: Sequence[FingerCandidate],
    final: FloatArray,
    full_width: FullWidthArrays,
    promise: Certificate | None = None,
) -> tuple[Sequence[LinkDepth], Sequence[LinkDepth] | None, Certificate]:
    """Measure the overlaps at the start and at the end over the full width, and state the guarantee.

    Args:
        problem: the three inputs. best: one candidate per finger. final: posture at the end, shape (J,) [rad].
        full_width: the hand as it was swept. promise: the guarantee, if known.

    Returns:
        depths of the links that no finger moves, before closing; of all links, at the end, or None where that is not
        asked for; and the certificate.
    """
    hand, packed, T = problem.hand, problem.packed, problem.T_palm_object
    at_start = hand_depths(hand, problem.start, packed, T, problem.source, links=hand.fixed_links)
    certificate = promise or certify(problem, best, at_start, final, full_width)
    # If nothing can overlap, only the resting bodies need a measurement.
    at_end = at_start if certificate.holds else None
    if at_end is None and problem.command.measure:
        at_end = hand_depths(hand, final, packed, T, problem.source)
    return at_start, at_end, certificate


def certify(
    problem: Problem,
    best: Sequence[FingerCandidate],
    at_start: Sequence[LinkDepth],
    final: FloatArray,
    full_width: FullWidthArrays,
) -> Certificate:
    """Say what is certified: chosen candidates swept over their full width from a free start, and the hand at the end.

    Args:
        problem: the three inputs. best: one candidate per finger. at_start: depths of the links that rest.
        final: posture at the end, shape (J,) [rad]. full_width: the hand as it was swept.
    """
    hand = problem.hand
    for found in at_start:
        if found.depth > ALLOWED_PENETRATION:
            link = hand.links[found.link].name
            text = f"{link} overlaps the object before anything moves."
            return _refused(CertificateCode.BLOCKED_AT_START, text, [link])
    opened = problem.start.copy()
    for c in best:
        name = c.plan.finger.name
        if c.overlap is not None and not c.late:
            link = hand.links[c.overlap.link].name
            text = f"{name} overlaps the object before it moves."
            return _refused(CertificateCode.BLOCKED_AT_START, text, [link], name)
        if c.plane is not None:
            text = f"The candidate of {name} was computed on one plane; between planes nothing is known."
            return _refused(CertificateCode.ONE_PLANE, text, finger=name)
        if not c.swept:
            text = f"Links of {name} overlap other links of the hand before it moves."
            links = _overlapping(problem, c.plan.posture, full_width)
            return _refused(CertificateCode.SELF_COLLISION_AT_START, text, links, name)
        own = c.plan.finger.own
        opened[own] = c.plan.posture[own]
    overlap = _overlap(problem, opened, final, full_width)
    if overlap is not None:
        return overlap
    return promised(problem)


def promised(problem: Problem) -> Certificate:
    """Return the promise for a problem whose answer keeps it."""
    hand = problem.hand
    deviation = swept_deviation(hand, problem.source, problem.packed)
    text = f"No link overlaps the object or, where it must not, the hand itself ({problem.source} geometry)"
    but = f", but for {deviation * 1e6:.2g} um at cylinders and ellipsoids" if deviation > 0.0 else ""
    return Certificate(True, f"{text}{but}.", deviation)


def _overlap(
    problem: Problem, opened: FloatArray, final: FloatArray, full_width: FullWidthArrays
) -> Certificate | None:
    """Refuse links that overlap something at the end, or lie in the object or in each other at the start.

    If surfaces never cross on the way, a body stays inside or outside: a check at the start is enough.
    """
    hand, T = problem.hand, problem.T_palm_object
    links = [link for finger in hand.fingers for link in finger.links]
    inside = contained_link(hand, opened, problem.packed, T, problem.source, links)
    if inside is not None:
        link = hand.links[inside].name
        return _refused(CertificateCode.BLOCKED_AT_START, f"{link} overlaps the object before anything moves.", [link])
    checked = hand_bodies(hand, problem.source, problem.start).across
    pair = link_within_link(hand, opened, problem.source, checked)
    if pair is not None:
        names = [hand.links[i].name for i in pair]
        text = f"{names[0]} lies inside {names[1]} before anything moves."
        return _refused(CertificateCode.SELF_COLLISION_AT_START, text, names)
    found = _overlapping(problem, final, full_width)
    if not found:
        return None
    code, when = CertificateCode.OVERLAP_AT_END, "at the end"
    if _overlapping(problem, opened, full_width) == found:
        code, when = CertificateCode.SELF_COLLISION_AT_START, "before anything moves"
        if len(found) == 1:
            code = CertificateCode.BLOCKED_AT_START
    return _refused(code, f"{found[0]} overlaps {found[1] if len(found) > 1 else 'the object'} {when}.", found)


def _overlapping(problem: Problem, q: FloatArray, full_width: FullWidthArrays) -> list[str]:
    """Return the names of two links that overlap at a posture, or of a link that overlaps the object, or nothing."""
    from clench.kernels.toi.full_width import find_link_overlap

    hand, T = problem.hand, np.ascontiguousarray(problem.T_palm_object[:3])
    poses = placed_links(hand, q)
    across = hand_bodies(hand, problem.source, problem.start).across
    everything = full_width._replace(object=problem.packed.bodies, checked=across)
    pair = find_link_overlap(everything, poses, T, ALLOWED_PENETRATION)
    return [hand.links[i].name for i in pair if 0 <= i < len(hand.links)]
