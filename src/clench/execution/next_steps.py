"""Plan the motion after the touch: the squeeze and the next steps of the work, each timed from rest to rest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Final

import numpy as np

from clench.closing.motion import next_postures
from clench.core.pose import FloatArray
from clench.models.command_file import check_steps
from clench.models.hand.hand import Hand
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .closing_path import STILL, closing_path, distinct
from .timing import TimedPath, time_path

SQUEEZE: Final = "squeeze"
NEXT_STEP: Final = "next step"
#: Names of the phases after the touch.
AFTER_TOUCH: Final = (SQUEEZE, NEXT_STEP)
#: Duration of the build-up of a squeeze, if no joint must be slower [s].
BUILDING_UP: Final = 0.4


@dataclass(frozen=True, eq=False)
class Phase:
    """A commanded motion after the touch: the squeeze, or one next step.

    Between two way-points the joints move at constant speed.

    Args:
        name: "squeeze" or "next step". times: from its own start [s], shape (N,), rising from 0.
        positions: joint angles [rad], shape (N, J); the first row is the end of the phase before.
        step: index of the next step; None for the squeeze.
    """

    name: str
    times: FloatArray
    positions: FloatArray
    step: int | None = None

    @property
    def duration(self) -> float:
        """Time from its start to its end [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> FloatArray:
        """Return the angles at a time [s] from its start, shape (J,)."""
        return np.array([np.interp(time, self.times, column) for column in self.positions.T])

    def share_at(self, time: float) -> float:
        """Return how much of the motion, over all joints, has been gone through at a time [s], 0 to 1."""
        gone = np.concatenate([np.zeros(1), np.cumsum(np.abs(np.diff(self.positions, axis=0)).sum(axis=1))])
        return float(np.interp(time, self.times, gone)) / gone[-1] if gone[-1] > 0.0 else 1.0


def plan_next_steps(
    solution: GraspSolution, hand: Hand, told: FloatArray, pace: tuple[FloatArray, FloatArray]
) -> tuple[Phase, ...]:
    """Time the motions to a solution's next steps, one after another.

    The joints that a step names, and their followers, move on a straight line. The others keep their targets, so that
    fingers that no step moves continue to squeeze.

    Args:
        solution: with `next_steps`. hand: the hand that was solved for.
        told: where the joints are told to be before the first step [rad], shape (J,).
        pace: largest velocity [rad/s] and acceleration [rad/s²] of every joint, shape (J,) each.

    Raises:
        UnknownNameError: a joint that the hand does not have. CommandError: an angle outside the joint's limits.
    """
    check_steps(hand, solution.next_steps)
    phases, begin = [], told
    for number, named in enumerate(next_postures(hand, solution.next_steps)):
        end = np.where(np.abs(named - begin) > STILL, named, begin)  # NaN, too, is no motion
        way = closing_path(hand, range(len(end)), begin, end, np.abs(end - begin), 1)
        phases.append(_phase(NEXT_STEP, time_path([way, end[None]], *pace), end, number))
        begin = end
    return tuple(phases)


def plan_after_touch(solution: GraspSolution, hand: Hand, pace: tuple[FloatArray, FloatArray]) -> tuple[Phase, ...]:
    """Time the motion after the touch of a solution with next steps: its squeeze, if it has one, and the steps.

    Args:
        solution: with `squeeze` where joints shall be told angles beyond the touch, see `clench.complete`.
        hand: the hand that was solved for. pace: see `plan_next_steps`.

    Raises:
        UnknownNameError, CommandError: see `plan_next_steps`.
    """
    if not solution.next_steps:
        return ()
    touch = posture(solution.joint_angles, hand, "joint_angles")
    told = touch + squeeze_offsets(solution, hand)
    if not (told != touch).any():
        return plan_next_steps(solution, hand, touch, pace)
    squeeze = _phase(SQUEEZE, time_path([np.array([touch, told])], *pace), told, least=BUILDING_UP)
    return (squeeze, *plan_next_steps(solution, hand, told, pace))


def squeeze_offsets(solution: GraspSolution, hand: Hand) -> FloatArray:
    """Return the angles beyond the touch that a feasible squeeze plan tells the joints [rad], shape (J,).

    They are 0 without such a plan, or if one of them would be outside the limits.
    """
    plan = solution.squeeze or {}
    none = np.zeros(len(hand.joints))
    if not plan.get("feasible"):
        return none
    offsets: Mapping[str, float] = plan.get("offsets", {})
    found = np.array([float(offsets.get(name, 0.0)) for name in hand.joint_names])
    told = posture(solution.joint_angles, hand, "joint_angles") + found
    inside = [j.lower <= q <= j.upper for j, q in zip(hand.joints, told, strict=True)]
    return found if all(ok or offset == 0.0 for ok, offset in zip(inside, found, strict=True)) else none


def points_after(phases: Sequence[Phase], touch: float) -> Iterator[dict[str, Any]]:
    """Yield the way-points of phases as a trajectory's document has them, without the first, which came before.

    Args:
        phases: of the motion after the touch. touch: when it is [s].
    """
    begin = touch
    for phase in phases:
        step = {} if phase.step is None else {"step": phase.step}
        for time, q in zip(phase.times[1:], phase.positions[1:], strict=True):
            yield {"time": begin + float(time), "phase": phase.name, **step, "positions": q.tolist()}
        begin += phase.duration


def phases_after(
    names: Sequence[tuple[str, int | None]], times: FloatArray, positions: FloatArray
) -> tuple[Phase, ...]:
    """Return the phases of the way-points from the touch on; a phase of no duration has none.

    Args:
        names: phase and step of every way-point; the first is the touch. times: [s], shape (N,).
        positions: [rad], shape (N, J).
    """
    found, begin = [], 0
    for (name, step), group in groupby(range(1, len(names)), key=lambda k: names[k]):
        end = [*group][-1] + 1
        found.append(Phase(name, times[begin:end] - times[begin], positions[begin:end], step))
        begin = end - 1
    return tuple(found)


def moved_joints(hand: Hand, step: Mapping[str, float]) -> tuple[int, ...]:
    """Return the joints that a next step moves: those it names that follow no other, and their followers."""
    return tuple(np.flatnonzero(~np.isnan(next_postures(hand, [step])[0])).tolist())


def _phase(name: str, timed: TimedPath, end: FloatArray, step: int | None = None, least: float = 0.0) -> Phase:
    duration = max(timed.duration, least)
    times = distinct(timed.samples(duration))
    positions = timed.stretched_at(times, duration)
    positions[-1] = end
    return Phase(name, times, positions, step)
