"""The whole motion of a driven hand: from where the hand is found to the trajectory's start, and along it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.execution.trajectory import Trajectory
from clench.execution.way_to_touch import Way, WayFinder, in_turn
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

from .command_check import CommandCheck, slowed_down
from .driver import HandState, RefusedCommandError
from .following import TimedPlan
from .joint_map import MappedJoint


@dataclass(frozen=True, eq=False)
class DrivenWay:
    """The whole motion to the touch, in the form in which it goes to a controller.

    Args:
        plan: in the controller's names and units. text: a sentence about the way to the trajectory's start.
    """

    plan: TimedPlan
    text: str


def plan_driven_way(
    solution: GraspSolution,
    trajectory: Trajectory,
    hand: Hand,
    obj: GraspObject | None,
    mapped: Mapping[str, MappedJoint],
    check: CommandCheck,
    state: HandState,
) -> DrivenWay:
    """Plan a free motion from where a hand is found to the touch.

    All joints move to the trajectory's start on a straight line. If this line is not free, fingers wait for each other.
    Joints without a measurement are taken to be at the trajectory's start; followers are where the coupling puts them.

    Args:
        solution: says where the object is. trajectory: to the touch. hand: the model.
        obj: the object; None checks the hand's links alone. mapped: the joints as the controller says them.
        check: the limits of the joints. state: where the hand is found.

    Raises:
        RefusedCommandError: no free way was found, or the motion as commanded is not free; the sentence names the
            overlapping bodies.
    """
    found = found_posture(hand, mapped, state.positions, trajectory.positions[0])
    finder = WayFinder(solution, hand, obj, trajectory.pace).begun_at(found)
    way = _way_to_start(finder, trajectory.positions[0])
    if way.overlap is not None:
        raise RefusedCommandError(
            f"No free way was found from where the hand is to the trajectory's start: {way.overlap.sentence}. Move "
            "the hand, or solve from a posture nearer to it."
        )
    columns = [hand.joint_index(name) for name in mapped]
    joints = list(mapped.values())
    scale, offset = np.array([j.scale for j in joints]), np.array([j.offset for j in joints])
    speeds = np.array([check.limits[j.name].velocity for j in joints]) / np.abs(scale)
    before = slowed_down(way.times, way.positions[:, columns], speeds)
    after = slowed_down(trajectory.times, trajectory.positions[:, columns], speeds)
    times = np.concatenate([before[:-1], before[-1] + after])
    positions = np.vstack([way.positions[:-1], trajectory.positions])
    names = tuple(joint.name for joint in joints)
    plan = TimedPlan(names, times, positions[:, columns] * scale + offset)
    kept = plan.thinned()
    told = positions[np.searchsorted(times, kept.times)]
    overlap = finder.overlap(told)
    if overlap is not None:
        raise RefusedCommandError(f"On the way to the touch, {overlap.sentence}.")
    return DrivenWay(kept, _said(way, found, trajectory.positions[0]))


def found_posture(
    hand: Hand, mapped: Mapping[str, MappedJoint], measured: Mapping[str, float], others: FloatArray
) -> FloatArray:
    """Return the angles of all joints where a hand is found [rad], shape (J,).

    Args:
        hand: the model. mapped: the joints as the controller says them. measured: by its names and in its units.
        others: angles of joints that are neither measured nor followers [rad], shape (J,).
    """
    q = np.array(others, dtype=np.float64)
    known = {
        hand.joint_index(name): joint.to_angle(measured[joint.name])
        for name, joint in mapped.items()
        if np.isfinite(measured.get(joint.name, np.nan))
    }
    q[list(known)] = list(known.values())
    q = hand.coupled(q)
    q[list(known)] = list(known.values())  # a follower that is measured is where it is
    return q


def _way_to_start(finder: WayFinder, goal: FloatArray) -> Way:
    """Return the first free way to the trajectory's start; where none is, the straight line with its overlap."""
    straight = finder.straight(goal)
    if straight.overlap is None:
        return straight
    way = finder.search(goal)
    if way.overlap is None:
        return way
    back = finder.begun_at(goal).search(finder.start)
    positions = np.ascontiguousarray(back.positions[::-1])
    if finder.overlap(positions) is None:
        return Way(back.times[-1] - back.times[::-1], positions, None, back.turns[::-1])
    return straight


def _said(way: Way, found: FloatArray, goal: FloatArray) -> str:
    far = float(np.abs(goal - found).max(initial=0.0))
    text = f"The way began with a part to the trajectory's start, {far:.3g} rad at most."
    if len(way.turns) > 1:
        text += f" There, fingers waited for each other: {in_turn(way.turns)}."
    return text
