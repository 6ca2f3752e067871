"""The stages in which a hand closed, found again from its open and final postures (docs/method.md section 4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.packed_object import PackedObject
from clench.closing.finger_plan import closing_joints
from clench.core.pose import FloatArray
from clench.models.command_file import LIMIT_TOLERANCE
from clench.models.hand.hand import Finger, Hand

if TYPE_CHECKING:
    from clench.closing.link_bodies import HandBodies

#: Touches that are listed at most; flat faces on each other have many.
_MOST_TOUCHES = 4096
#: Joints that stop within this motion of each other stop simultaneously [rad at speed 1].
_AT_ONCE = 1e-12


@dataclass(frozen=True, eq=False)
class Stage:
    """The event in which one or several degrees of freedom of a finger stopped.

    Args:
        finger: its finger. leaders: joints that moved on their own and stopped, indices in the hand.
        stops: all joints that stopped, including followers.
        rates: of every joint of the hand that moved until then, per turn of the first leader [-], shape (J,); followers
            at their limits have 0.
        posture: of the whole hand at the stop [rad], shape (J,).
    """

    finger: Finger
    leaders: tuple[int, ...]
    stops: tuple[int, ...]
    rates: FloatArray
    posture: FloatArray

    @property
    def leader(self) -> int:
        """The first of the leaders."""
        return self.leaders[0]


@dataclass(frozen=True, eq=False)
class StageTouch:
    """Describe a touch at the end of a stage, in the palm frame.

    Args:
        stage: number. link: that moved. met: the link it touches, or the number of links for the object.
        position: [m], shape (3,). normal: unit, from the touched body to the link, shape (3,). gap: [m].
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
            _follow(hand, q, rates)
            stages.append(Stage(finger, (leader,), tuple(np.flatnonzero(rates).tolist()), rates, q))
    return stages


def _follow(hand: Hand, q: FloatArray, rates: FloatArray) -> None:
    """Write the rates of followers, which have none at their limits; posture and rates have shape (J,)."""
    for c in hand.couplings:
        joint = hand.joints[c.follower]
        if joint.lower < c.ratio * q[c.leader] + c.offset < joint.upper:
            rates[c.follower] = c.ratio * rates[c.leader]


def stages_at_once(
    hand: Hand, fingers: Sequence[Finger], opened: FloatArray, final: FloatArray, speeds: Mapping[str, float]
) -> list[Stage]:
    """Return the stages of fingers whose joints moved simultaneously, in the order of their stops.

    Args:
        hand: the hand. fingers: that closed. opened, final: postures of the whole hand [rad], shape (J,).
        speeds: of free joints by name; 1 where not named.
    """
    leads = {c.follower: c.leader for c in hand.couplings}
    free = {j: finger for finger in fingers for j in closing_joints(hand, finger) if j not in leads}
    speed = np.zeros(len(hand.joints))
    speed[list(free)] = [hand.joints[j].direction * speeds.get(hand.joints[j].name, 1.0) for j in free]
    ends = {j: float((final[j] - opened[j]) / speed[j]) for j in free}
    stages = []
    while ends:
        first = min(ends, key=lambda j: ends[j])
        end, finger = ends[first], free[first]
        # A limit stops its joint alone, a touch all up to the link that touches.
        alone = at_limit(hand, first, final)
        leaders = [
            j
            for j in ends
            if free[j] is finger and ends[j] - end <= _AT_ONCE * max(end, 1.0) and not (alone and j != first)
        ]
        turned = np.sign(speed) * np.minimum(np.abs(speed) * end, np.abs(final - opened))
        q = hand.coupled(opened + turned)
        rates = np.array([speed[j] if ends.get(j, -1.0) >= end else 0.0 for j in range(len(speed))]) / speed[first]
        _follow(hand, q, rates)
        stops = [j for j in np.flatnonzero(rates).tolist() if leads.get(j, j) in leaders]
        stages.append(Stage(finger, tuple(leaders), tuple(stops), rates, q))
        for j in leaders:
            del ends[j]
    return stages


def at_limit(hand: Hand, joint: int, q: FloatArray) -> bool:
    """Say whether a joint is at the limit that it closes to.

    Args:
        joint: index in the hand. q: posture of the whole hand [rad], shape (J,).
    """
    closing = hand.joints[joint]
    limit = closing.upper if closing.direction > 0 else closing.lower
    return abs(float(q[joint]) - limit) <= LIMIT_TOLERANCE


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
    """Return the contacts at the end of every stage.

    Args:
        bodies: the hand's links. packed: the object. T_palm_object: pose of the object, shape (4, 4).
        poses: `T_palm_link` at every stage, shape (S, L, 4, 4). moves: whether a link moved in a stage, shape (S, L).
        tie: gap below which links touch [m]. deviation: of shapes that are swept as polyhedra [m].
    """
    from clench.kernels.toi.touching_pairs import PAIR_FLOATS, PAIR_INTEGERS, touching_pairs

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
