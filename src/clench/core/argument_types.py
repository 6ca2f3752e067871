"""Check arguments that users mix up: their types, and names from a list."""

from __future__ import annotations

from enum import StrEnum
from typing import Final, TypeVar

from .exceptions import CommandError

Choice = TypeVar("Choice", bound=StrEnum)

#: Ways to make an object of each public type, by the name of the type.
_MADE_BY: Final = {
    "Hand": "clench.Hand.load",
    "GraspObject": "clench.GraspObject.load",
    "GraspCommand": "clench.GraspCommand(hand_pose=clench.Pose([x, y, z], wxyz=[w, x, y, z]))",
    "GraspSolution": "clench.solve(hand, obj, command)",
    "GraspBatch": "clench.solve_batch(hand, obj, poses)",
    "Pose": "clench.Pose([x, y, z], wxyz=[w, x, y, z])",
    "Body": "clench.obstacle(shape, pose)",
}


def check_type(value: object, kind: type, key: str, *, also: str = "") -> None:
    """Check that an argument has the type that a function expects.

    Args:
        value: the argument. kind: one of the public types. key: name of the argument. also: another accepted type.

    Raises:
        CommandError: another type; the sentence says how to make the expected one.
    """
    if isinstance(value, kind):
        return
    maker = _MADE_BY[kind.__name__]
    if kind.__name__ == "GraspCommand" and isinstance(value, str):
        maker = f"clench.load_command({value!r})"
    elif maker.endswith(".load"):
        maker = f"{maker}({value!r})" if isinstance(value, str) else f"{maker}(name or path)"
    expected = f"a clench.{kind.__name__}" + (f" or {also}" if also else "")
    shown = repr(value) if isinstance(value, str) else type(value).__name__
    raise CommandError(f"{key}: expected {expected}, got {shown}; {maker} makes one.")


def checked_choice(value: object, choices: type[Choice], key: str) -> Choice:
    """Return the member of an enumeration that a value names.

    Args:
        value: a member, or its text. choices: the enumeration. key: name of the argument.

    Raises:
        CommandError: no such member; the sentence lists all of them.
    """
    if value not in list(choices):
        listed = ", ".join(str(choice) for choice in choices)
        raise CommandError(f"{key}: expected one of {listed}, got {shortened(value)}.")
    return choices(str(value))


def shortened(value: object) -> str:
    """Return a value as an error message shows it, in up to 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
