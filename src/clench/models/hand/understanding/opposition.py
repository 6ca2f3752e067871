"""Ask whether a thumb and the fingers ever close towards each other."""

from __future__ import annotations

import itertools

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.findings import Finding, FindingCode, in_hand_file, quoted
from clench.models.hand.hand import Finger, Hand, JointRole

from .finger_geometry import finger_line, tip_motion

#: Number of tried angles per posture joint: its limits and angles between them.
_POSTURES = 3
#: Closing of the fingers at which they are tested, as shares of their ranges [-].
_CLOSED = (0.0, 0.2, 0.4, 0.6, 0.8)
#: Tips close towards each other when both move along the line between them by more than this share [-].
_TOWARDS = 0.2
#: Tips that move less have no direction [m/rad].
_STILL = 1e-6


def check_thumbs(hand: Hand) -> list[Finding]:
    """Return a finding for every thumb that no finger can meet in any posture (docs/method.md section 1)."""
    others = [finger for finger in hand.fingers if not finger.is_thumb]
    reached = [_tips(hand, finger) for finger in others]
    found = []
    for thumb in (finger for finger in hand.fingers if finger.is_thumb):
        own = _tips(hand, thumb)
        best = max((_best_opposition(own, other) for other in reached), default=1.0)
        if best < _TOWARDS:
            found.append(_opposes_nothing(hand, thumb, [f.name for f in others], best))
    return found


def _opposes_nothing(hand: Hand, thumb: Finger, others: list[str], best: float) -> Finding:
    closing = [hand.joints[j].name for j in thumb.joints if hand.joints[j].role is JointRole.CLOSING]
    lines = [in_hand_file("fingers", thumb.name, "thumb = false")]
    if closing:
        lines.insert(0, in_hand_file("joints", closing[0], "direction = -1") + " (or 1)")
    return Finding(
        FindingCode.THUMB_OPPOSES_NOTHING,
        f"Thumb '{thumb.name}' opposes nothing: in no posture tried do its tip and that of {quoted(others)} "
        "close towards each other.",
        f"If its closing direction is wrong, or it is no thumb, write in the hand file, {', or '.join(lines)}.",
        joints=tuple(closing),
        numbers={"largest_opposition": best},
    )


def _tips(hand: Hand, finger: Finger) -> tuple[FloatArray, FloatArray]:
    """Return where the tip gets over postures and closings [m], and the unit directions in which it moves, (N, 3)."""
    own = [hand.joints[j] for j in finger.joints]
    posture = [k for k, j in enumerate(own) if j.role is not JointRole.CLOSING and j.upper > j.lower]
    rates = np.array([j.direction if j.role is JointRole.CLOSING else 0.0 for j in own], dtype=np.float64)
    places, ways = [], []
    tried = itertools.product(*(np.linspace(own[k].lower, own[k].upper, _POSTURES) for k in posture))
    for angles in tried:
        for share in _CLOSED:
            q = hand.open_angles()
            for j, joint in zip(finger.joints, own, strict=True):
                if joint.role is JointRole.CLOSING:
                    limit = joint.upper if joint.direction > 0 else joint.lower
                    q[j] += share * (limit - q[j])
            q[[finger.joints[k] for k in posture]] = angles
            line = finger_line(hand, finger, hand.coupled(q))
            motion = tip_motion(line, rates)
            size = float(np.linalg.norm(motion))
            if size > _STILL:
                places.append(line.tip)
                ways.append(motion / size)
    return np.array(places).reshape(-1, 3), np.array(ways).reshape(-1, 3)


def _best_opposition(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> float:
    """Return the largest share with which both tips move towards each other, over all pairs of postures [-]."""
    between = other[0][None] - one[0][:, None]
    size = np.linalg.norm(between, axis=2)
    towards = between / np.where(size > 0.0, size, 1.0)[..., None]
    first = np.einsum("abk,ak->ab", towards, one[1])
    second = -np.einsum("abk,bk->ab", towards, other[1])
    return float(np.minimum(first, second).max(initial=-1.0))
