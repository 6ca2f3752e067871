"""The state of the viewer: one immutable value, and the values before and after it for undo and redo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final

from clench.core.defaults import MASS
from clench.core.pose import Pose
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.shapes import CollisionSource

#: So many states can be undone.
_MOST_KEPT: Final = 200


class Ask(StrEnum):
    """Name the action on a state."""

    SOLVE = "solve"
    """close the hand; the posture stays as it is"""
    CHOOSE = "choose"
    """let clench choose the preshape at this pose, and close"""
    PLAN = "plan"
    """plan a grasp: hand or object are new to each other"""


@dataclass(frozen=True)
class ViewState:
    """Everything that the user can set.

    Args:
        hand, object: names on the `Shelf`. command: with the pose of the palm and of the object.
        friction: of all contacts [-]; None: that of hand and object. mass: of the object [kg].
    """

    hand: str
    object: str
    command: GraspCommand
    friction: float | None = None
    mass: float = MASS

    def moved(self, *, hand_pose: Pose | None = None, object_pose: Pose | None = None) -> ViewState:
        """Return the state with the palm or the object elsewhere."""
        hand_at = self.command.hand_pose if hand_pose is None else hand_pose
        object_at = self.command.object_pose if object_pose is None else object_pose
        return replace(self, command=self.command.at(hand_at, object_at))

    def with_angle(self, joint: str, angle: float) -> ViewState:
        """Return the state with one angle of the preshape changed [rad]."""
        return self._with(preshape={**self.command.angles, joint: angle})

    def with_preshape(self, angles: Mapping[str, float]) -> ViewState:
        """Return the state with another preshape, angles [rad] by joint."""
        return self._with(preshape=dict(angles))

    def with_order(self, order: ClosingOrder) -> ViewState:
        """Return the state with another closing order."""
        return self._with(order=order, orders=())

    def with_source(self, source: CollisionSource) -> ViewState:
        """Return the state with other geometry of the hand."""
        return self._with(collision_source=source)

    def with_weights(self, weights: Mapping[str, float]) -> ViewState:
        """Return the state with other weights of the criteria; without one above 0 the default ones count."""
        heavy = {name: weight for name, weight in weights.items() if weight > 0.0}
        return self._with(criteria=heavy or None)

    def with_criteria(self, preset: str) -> ViewState:
        """Return the state with the weights of a preset."""
        return self._with(criteria=preset)

    def _with(self, **changed: Any) -> ViewState:
        return replace(self, command=replace(self.command, **changed))


@dataclass
class History:
    """The states that the user went through; a new one forgets those that were undone."""

    _past: list[ViewState] = field(default_factory=list)
    _future: list[ViewState] = field(default_factory=list)

    def keep(self, state: ViewState) -> None:
        """Keep a state that the user settled on; the same one twice counts once."""
        if self._past and self._past[-1] == state:
            return
        self._past.append(state)
        del self._past[:-_MOST_KEPT]
        self._future.clear()

    def undo(self) -> ViewState | None:
        """Return the state before the last one, None where there is none."""
        if len(self._past) < 2:
            return None
        self._future.append(self._past.pop())
        return self._past[-1]

    def redo(self) -> ViewState | None:
        """Return the state that was undone last, None where there is none."""
        if not self._future:
            return None
        self._past.append(self._future.pop())
        return self._past[-1]
