"""Define a criterion: a number for a candidate, with a unit, a direction and a source (docs/method.md section 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from clench.closing.candidates import FingerCandidate
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource

if TYPE_CHECKING:
    from clench.closing.collision.packed_object import PackedObject


@dataclass(frozen=True, eq=False)
class ScoringContext:
    """The context in which criteria score candidates; J joints.

    Args:
        hand: the hand. start: posture it closes from, shape (J,) [rad].
        packed, T_palm_object: the object and its pose, shape (4, 4). source: geometry of the hand.
        steps: postures of the next steps of the work, NaN for joints that a step leaves alone, (J,) each [rad].
        joint_weights: of the joints in the range of motion, shape (J,); None is 1 for all.
        obj: the object, its friction and mass; None where only its surface counts.
        gravity: its direction in the palm frame, unit, shape (3,).
        task: wrenches on the object in its task: force [N] and torque about the centre of mass [Nm] in the palm frame,
            shape (N, 6).
        in_stages: fingers close proximal first, in one round, so that the contact that stopped a joint can be
            recomputed.
        tip_only: only the first touch of a fingertip counts.
        kept: a criterion's cache between candidates; emptied with every solve.
    """

    hand: Hand
    start: FloatArray
    packed: PackedObject | None = None
    T_palm_object: FloatArray | None = None
    source: CollisionSource | None = None
    steps: tuple[FloatArray, ...] = ()
    joint_weights: FloatArray | None = None
    obj: GraspObject | None = None
    gravity: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    in_stages: bool = True
    task: FloatArray = field(default_factory=lambda: np.empty((0, 6)))
    tip_only: bool = False
    kept: dict[Any, Any] = field(default_factory=dict)

    __repr__ = short_repr


@runtime_checkable
class Criterion(Protocol):
    """Judge the candidate of one finger; write a class with these members and `register_criterion` it to add your own.

    Attributes:
        name: as weights name it. unit: of the value. source: publication or section of the method.
        scale: the value that counts as 1 in the weighted sum. larger_is_better: the direction.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    source: ClassVar[str]
    scale: ClassVar[float]
    larger_is_better: ClassVar[bool]

    def score(self, candidate: FingerCandidate, context: ScoringContext) -> float | None:
        """Return the value of a candidate, or None when the criterion says nothing about it."""
        ...


@runtime_checkable
class HandCriterion(Protocol):
    """Judge the candidates of all fingers together; otherwise like `Criterion`.

    Optional members speed up the search for the best combination and let it end with a proof:

    - `prepare(candidates, context)` gets all candidates before any combination is judged.
    - `ideal` is a value that no combination beats.
    - `bound(groups, places, context)` returns bounds, one axis per finger, near the value of the combination that takes
      candidate `places[k]` of `groups[k]`; None: no bound.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    source: ClassVar[str]
    scale: ClassVar[float]
    larger_is_better: ClassVar[bool]

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the value of one candidate per finger, or None when the criterion says nothing about them."""
        ...


def own_angles(candidate: FingerCandidate, q: FloatArray) -> FloatArray:
    """Return the angles of a finger's own joints in a posture of the hand [rad]."""
    return q[candidate.plan.finger.own]
