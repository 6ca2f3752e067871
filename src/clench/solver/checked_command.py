"""Check a command against a hand, and settle what does not depend on the poses."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from clench.closing.motion import open_posture
from clench.core.pose import FloatArray
from clench.models.command import GraspCommand
from clench.models.command_file import check_command
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource


class CheckedCommand(NamedTuple):
    """A command that was checked against its hand.

    Args:
        command: a copy, which later changes of the caller's lists and mappings do not reach. Its preshape is given by
            angles.
        start: posture before closing, shape (J,) [rad]. source: geometry of the hand.
    """

    command: GraspCommand
    start: FloatArray
    source: CollisionSource


def checked(hand: Hand, command: GraspCommand) -> CheckedCommand:
    """Return a command that is checked.

    Raises:
        UnknownNameError, CommandError: see `check_command`.
    """
    check_command(hand, command)
    own = command.unshared()
    if isinstance(own.preshape, str):
        from clench.solver.preshapes.postures import preshape_angles

        own = replace(own, preshape=preshape_angles(hand, own.preshape))
    source = CollisionSource(own.collision_source or hand.default_source)
    return CheckedCommand(own, open_posture(hand, own), source)
