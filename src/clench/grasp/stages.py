"""The stages in which a closed hand was reached, found again from its open and final postures (METHOD.md section 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray
from clench.models.hand.hand import Finger, Hand

from .plan import closing_joints
from .scene import PackedObject

if TYPE_CHECKING:
    from .exact import HandBodies

#: Touches that are listed at most; flat faces on each other have many.
_MOST_TOUCHES = 4096


@dataclass(frozen=True, eq=False)
class Stage:
    """Describe where one degree of freedom of a finger stopped, proximal first.

    Args:
        finger: its finger. leader: joint that moved, index in the hand.
        rates: of every joint of the hand, per turn of the leader [-], shape (J,); followers at their limits have 0.
        posture: of the whole hand where it stopped [rad], shape (J,): earlier joints and fingers closed, later open.
    """

    finger: Finger
    leader: int
    rates: FloatArray
    posture: FloatArray


@dataclass(frozen=True, eq=False)
class StageTouch:
    """Describe a touch at the end of a stage, in the palm frame.

    Args:
        stage: number. link: that moved. met: the link it touches, or the number of links for the object.
        position: [m], normal: unit, from what is touched to the link, shape (3,) each. gap: [m].
    """

    stage: int
    link: int
    met: int
    position: FloatArray
    normal: FloatArray
    gap: float


def closing_stages(hand: Hand, fingers: Sequence[Finger], opened: FloatArray, final: FloatArray) -> list[Stage]:
    """Return the stages of fingers that closed one after another, proximal first, once.

    Args:
        hand: the hand. fingers: in closing order. opened, final: postures of the whole hand [rad], shape (J,).
    """
    stages = []
    q = opened
    for finger in fingers:
        closing = closing_joints(hand, finger)
        followers = {c.follower: c for c in hand.couplings if c.follower in closing}
        for leader in dict.fromkeys(followers[j].leader if j in followers else j for j in closing):
            moved = q.copy()
            moved[leader] = final[leader]
            q = hand.coupled(moved)
            rates = np.zeros(len(hand.joints))
            rates[leader] = 1.0
            for c in followers.values():
                joint = hand.joints[c.follower]
                if c.leader == leader and joint.lower < c.ratio * q[leader] + c.offset < joint.upper:
                    rates[c.follower] = c.ratio
            stages.append(Stage(finger, leader, rates, q))
    return stages


def carried_links(hand: Hand) -> NDArray[np.bool_]:
    """Return whether a joint is before a link, shape (L, J)."""
    carried = np.zeros((len(hand.links), len(hand.joints)), dtype=np.bool_)
    for i, link in enumerate(hand.links):
        if link.parent >= 0:
            carried[i] = carried[link.parent]
        if link.joint >= 0:
            carried[i, link.joint] = True
    return carried


def stage_touches(
    bodies: HandBodies,
    packed: PackedObject,
    T_palm_object: FloatArray,
    poses: FloatArray,
    moves: NDArray[np.bool_],
    tie: float,
    deviation: float,
) -> list[StageTouch]:
    """Return what touches at the end of every stage.

    Args:
        bodies: the hand's links. packed: the object. T_palm_object: where it is, shape (4, 4).
        poses: `T_palm_link` at every stage, shape (S, L, 4, 4). moves: whether a link moved in a stage, shape (S, L).
        tie: gap below which links touch [m]. deviation: of what is swept as polyhedra [m].
    """
    from clench.kernels.touching_pairs import PAIR_FLOATS, PAIR_INTEGERS, touching_pairs

    found = np.empty((_MOST_TOUCHES, PAIR_INTEGERS), dtype=np.int64)
    numbers = np.empty((_MOST_TOUCHES, PAIR_FLOATS))
    count = touching_pairs(
        bodies.links,
        packed.bodies,
        bodies.across,
        np.ascontiguousarray(poses[:, :, :3]),
        moves.astype(np.int64),
        np.ascontiguousarray(T_palm_object[:3]),
        2.0 * tie + deviation,
        tie,
        found,
        numbers,
    )
    return [
        StageTouch(int(s), int(link), int(met), row[:3], row[3:6], float(row[6]))
        for (s, link, met), row in zip(found[:count], numbers[:count], strict=True)
    ]
