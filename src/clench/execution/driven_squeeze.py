"""The squeeze of a driven hand: the plan's angle offsets beyond the touch, checked like every other command."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from clench.models.hand.hand import Hand
from clench.solve.posture import posture
from clench.solve.solution import GraspSolution

from .command_check import CommandCheck, slowed_down
from .driver import HandDriver, RefusedCommandError
from .following import CLOSEST, Followed, Follower, TimedPlan
from .joint_map import MappedJoint

#: How long the squeeze takes to build up, if no joint must be slower [s].
BUILDING_UP: Final = 0.4
#: Way-points of it.
_POINTS: Final = 9


@dataclass(frozen=True)
class DrivenSqueeze:
    """Hold what came of a squeeze: a sentence, empty without one, and what was followed, None when nothing was sent."""

    text: str = ""
    followed: Followed | None = None


def squeeze_by_driver(
    solution: GraspSolution,
    hand: Hand,
    driver: HandDriver,
    mapped: Mapping[str, MappedJoint],
    check: CommandCheck,
    stopping: threading.Event,
    share: float,
) -> DrivenSqueeze:
    """Tell every joint the angle beyond its touch at which its servo exerts its share of the squeeze plan.

    Args:
        solution: with `squeeze`, see `clench.complete`; without it, or without offsets, nothing is done.
        hand: the model. driver: connected, at the touch. mapped: the joints as the controller says them.
        check: what every command and state must pass. stopping: set to stop from elsewhere.
        share: of the planned offsets [-].
    """
    plan = solution.squeeze or {}
    offsets = {name: share * float(plan.get("offsets", {}).get(name, 0.0)) for name in mapped}
    if not any(offsets.values()):
        return DrivenSqueeze()
    if not plan.get("feasible"):
        return DrivenSqueeze(f"There was no squeeze: {plan.get('text', 'none is planned.')}")
    timed = _timed(solution, hand, mapped, offsets, check)
    try:
        check.command(timed.window(0.0, timed.duration + CLOSEST), timed.at(0.0))
    except RefusedCommandError as error:
        return DrivenSqueeze(f"There was no squeeze: {error}")
    anywhere = {joint.name: np.inf for joint in mapped.values()}  # held by the object, joints stay behind
    followed = Follower(driver, check, stopping, settling=BUILDING_UP, arrived=anywhere).follow(timed)
    largest = max(map(abs, offsets.values()))
    return DrivenSqueeze(
        f"Joints were told up to {largest:.3g} rad beyond the touch, as the squeeze plan says.", followed
    )


def _timed(
    solution: GraspSolution,
    hand: Hand,
    mapped: Mapping[str, MappedJoint],
    offsets: Mapping[str, float],
    check: CommandCheck,
) -> TimedPlan:
    touch = posture(solution.joint_angles, hand, "joint_angles")
    columns = []
    for name, joint in mapped.items():
        angle = float(touch[hand.joint_index(name)])
        columns.append((joint.to_controller(angle), joint.to_controller(angle + offsets[name])))
    begin, end = np.array(columns).T
    s = np.linspace(0.0, 1.0, _POINTS)[:, None]
    positions = begin + (s * s * (3.0 - 2.0 * s)) * (end - begin)
    joints = tuple(joint.name for joint in mapped.values())
    speeds = np.array([check.limits[name].velocity for name in joints])
    return TimedPlan(joints, slowed_down(BUILDING_UP * s[:, 0], positions, speeds), positions)
