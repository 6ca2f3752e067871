"""Baselines that close in small steps: rules of other programs, run over our own compiled collision queries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.packed_object import shape_elements
from clench.closing.finger_plan import closing_joints
from clench.closing.linkage import hand_frames
from clench.core.pose import FloatArray
from clench.models.hand.hand import Finger, Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource, Shape

if TYPE_CHECKING:
    from clench.kernels.geometry.bodies import Elements

    from .kernels.box_query import BoxTrees
    from .kernels.stepped_closing import StepLog, SteppedHand

#: Rounds at most, times the standard step; more than any closing takes.
_ROUNDS: Final = 500


@dataclass(frozen=True)
class Rule:
    """Describe a rule of stepping; see `benchmarks.peers.kernels.stepped_closing.close_in_steps`.

    Args:
        name: of the program that it is like. number: of the rule.
        step: [rad]. fine: the gap that halving ends at [m], or the fine step [rad]; not used by all.
    """

    name: str
    number: int
    step: float
    fine: float

    def scaled(self, factor: float) -> Rule:
        """Return the rule with all its steps and tolerances multiplied."""
        return Rule(self.name, self.number, self.step * factor, self.fine * factor)


#: GraspIt!'s autoGrasp: 0.01 rad, contacts below 0.1 mm. Simox' closeActors: 0.02 rad. OpenRAVE: 0.1, then 0.001 rad.
RULES: Final = (
    Rule("graspit_like", 0, 0.01, 1e-4),
    Rule("simox_like", 1, 0.02, 0.0),
    Rule("openrave_like", 2, 0.1, 1e-3),
)


class Closing(NamedTuple):
    """The end of a closing: posture [rad], the stop of each degree of freedom, and the tally of queries."""

    q: FloatArray
    stops: NDArray[np.int64]
    tally: NDArray[np.int64]


class Stepper:
    """Close one hand around one object in steps, from one posture.

    Args:
        hand: the hand. obj: the object. start: the posture before closing, shape (J,) [rad].
        source: geometry of the hand.
    """

    def __init__(self, hand: Hand, obj: GraspObject, start: FloatArray, source: CollisionSource) -> None:
        self.hand = hand
        self.start = np.array(start, dtype=np.float64)
        solid = set(hand.solid_links)
        shapes = [link.shapes.get(source, ()) if i in solid else () for i, link in enumerate(hand.links)]
        self.arrays = stepped_hand(hand, _trees(shapes, source))
        whole = [shape for body in obj.bodies for shape in body.shapes]
        self.target = _trees([whole], CollisionSource(obj.collision_source))
        self._T_root_palm = np.linalg.inv(hand.link_poses(self.start)[0])
        self._no_log = self.log(0)

    def close(self, rule: Rule, T_palm_object: FloatArray, log: StepLog | None = None) -> Closing:
        """Close by a rule, with the object at a pose, shape (4, 4)."""
        from .kernels.stepped_closing import close_in_steps

        T = np.ascontiguousarray((self._T_root_palm @ T_palm_object)[:3])
        q, stops, tally = self.start.copy(), np.empty(len(self.arrays.free), np.int64), np.empty(3, np.int64)
        most = int(np.ceil(_ROUNDS * max(1.0, 0.01 / rule.step)))
        kept = self._no_log if log is None else log
        close_in_steps(rule.number, self.arrays, self.target, T, q, rule.step, rule.fine, most, stops, tally, kept)
        return Closing(q, stops, tally)

    def log(self, capacity: int) -> StepLog:
        """Return an empty log for so many queries."""
        from .kernels.stepped_closing import StepLog

        return StepLog(np.zeros((capacity, len(self.hand.joints))), np.full((capacity, 3), -1, np.int64))

    def fingers(self, closing: Closing) -> Iterator[tuple[Finger, bool]]:
        """Yield every finger that closes, and whether a contact stopped it."""
        from .kernels.stepped_closing import AT_CONTACT

        for number, finger in enumerate(self.hand.fingers):
            own = closing.stops[self.arrays.finger == number]
            if len(own):
                yield finger, bool((own == AT_CONTACT).any())


def _trees(solids: Sequence[Sequence[Shape]], source: CollisionSource) -> BoxTrees:
    """Return solids, each of several shapes, as sweeps take them: round shapes are cores with a radius."""
    from clench.kernels.geometry.bodies import join_elements

    from .kernels.box_query import box_trees

    parts: list[list[Elements]] = [[shape_elements(shape, source) for shape in shapes] for shapes in solids]
    return box_trees([join_elements(own) for own in parts])


def stepped_hand(hand: Hand, links: BoxTrees) -> SteppedHand:
    """Return what stepping needs of a hand."""
    from .kernels.stepped_closing import SteppedHand

    followers = {c.follower for c in hand.couplings}
    free = [
        (j, number, finger)
        for number, finger in enumerate(hand.fingers)
        for j in closing_joints(hand, finger)
        if j not in followers
    ]
    joints = hand.joints
    moves = np.zeros((len(free), len(hand.links)), dtype=np.int64)
    for d, (j, _, finger) in enumerate(free):
        group = {j, *(c.follower for c in hand.couplings if c.leader == j)}
        for m in finger.links:
            moves[d, m] = bool(group & _joints_before(hand, m)) and links.root[m] >= 0
    owner = np.full(len(hand.links), -1, dtype=np.int64)
    for number, finger in enumerate(hand.fingers):
        owner[list(finger.links)] = number
    rate = np.array([joints[j].direction for j, _, _ in free], dtype=np.float64)
    ends = [joints[j].upper if joints[j].direction > 0 else joints[j].lower for j, _, _ in free]
    return SteppedHand(
        frames=hand_frames(hand),
        free=np.array([j for j, _, _ in free], dtype=np.int64),
        finger=np.array([number for _, number, _ in free], dtype=np.int64),
        rate=rate,
        end=np.array(ends, dtype=np.float64),
        owner=owner,
        moves=moves,
        links=links,
    )


def _joints_before(hand: Hand, link: int) -> set[int]:
    found = set()
    while link >= 0:
        found.add(hand.links[link].joint)
        link = hand.links[link].parent
    return found
