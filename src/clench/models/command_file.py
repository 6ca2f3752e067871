"""Command files (JSON): read, written, and checked against a hand.

Every complaint names the key by its path, as in ``c.json: preshape.index_yaw: expected a number in rad, got 'x'``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Final

from clench.core.argument_types import checked_choice, shortened
from clench.core.exceptions import CommandError, FileError, guessed
from clench.core.files.file_bytes import expanded, read_file
from clench.core.files.file_limits import COMMAND_CANDIDATES, COMMAND_ITEMS, JSON_BYTES
from clench.core.files.json_files import not_json
from clench.core.files.nesting import TOO_DEEP, is_too_deep
from clench.core.numbers import is_finite_number
from clench.core.pose import Pose
from clench.models.hand.hand import Hand, JointRole

from .command import ClosingOrder, GraspCommand
from .shapes import CollisionSource

#: A joint angle may pass a limit by this much [rad]: files round.
LIMIT_TOLERANCE: Final = 1e-9

KEYS: Final = (
    *("hand_pose", "root_link", "object_pose", "preshape", "fingers", "order", "orders", "rounds", "speeds", "planes"),
    *("full_width", "yaw_grid", "open_variants", "opposition_grid", "check_candidates", "measure", "collision_source"),
    *("criteria", "next_steps", "task_wrenches", "seed"),
)


def load_command(path: str | Path) -> GraspCommand:
    """Read a command file.

    Raises:
        FileError: missing, unreadable or not JSON. CommandError: unknown, missing or malformed key.
    """
    file = expanded(path)
    try:
        text = read_file(file, JSON_BYTES)
        data = json.loads(text, object_pairs_hook=_without_repeats)
    except FileError:
        raise
    except CommandError as error:
        raise CommandError(f"{path}: {error}") from None
    except ValueError as error:
        raise FileError(path, not_json(text, "a command file", str(error))) from None
    except RecursionError:
        raise FileError(path, f"not JSON that can be read: {TOO_DEEP}.") from None
    if is_too_deep(data):
        raise FileError(path, f"not JSON that can be read: {TOO_DEEP}.")
    return command_from_dict(data, str(path), folder=file.parent)


def command_from_dict(data: Any, source: str = "command", folder: Path | None = None) -> GraspCommand:
    """Read the form of a command file.

    Args:
        data: parsed JSON. source: names it in messages. folder: where a relative calibration file is looked for.

    Raises:
        CommandError: unknown, missing or malformed key.
    """
    try:
        return _command(data, folder)
    except CommandError as error:
        raise CommandError(f"{source}: {error}") from None


def command_to_dict(command: GraspCommand) -> dict[str, Any]:
    """Return the form of a command file, without the keys that have their default."""
    document: dict[str, Any] = {"hand_pose": command.hand_pose.to_dict()}
    default = GraspCommand(command.hand_pose)
    for key in KEYS[1:]:
        value = getattr(command, key)
        if value == getattr(default, key):
            continue
        if isinstance(value, Pose):
            value = value.to_dict()
        elif isinstance(value, Mapping):
            value = dict(value)
        elif isinstance(value, tuple):
            value = [dict(v) if isinstance(v, Mapping) else str(v) if isinstance(v, StrEnum) else v for v in value]
        elif isinstance(value, (Path, StrEnum)):
            value = str(value)
        document[key] = value
    return document


def check_command(hand: Hand, command: GraspCommand) -> None:
    """Check a command against a hand.

    Raises:
        UnknownNameError: a joint, finger or link that the hand does not have.
        CommandError: an angle outside the joint's limits, a follower in the preshape, or a malformed value.
    """
    if command.root_link is not None:
        _check_root_link(hand, command.root_link)
    preshape = _preshape(command.preshape, "preshape")
    for name, angle in preshape.items() if isinstance(preshape, Mapping) else ():
        check_angle(hand, hand.joint_index(name), angle, f"preshape.{name}")
    for finger in _names(command.fingers, "fingers") or ():
        hand.finger(finger)
    _count(command.rounds, "rounds", least=0)
    if command.order.is_simultaneous and command.rounds != 1:
        raise CommandError(
            f"rounds: expected 1 with order '{command.order}', where every joint moves until it is held, "
            f"got {command.rounds}."
        )
    _check_speeds(hand, command)
    _count(command.planes, "planes")
    grids = ("yaw_grid", "open_variants", "opposition_grid")
    count = math.prod(len(_numbers(getattr(command, key), key, "offsets in rad")) for key in grids)
    if count > COMMAND_CANDIDATES:
        keys = ", ".join(grids)
        raise CommandError(f"{keys}: they make {count} candidates together; expected up to {COMMAND_CANDIDATES}.")
    if command.next_steps != ():
        check_steps(hand, command.next_steps)
    if command.task_wrenches:
        _wrenches(command.task_wrenches, "task_wrenches")
    for key in ("full_width", "check_candidates", "measure"):
        _flag(getattr(command, key), key)
    if command.seed is not None:
        _whole(command.seed, "seed")
    if command.criteria is not None and not isinstance(command.criteria, Path):
        _criteria(command.criteria, "criteria", None)


def _check_speeds(hand: Hand, command: GraspCommand) -> None:
    speeds = _weights(command.speeds, "speeds", "a relative speed above 0")
    if not speeds:
        return
    followers = {c.follower for c in hand.couplings}
    closing = [j for j, x in enumerate(hand.joints) if x.role is JointRole.CLOSING and j not in followers]
    for name, speed in speeds.items():
        joint = hand.joint_index(name)
        if speed <= 0.0:
            raise CommandError(f"speeds.{name}: expected a relative speed above 0, got {speed:.6g}.")
        if joint not in closing:
            names = ", ".join(hand.joints[j].name for j in closing)
            raise CommandError(f"speeds.{name}: expected a joint that closes and follows no other: {names}.")


def check_angle(hand: Hand, joint: int, angle: float, key: str) -> None:
    """Check that a command may set a joint to an angle [rad].

    Raises:
        CommandError: the joint follows another one, or the angle is outside its limits.
    """
    for coupling in hand.couplings:
        if coupling.follower == joint:
            leader = hand.joints[coupling.leader].name
            raise CommandError(
                f"{key}: this joint follows '{leader}' and has no angle of its own; set '{leader}' instead."
            )
    j = hand.joints[joint]
    if not j.lower - LIMIT_TOLERANCE <= angle <= j.upper + LIMIT_TOLERANCE:
        raise CommandError(f"{key}: {angle:.6g} rad is outside the joint's limits [{j.lower:.6g}, {j.upper:.6g}] rad.")


def _check_root_link(hand: Hand, name: str) -> None:
    link = hand.link_index(_text(name, "root_link"))
    for finger in hand.fingers:
        if link in finger.links:
            palm = hand.links[hand.palm].name
            raise CommandError(
                f"root_link: '{name}' moves with finger '{finger.name}'; "
                f"expected the palm '{palm}' or a link that carries it."
            )


def _command(data: Any, folder: Path | None) -> GraspCommand:
    if not isinstance(data, dict):
        raise CommandError(f"expected an object with at least 'hand_pose', got {shortened(data)}.")
    for key in data:
        if key not in KEYS:
            raise CommandError(f"{key}: unknown key; expected one of {', '.join(KEYS)}.{guessed(key, KEYS)}")
    if "hand_pose" not in data:
        raise CommandError("hand_pose: missing; expected {'position': [x, y, z], 'wxyz': [w, x, y, z]}.")
    readers: dict[str, Callable[[Any, str], Any]] = {
        "hand_pose": _pose,
        "root_link": _text,
        "object_pose": _pose,
        "preshape": _preshape,
        "fingers": _names,
        "order": lambda v, key: checked_choice(v, ClosingOrder, key),
        "orders": _orders,
        "rounds": lambda v, key: _count(v, key, least=0),
        "speeds": lambda v, key: _weights(v, key, "a relative speed above 0"),
        "planes": _count,
        "full_width": _flag,
        "yaw_grid": lambda v, key: _numbers(v, key, "offsets in rad"),
        "open_variants": lambda v, key: _numbers(v, key, "offsets in rad"),
        "opposition_grid": lambda v, key: _numbers(v, key, "offsets in rad"),
        "check_candidates": _flag,
        "measure": _flag,
        "collision_source": lambda v, key: checked_choice(v, CollisionSource, key),
        "criteria": lambda v, key: _criteria(v, key, folder),
        "next_steps": _steps,
        "task_wrenches": _wrenches,
        "seed": _whole,
    }
    # null stands for "not given" where the default is None.
    nullable = ("root_link", "object_pose", "fingers", "collision_source", "criteria", "seed")
    given = {key: value for key, value in data.items() if not (value is None and key in nullable)}
    return GraspCommand(**{key: readers[key](value, key) for key, value in given.items()})


def _pose(value: Any, key: str) -> Pose:
    if isinstance(value, dict):
        for part, what in (("position", "[x, y, z] in metres"), ("wxyz", "[w, x, y, z]")):
            # Text that looks like a number, and true, would pass for numbers further down.
            if part in value and not (isinstance(value[part], list) and all(map(_is_number, value[part]))):
                raise CommandError(f"{key}.{part}: expected numbers {what}, got {shortened(value[part])}.")
    return Pose.from_dict(value, key)


def _text(value: Any, key: str) -> str:
    if not isinstance(value, str) or not value:
        raise CommandError(f"{key}: expected a name, got {shortened(value)}.")
    return value


def _names(value: Any, key: str) -> tuple[str, ...] | None:
    if value is None:
        return None
    if isinstance(value, str) or not isinstance(value, (list, tuple)) or not value:
        raise CommandError(f"{key}: expected a list of at least one name, got {shortened(value)}.")
    names = tuple(_text(name, f"{key}[{i}]") for i, name in enumerate(value))
    for i, name in enumerate(names):
        if name in names[:i]:
            raise CommandError(f"{key}[{i}]: '{name}' is named twice.")
    return names


def _weights(value: Any, key: str, what: str) -> dict[str, float]:
    if not isinstance(value, Mapping):
        raise CommandError(f"{key}: expected an object of names with {what} each, got {shortened(value)}.")
    return {str(name): _number(number, f"{key}.{name}", what) for name, number in value.items()}


def _preshape(value: Any, key: str) -> dict[str, float] | str:
    if isinstance(value, str):
        return _text(value, key)
    if not isinstance(value, Mapping):
        raise CommandError(
            f"{key}: expected an object of names with a number in rad each, 'open', or the name of a preshape, "
            f"got {shortened(value)}."
        )
    return _weights(value, key, "a number in rad")


def _numbers(value: Any, key: str, what: str) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)) or not value:
        raise CommandError(f"{key}: expected a list of at least one number, {what}, got {shortened(value)}.")
    _few(value, key)
    return tuple(_number(v, f"{key}[{i}]", f"a number, {what}") for i, v in enumerate(value))


def _number(value: Any, key: str, what: str) -> float:
    if not _is_number(value):
        raise CommandError(f"{key}: expected {what}, got {shortened(value)}.")
    if not is_finite_number(value):
        raise CommandError(f"{key}: expected {what} that is finite, got {shortened(value)}.")
    return float(value)


def _whole(value: Any, key: str) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise CommandError(f"{key}: expected a whole number, got {shortened(value)}.")
    return int(value)


def _count(value: Any, key: str, least: int = 1) -> int:
    count = _whole(value, key)
    if not least <= count <= COMMAND_ITEMS:
        bound = f"at least {least}" if count < least else f"at most {COMMAND_ITEMS}"
        raise CommandError(f"{key}: expected {bound}, got {shortened(count)}.")
    return count


def _few(value: Sequence[Any], key: str) -> None:
    if len(value) > COMMAND_ITEMS:
        raise CommandError(f"{key}: expected up to {COMMAND_ITEMS} items, got {len(value)}.")


def _flag(value: Any, key: str) -> bool:
    if not isinstance(value, bool):
        raise CommandError(f"{key}: expected true or false, got {shortened(value)}.")
    return value


def check_steps(hand: Hand, steps: Sequence[Mapping[str, float]]) -> None:
    """Check that a hand has the joints of next steps, and can take their angles; followers obey their leaders anyway.

    Raises:
        UnknownNameError: a joint that the hand does not have.
        CommandError: an angle outside the joint's limits, or a malformed value; the message names the key.
    """
    followers = {coupling.follower for coupling in hand.couplings}
    for i, step in enumerate(_steps(steps, "next_steps")):
        for name, angle in step.items():
            joint = hand.joint_index(name)
            if joint not in followers:
                check_angle(hand, joint, angle, f"next_steps[{i}].{name}")


def _steps(value: Any, key: str) -> tuple[dict[str, float], ...]:
    if not isinstance(value, (list, tuple)):
        raise CommandError(f"{key}: expected a list of postures, got {shortened(value)}.")
    _few(value, key)
    return tuple(_weights(step, f"{key}[{i}]", "a number in rad") for i, step in enumerate(value))


def _wrenches(value: Any, key: str) -> tuple[dict[str, tuple[float, ...]], ...]:
    if not isinstance(value, (list, tuple)) or not value:
        raise CommandError(f"{key}: expected a list of at least one wrench to hold, got {shortened(value)}.")
    _few(value, key)
    return tuple(_wrench(wrench, f"{key}[{i}]") for i, wrench in enumerate(value))


def _wrench(value: Any, key: str) -> dict[str, tuple[float, ...]]:
    units = {"force": "N", "torque": "Nm"}
    if not isinstance(value, Mapping) or not value or set(value) - set(units):
        raise CommandError(
            f"{key}: expected {{'force': [x, y, z], 'torque': [x, y, z]}} or one of them, got {shortened(value)}."
        )
    found: dict[str, tuple[float, ...]] = {}
    for part, unit in units.items():
        numbers = _numbers(value.get(part, (0.0, 0.0, 0.0)), f"{key}.{part}", f"in {unit}")
        if len(numbers) != 3:
            raise CommandError(f"{key}.{part}: expected [x, y, z] in {unit}, got {shortened(value[part])}.")
        found[part] = numbers
    if not any(any(numbers) for numbers in found.values()):
        raise CommandError(f"{key}: expected a force or torque that is not 0.")
    return found


def _orders(value: Any, key: str) -> tuple[ClosingOrder, ...]:
    names = _names(value, key) or ()
    return tuple(checked_choice(name, ClosingOrder, f"{key}[{i}]") for i, name in enumerate(names))


def _criteria(value: Any, key: str, folder: Path | None) -> dict[str, float] | Path | str:
    if isinstance(value, str):
        if not set(_text(value, key)) & set("./\\~"):
            return value  # the name of a preset, not a file
        path = expanded(value)
        return path if folder is None else folder / path
    return _weights(value, key, "a weight")


def _without_repeats(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise CommandError(f"{key}: the key is given twice.")
        found[key] = value
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
