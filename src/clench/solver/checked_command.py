"""Check a command against a hand, once per content, and keep the results that do not depend on the poses."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from clench.closing.motion import open_posture
from clench.core.pose import FloatArray
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.command_file import check_command
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

#: Commands that are kept, those asked for last.
_KEPT: Final = 64
_POSES: Final = ("hand_pose", "object_pose")
#: Types whose values say all there is to say, and do not change.
_PLAIN: Final = frozenset({str, int, bool, type(None), ClosingOrder, CollisionSource, type(Path())})
#: Numbers that are told apart by their text, as zeros have a sign.
_FLOATS: Final = frozenset({float, np.float64})


class CheckedCommand(NamedTuple):
    """A command that was checked against its hand.

    Args:
        command: a copy, which later changes of the caller's lists and mappings do not reach. Its poses are those of the
            first checked command with these values. Its preshape is given by angles.
        start: posture before closing, shape (J,) [rad]. source: geometry of the hand.
    """

    command: GraspCommand
    start: FloatArray
    source: CollisionSource


#: With the hands, so that the identity of each stays its own.
_kept: OrderedDict[tuple[object, ...], tuple[Hand, CheckedCommand]] = OrderedDict()


def checked(hand: Hand, command: GraspCommand) -> CheckedCommand:
    """Return a command that is checked; the same content at other poses is checked once.

    Raises:
        UnknownNameError, CommandError: see `check_command`.
    """
    try:
        content = ((name, _content(value)) for name, value in command.__dict__.items() if name not in _POSES)
        key = (id(hand), type(command), *content)
    except (TypeError, RecursionError):
        return _check(hand, command)
    kept = _kept.pop(key, None)
    found = _check(hand, command) if kept is None else kept[1]
    _kept[key] = hand, found
    while len(_kept) > _KEPT:
        _kept.popitem(last=False)
    return found


def _check(hand: Hand, command: GraspCommand) -> CheckedCommand:
    check_command(hand, command)
    own = command.unshared()
    if isinstance(own.preshape, str):
        from clench.solver.preshapes.postures import preshape_angles

        own = replace(own, preshape=preshape_angles(hand, own.preshape))
    source = CollisionSource(own.collision_source or hand.default_source)
    return CheckedCommand(own, open_posture(hand, own), source)


def _content(value: Any) -> object:
    """Return something hashable that is equal for values of the same content and types alone.

    Raises:
        TypeError: a value of a type that may be more than it says, or change.
    """
    kind = type(value)
    if kind in _PLAIN:
        return kind, value
    if kind in _FLOATS:
        return kind, repr(value)
    if kind is dict:
        return kind, *((_content(key), _content(each)) for key, each in value.items())
    if kind is tuple or kind is list:
        return kind, *map(_content, value)
    raise TypeError(f"a {kind.__name__} is no plain value.")
