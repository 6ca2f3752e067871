"""Judge which candidates a rigid hand could take (docs/method.md section 5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import PackedObject
from clench.core.pose import FloatArray
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .candidates import FingerCandidate

#: Angles closer than this are the same candidate [rad].
_SAME = 1e-12
#: Postures at which the path of a candidate is looked at, besides its end.
_LOOKS = 8


def judge_candidates(
    hand: Hand,
    candidates: Sequence[FingerCandidate],
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource,
    measure: bool,
    together: bool = False,
) -> None:
    """Fill `clear` of the candidates, and on request `feasible` and `penetration`.

    A candidate that was swept over the full width passes through nothing. Without a sweep, the full-width candidate
    passes through nothing on any plane. A plane's candidate with the same angles is the same candidate. Any other
    plane's candidate passes through the contacts of other planes. The overlap between the planes is measured.

    Args:
        hand: the hand. candidates: of all fingers. packed, T_palm_object: the object, shape (4, 4).
        source: geometry of the hand. measure: measure every candidate, along its path. together: all joints close
            simultaneously.
    """
    whole = {id(c.plan): c for c in candidates if c.plane is None}
    for c in candidates:
        if c.overlap is not None:
            c.feasible, c.penetration = False, None if c.late else c.overlap.depth
        elif c.swept:
            c.clear, c.feasible, c.penetration = True, True, 0.0
        else:
            full = whole.get(id(c.plan))
            c.clear = full is not None and bool(np.abs(c.q - full.q).max(initial=0.0) <= _SAME)
            if measure:
                c.penetration, allowed = _deepest(hand, c, packed, T_palm_object, source, together)
                c.feasible = c.penetration <= allowed


def _deepest(
    hand: Hand,
    candidate: FingerCandidate,
    packed: PackedObject,
    T_palm_object: FloatArray,
    source: CollisionSource,
    together: bool,
) -> tuple[float, float]:
    """Return the largest depth beyond its link's allowance along a candidate's path, and that allowance [m]."""
    deepest, allowance = 0.0, ALLOWED_PENETRATION
    for travel in _path_at_once(candidate) if together else _path(candidate.travel):
        q = candidate.on_the_way(hand, travel)
        for found in hand_depths(hand, q, packed, T_palm_object, source, links=candidate.plan.finger.links):
            allowed = max(ALLOWED_PENETRATION, hand.links[found.link].pad_indentation)
            if found.depth - allowed > deepest - allowance:
                deepest, allowance = found.depth, allowed
    return deepest, allowance


def _path(travel: FloatArray) -> list[FloatArray]:
    """Return travels along the closing path, one degree of freedom after another, the end last."""
    path = []
    for g in range(len(travel)):
        for part in np.linspace(0.0, 1.0, _LOOKS, endpoint=False)[1:]:
            path.append(np.concatenate([travel[:g], [part * travel[g]], np.zeros(len(travel) - g - 1)]))
    return [*path, travel]


def _path_at_once(candidate: FingerCandidate) -> list[FloatArray]:
    """Return travels along a closing path on which all degrees of freedom move simultaneously, the end last.

    A degree of freedom that was held travels on here; `FingerCandidate.on_the_way` holds its joints.
    """
    speeds = np.array(candidate.plan.speeds)
    last = float((candidate.travel / speeds).max(initial=0.0))
    parts = np.linspace(0.0, last, _LOOKS * len(speeds), endpoint=False)[1:]
    return [*(speeds * at for at in parts), candidate.travel]
