"""Write the scene of the page as ten lines of Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from clench.core.pose import Pose
from clench.models.command import ClosingOrder, GraspCommand

from .view_state import ViewState


def scene_code(state: ViewState, hand_code: str, object_code: Sequence[str]) -> str:
    """Return a program that solves a state and plans its forces.

    Args:
        state: the state of the page. hand_code: loads the hand. object_code: lines that make `obj`.
    """
    friction = "" if state.friction is None else f", friction={state.friction!r}"
    lines = [
        "import clench",
        "",
        f"hand = {hand_code}",
        *object_code,
        "command = clench.GraspCommand(",
        *(f"    {name}={value}," for name, value in _arguments(state.command).items()),
        ")",
        "solution = clench.solve(hand, obj, command)",
        "print(solution.status, solution.joint_angles)",
        f"squeeze = clench.plan_squeeze(solution, hand, obj, mass={state.mass!r}{friction})",
        "print(squeeze.text)",
    ]
    return "\n".join(lines) + "\n"


def call_code(function: str, *given: Any, **named: Any) -> str:
    """Return a call as code, without the arguments that are None."""
    words = [repr(value) for value in given]
    words += [f"{name}={value!r}" for name, value in named.items() if value is not None]
    return f"{function}({', '.join(words)})"


def pose_code(pose: Pose) -> str:
    """Return a pose as code, with all digits."""
    return f"clench.Pose({pose.position.tolist()}, wxyz={pose.wxyz.tolist()})"


def _arguments(command: GraspCommand) -> dict[str, str]:
    """Return the arguments of a command that are not the usual ones, as code."""
    found = {"hand_pose": pose_code(command.hand_pose)}
    usual = GraspCommand(command.hand_pose)
    for name, value in command.__dict__.items():
        if name == "hand_pose" or value == getattr(usual, name):
            continue
        if isinstance(value, Pose):
            found[name] = pose_code(value)
        elif name == "orders":
            found[name] = f"({', '.join(f'clench.ClosingOrder({str(each)!r})' for each in value)},)"
        elif isinstance(value, ClosingOrder):
            found[name] = f"clench.ClosingOrder({str(value)!r})"
        elif name == "collision_source":
            found[name] = f"clench.types.CollisionSource({str(value)!r})"
        elif name == "criteria" and not isinstance(value, Mapping):
            found[name] = repr(str(value))
        else:
            found[name] = repr(value)
    return found
