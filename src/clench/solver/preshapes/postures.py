"""The posture of a hand before it closes: given by angles or by name, or left to clench (docs/preshapes.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from clench.closing.motion import asked_fingers
from clench.core.exceptions import UnknownNameError
from clench.models.command import GraspCommand
from clench.models.hand.hand import Finger, Hand
from clench.solver.checked_command import checked

from .preshape_names import OPEN
from .preshapes import opposing_sides, opposition_zones, posture_joints

#: Preshapes that are compared at most, the open hand among them.
MOST_COMPARED: Final = 12


@dataclass(frozen=True)
class PostureOption:
    """A posture that a closing may start from: the name of the preshape, and the angles by joint name [rad]."""

    name: str
    angles: Mapping[str, float]


def preshape_angles(hand: Hand, name: str) -> dict[str, float]:
    """Return the angles that a preshape sets [rad]: every posture joint, and open values of closing joints.

    Raises:
        UnknownNameError: the hand has no preshape of this name.
    """
    if name == OPEN:
        return {joint: hand.joints[hand.joint_index(joint)].open_value for joint in posture_joints(hand)}
    shapes = {shape.name: shape for shape in opposition_zones(hand)}
    if name not in shapes:
        raise UnknownNameError("preshape", name, f"hand '{hand.name}'", list(shapes) or [OPEN])
    return dict(shapes[name].angles)


def posture_options(hand: Hand, command: GraspCommand) -> tuple[PostureOption, ...]:
    """Return the postures among which clench chooses, the open hand first; empty where the command leaves no choice.

    A command leaves the choice to clench if it names no posture joint, no preshape, no `yaw_grid` and no
    `opposition_grid`. Its fingers need posture joints, and two sides that can oppose each other.

    Raises:
        UnknownNameError, CommandError: see `check_command`.
    """
    own = checked(hand, command).command
    if isinstance(command.preshape, str) or own.yaw_grid != (0.0,) or own.opposition_grid != (0.0,):
        return ()
    given, fingers = own.angles, asked_fingers(hand, own)
    free = posture_joints(hand, fingers)
    if not free or not given.keys().isdisjoint(posture_joints(hand)):
        return ()
    return _options(hand, fingers, given)


def _options(hand: Hand, fingers: tuple[Finger, ...], given: Mapping[str, float]) -> tuple[PostureOption, ...]:
    """Return the first preshapes of a hand that differ in joints of some fingers; the others of the hand stay open."""
    found: list[PostureOption] = []
    for name, angles in _preshapes_of(hand, fingers):
        option = PostureOption(name, {**angles, **given})
        if len(found) < MOST_COMPARED and all(option.angles != other.angles for other in found):
            found.append(option)
    return tuple(found) if len(found) > 1 else ()


def _preshapes_of(hand: Hand, fingers: tuple[Finger, ...]) -> list[tuple[str, dict[str, float]]]:
    """Return names and angles [rad] of all preshapes for joints of given fingers; none if no two sides oppose."""
    two_sides = any(True for _ in opposing_sides(hand, tuple(finger.name for finger in fingers)))
    own = {hand.joints[j].name for finger in fingers for j in finger.joints}
    return [
        (shape.name, {joint: angle for joint, angle in shape.angles.items() if joint in own})
        for shape in (opposition_zones(hand) if two_sides else ())
    ]


def distance_from_open(hand: Hand, option: PostureOption, first: PostureOption) -> float:
    """Return the sum of the joints' absolute differences between a posture and the open one [rad]."""
    names = dict.fromkeys([*option.angles, *first.angles])
    opened = {name: hand.joints[hand.joint_index(name)].open_value for name in names}
    return float(np.sum([abs(option.angles.get(n, opened[n]) - first.angles.get(n, opened[n])) for n in names]))
