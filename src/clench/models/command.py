"""The command: the wrist pose, the posture, and the options."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from clench.core.argument_types import check_type, checked_choice, shortened
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.core.showing.short_repr import short_repr
from clench.models.hand.hand import Hand

from .shapes import CollisionSource


class ClosingOrder(StrEnum):
    """Name the order in which joints close (docs/method.md section 4)."""

    PROXIMAL_FIRST = "proximal-first"
    """one degree of freedom after another, from the palm outwards (the patent)"""
    TOGETHER = "together"
    """all at once; a contact stops the joints that move the touching link, and the others continue"""
    FINGERTIP = "fingertip"
    """all at once; a finger succeeds only if its last link touches first"""

    @property
    def is_simultaneous(self) -> bool:
        """Whether all joints close at once."""
        return self is not ClosingOrder.PROXIMAL_FIRST

    @property
    def is_of_tips(self) -> bool:
        """Whether only a contact of the last link counts."""
        return self is ClosingOrder.FINGERTIP


@dataclass(frozen=True)
class GraspCommand:
    """The pose of the hand, its preshape and the options of a solve.

    Args:
        hand_pose: `T_world_palm`, or the pose of `root_link` when that is named.
        root_link: the link that `hand_pose` places; None is the palm.
        object_pose: `T_world_object`; None keeps the object's own.
        preshape: angles [rad] by joint name, of posture joints and open values of closing joints; or "open"; or the
            name of a preshape of the hand (`clench hand` lists them). If it has no angle of a posture joint and is no
            name, clench compares the preshapes of the hand and chooses one (docs/preshapes.md).
        fingers: names of the fingers that close, in order; None is all.
        order: closing order. rounds: how often the closing goes through the joints; 0: until nothing moves.
        orders: alternatives, used instead of `order`; clench solves each by itself, and keeps the best solution.
        speeds: relative speeds in the orders in which all joints move at once, by name of a joint that follows no
            other; 1 if not named.
        planes: number of curl planes per finger; clench adds planes at the edges of narrower links.
        full_width: also close over the full width: the solid links, also between the planes.
        yaw_grid: offsets [rad] added to a finger's abduction joint as alternatives.
        open_variants: offsets [rad] added, in the closing direction, to the open values as alternatives.
        check_candidates: measure the penetration of every candidate, which costs more than the solve.
        measure: measure the penetration of the chosen candidate over the full width, which costs as much as the solve.
        collision_source: geometry of the hand; None is the hand's default.
        opposition_grid: offsets [rad] added to the thumb's first posture joint as alternatives.
        criteria: weights by criterion name, the name of a preset, or a path to a calibration file; None is the default.
        next_steps: postures [rad] by joint name to which the hand goes after the grasp, one after another. Joints that
            a step does not name stay. Two criteria count these steps, and `execute` executes them.
        task_wrenches: loads of the task on the object, for the criterion `actuation_force_task`: `force` [N] and
            `torque` [Nm] in the world about the centre of mass. The hand holds one load at a time.
        seed: recorded with the result; nothing random depends on it.

    Raises:
        CommandError: a pose that is no `Pose`. A solve checks the other values against the hand.
    """

    hand_pose: Pose
    root_link: str | None = None
    object_pose: Pose | None = None
    preshape: Mapping[str, float] | str = field(default_factory=dict)
    fingers: tuple[str, ...] | None = None
    order: ClosingOrder = ClosingOrder.PROXIMAL_FIRST
    orders: tuple[ClosingOrder, ...] = ()
    rounds: int = 1
    speeds: Mapping[str, float] = field(default_factory=dict)
    planes: int = 5
    full_width: bool = True
    yaw_grid: tuple[float, ...] = (0.0,)
    open_variants: tuple[float, ...] = (0.0,)
    opposition_grid: tuple[float, ...] = (0.0,)
    check_candidates: bool = False
    measure: bool = True
    collision_source: CollisionSource | None = None
    criteria: Mapping[str, float] | Path | str | None = None
    next_steps: tuple[Mapping[str, float], ...] = ()
    task_wrenches: tuple[Mapping[str, tuple[float, ...]], ...] = ()
    seed: int | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        check_type(self.hand_pose, Pose, "hand_pose")
        if self.object_pose is not None:
            check_type(self.object_pose, Pose, "object_pose")
        chosen: dict[str, Any] = {"order": checked_choice(self.order, ClosingOrder, "order")}
        if not isinstance(self.orders, list | tuple):
            raise CommandError(f"orders: expected a list of closing orders, got {shortened(self.orders)}.")
        chosen["orders"] = tuple(checked_choice(o, ClosingOrder, f"orders[{i}]") for i, o in enumerate(self.orders))
        if self.collision_source is not None:
            chosen["collision_source"] = checked_choice(self.collision_source, CollisionSource, "collision_source")
        self.__dict__.update(chosen)  # names become members; the class is frozen

    @property
    def angles(self) -> Mapping[str, float]:
        """The angles that the preshape gives by joint name [rad]; empty if it is a name."""
        return {} if isinstance(self.preshape, str) else self.preshape

    def unshared(self) -> GraspCommand:
        """Return the same command, which no later change of a list or mapping that was given reaches."""
        return replace(self, **{name: _own(value) for name, value in self.__dict__.items()})

    def at(self, hand_pose: Pose, object_pose: Pose | None) -> GraspCommand:
        """Return the same command at other poses, sooner than `dataclasses.replace` does."""
        moved = copy(self)
        moved.__dict__.update(hand_pose=hand_pose, object_pose=object_pose)
        return moved

    @classmethod
    def from_posture(cls, hand: Hand, q: FloatArray | Mapping[str, float], hand_pose: Pose) -> GraspCommand:
        """Decompose a whole posture: keep its posture joints, solve closing joints anew (docs/method.md section 1).

        Args:
            hand: the hand. q: all joint angles [rad], by name or in model order, shape (J,).
            hand_pose: `T_world_palm`.

        Raises:
            CommandError: wrong length or not finite. UnknownNameError: no such joint.
        """
        from .decomposition import command_from_posture

        return command_from_posture(hand, q, hand_pose)


def as_command(command: GraspCommand | Pose) -> GraspCommand:
    """Return a command unchanged, and a pose as the command without other options.

    Raises:
        CommandError: neither of the two.
    """
    if isinstance(command, Pose):
        return GraspCommand(hand_pose=command)
    check_type(command, GraspCommand, "command", also="a clench.Pose of the palm")
    return command


def _own(value: Any) -> Any:
    """Return a value that shares no list or mapping with another one."""
    if isinstance(value, Mapping):
        return {name: _own(each) for name, each in value.items()}
    return tuple(map(_own, value)) if isinstance(value, list | tuple) else value
