"""The squeeze of a driven hand: the plan's angle offsets beyond the touch, checked like every other command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from clench.execution.next_steps import BUILDING_UP
from clench.execution.step_check import squeeze_overlap
from clench.models.hand.hand import Hand
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .command_check import CommandCheck, slowed_down
from .driver import RefusedCommandError
from .driver_session import DriverSession
from .following import CLOSEST, Followed, Follower, TimedPlan
from .joint_map import MappedJoint
from .supervision import Event

#: Way-points of it.
_POINTS: Final = 9


@dataclass(frozen=True, eq=False)
class DrivenSqueeze:
    """The squeeze, in the form in which it goes to a controller.

    Args:
        text: a sentence about it, empty without one. offsets: angles beyond the touch that are told [rad], by joint.
        plan: the way there, None when nothing is told.
    """

    text: str = ""
    offsets: Mapping[str, float] = field(default_factory=dict)
    plan: TimedPlan | None = None


def plan_driven_squeeze(
    solution: GraspSolution, hand: Hand, mapped: Mapping[str, MappedJoint], check: CommandCheck, share: float
) -> DrivenSqueeze:
    """Plan to tell every joint the angle beyond its touch at which its servo exerts its share of the squeeze plan.

    Args:
        solution: with `squeeze`, see `clench.complete`; without it, or without offsets, no command is sent.
        hand: the model. mapped: the joints as the controller says them. check: test for every command.
        share: of the planned offsets [-].
    """
    plan = solution.squeeze or {}
    told = plan.get("offsets", {})
    silent = [
        name for name, torque in plan.get("torques", {}).items() if torque and name in mapped and name not in told
    ]
    offsets = {name: share * float(plan.get("offsets", {}).get(name, 0.0)) for name in mapped}
    if not any(offsets.values()):
        return DrivenSqueeze(f"There was no squeeze: {_unknown(silent)}" if silent and share else "")
    if not plan.get("feasible"):
        return DrivenSqueeze(f"There was no squeeze: {plan.get('text', 'none is planned.')}")
    beyond = np.array([offsets.get(name, 0.0) for name in hand.joint_names])
    overlap = squeeze_overlap(solution, hand, beyond)
    if overlap is not None:
        return DrivenSqueeze(f"There was no squeeze: {overlap}")
    timed = _timed(solution, hand, mapped, offsets, check)
    try:
        check.command(timed.window(0.0, timed.duration + CLOSEST), timed.at(0.0))
    except RefusedCommandError as error:
        return DrivenSqueeze(f"There was no squeeze: {error}")
    largest = max(map(abs, offsets.values()))
    text = f"Joints were told up to {largest:.3g} rad beyond the touch, as the squeeze plan says."
    if silent:
        text += f" Not all of it was told: {_unknown(silent)}"
    return DrivenSqueeze(text, offsets, timed)


def _unknown(joints: list[str]) -> str:
    named = ", ".join(f"'{joint}'" for joint in joints)
    return (
        f"the hand's model gives no servo gain of {named}, so the angles that exert the planned torques are not known."
    )


def squeeze_by_driver(
    squeeze: DrivenSqueeze,
    session: DriverSession,
    mapped: Mapping[str, MappedJoint],
    check: CommandCheck,
    found: Followed,
) -> None:
    """Squeeze as planned; do nothing if the plan is empty.

    Args:
        squeeze: planned. session: with the driver, at the touch. mapped: the joints as the controller says them.
        check: test for every command and state. found: collects the samples.

    Raises:
        DriverError: see `Follower.follow`.
    """
    if squeeze.plan is None:
        return
    session.enter(Event.SQUEEZE)
    anywhere = {joint.name: np.inf for joint in mapped.values()}  # held by the object, joints stay behind
    Follower(session, check, settling=BUILDING_UP, arrived=anywhere).follow(squeeze.plan, found)


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
