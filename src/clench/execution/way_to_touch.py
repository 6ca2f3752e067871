"""Find a free path from the open hand to the touch: straight, along the closing paths, or finger after finger.

Every path is proven before it is returned, see `path_check`. If two fingers would meet, one of them waits until the
other one has arrived. If a finger would meet the object or the palm on a straight line in joint space, the finger goes
along its closing path instead, joint by joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from clench.closing.collision.path_check import PathOverlap, check_path, find_path_overlap, is_path_free
from clench.core.exceptions import MotionError
from clench.core.pose import FloatArray
from clench.models.command import ClosingOrder
from clench.models.hand.hand import Hand, JointRole
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .closing_path import STILL, closing_path, closing_stages, distinct, eased
from .landing import LANDING_SPEED, Landing
from .step_check import placed_object
from .timing import TimedPath, time_path

#: Way-points of a path on which all joints move simultaneously, besides those at which a joint stops.
AT_ONCE_STEPS: Final = 32
#: If no way to a pregrasp is free, a pregrasp nearer to the touch is tried: shares of the clearance [-].
_CLEARANCES: Final = (1.0, 0.25)
#: Largest number of plans that are checked for one pregrasp.
_MOST_PLANS: Final = 24
#: No more plans are tried where so many lead links deeper into each other that overlap where the hand is.
_MOST_STUCK: Final = 3
#: Times [s], shape (N,), and postures [rad], shape (N, J).
_Part = tuple[FloatArray, FloatArray]


class _Last(NamedTuple):
    """The rest of a way; it is proven if no link overlaps anything at the touch, because then no direction counts."""

    part: _Part
    proven: bool


@dataclass(frozen=True)
class FingerPlan:
    """Say when each finger moves, and along which path.

    Args:
        turn: of each finger; fingers of one turn move together, and later turns wait for them.
        straight: whether each finger moves on a straight line in joint space, or else along its closing path.
    """

    turn: tuple[int, ...]
    straight: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Way:
    """A path from the open hand to the touch, and its first overlap.

    Args:
        times: [s], shape (N,), from 0. positions: [rad], shape (N, J).
        pregrasp: index of the way-point from which all contacts are reached simultaneously, or None.
        turns: names of the fingers that move to the pregrasp, or to the touch, at the same time; first turn first.
        overlap: the first overlap on the path; None for a free path.
    """

    times: FloatArray
    positions: FloatArray
    pregrasp: int | None
    turns: tuple[tuple[str, ...], ...]
    overlap: PathOverlap | None = None


class WayFinder:
    """Search for a free path of a hand to the touch.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for; without the object only links are
            checked against each other.
        pace: largest velocity [rad/s] and acceleration [rad/s²] of every joint, shape (J,) each.
    """

    def __init__(
        self,
        solution: GraspSolution,
        hand: Hand,
        obj: GraspObject | None,
        pace: tuple[FloatArray, FloatArray],
    ) -> None:
        self.solution, self.hand, self.pace = solution, hand, pace
        self.source = CollisionSource(solution.collision_source)
        self.around = None if obj is None else placed_object(solution, obj)
        self.start = posture(solution.open_angles, hand, "open_angles")
        self.end = posture(solution.joint_angles, hand, "joint_angles")
        #: What overlapped on paths that were tried, on the way and from the touch back.
        self._met: list[PathOverlap] = []
        self._lifted_met: list[PathOverlap] = []

    def find(self, clearance: float) -> Way:
        """Return the first free path; without one, the first tried path with its overlap.

        Args:
            clearance: of the pregrasp [m].
        """
        failed: list[Way] = []
        for share in _CLEARANCES if self.around is not None else ():
            landing = self._landing(share * clearance)
            if landing is None:
                continue
            goal, last = landing
            way = self.search(goal, last=last)
            if way.overlap is None:
                return way
            failed.append(way)
        way = self.search(self.end, straight=False)
        if way.overlap is not None:
            # The order of the certificate: one finger after another, along the paths that were computed.
            order = list(self.solution.fingers)
            turns = [order.index(f.name) if f.name in order else len(order) for f in self.hand.fingers]
            count = len(self.hand.fingers)
            certified = self._checked(FingerPlan(tuple(turns), (False,) * count), self.end, None)
            if certified.overlap is None:
                return certified
        return way if way.overlap is None or not failed else failed[0]

    def _landing(self, clearance: float) -> tuple[FloatArray, _Last] | None:
        """Return a pregrasp and the straight line from there to all contacts; None if it is not free."""
        found = self._pregrasp(clearance)
        if found is None:
            return None
        goal, proven = found
        slow = np.minimum(self.pace[0], np.abs(self.end - goal) * (LANDING_SPEED / clearance))
        joints = range(len(goal))
        line = time_path(self._line(joints, goal, self.end), slow, self.pace[1])
        return goal, _Last(_joined([line], self.end, [joints]), proven)

    def _pregrasp(self, clearance: float) -> tuple[FloatArray, bool] | None:
        """Return a posture from which the straight line to the touch is free; a joint rests where that helps.

        Return also whether the line is free in both directions.
        """
        goal = self._landings.start(clearance)
        if goal is None:
            return None
        overlap, begun = check_path(self.hand, self._lifted(goal), self.source, self.around, self._lifted_met)
        if overlap is None:
            return goal, not begun
        suspects = self._lifted_met = [overlap]
        for j in (j for f in self._fingers_of(overlap) for j in self.hand.fingers[f].joints):
            goal = self._landings.start(clearance, (j,))
            if goal is not None and is_path_free(self.hand, self._lifted(goal), self.source, self.around, suspects):
                return goal, not begun
        return None

    def _lifted(self, goal: FloatArray) -> FloatArray:
        """Return the straight line from the touch, which is free: links that overlap where a path begins may part."""
        return np.vstack(self._line(range(len(goal)), goal, self.end))[::-1]

    @cached_property
    def _landings(self) -> Landing:
        return Landing(self.solution, self.hand)

    def begun_at(self, start: FloatArray) -> WayFinder:
        """Return the same search from another posture."""
        other = copy(self)
        other.start = start
        return other

    def overlap(self, path: FloatArray) -> PathOverlap | None:
        """Return the first overlap on a path, shape (N, J); None for a free path."""
        return find_path_overlap(self.hand, path, self.source, self.around)

    def straight(self, goal: FloatArray) -> Way:
        """Return the straight line in joint space to a posture, with its overlap unless it is free."""
        joints = range(len(goal))
        line = time_path(self._line(joints, self.start, goal), *self.pace)
        times, positions = _joined([line], goal, [joints])
        return Way(times, positions, None, (), self.overlap(positions))

    def closing(self) -> tuple[FloatArray, FloatArray]:
        """Return times [s] and postures [rad] of all fingers' closing paths at the same time, without a check."""
        count = len(self.hand.fingers)
        return self._timed(FingerPlan((0,) * count, (False,) * count), self.end)

    def search(self, goal: FloatArray, *, straight: bool = True, last: _Last | None = None) -> Way:
        """Return a free way to a posture; where none is found the first one tried, with its overlap.

        Args:
            goal: the posture [rad], shape (J,). straight: whether fingers first try straight lines, or else their
                closing paths. last: the rest of the way.
        """
        count = len(self.hand.fingers)
        plans = [FingerPlan((0,) * count, (straight,) * count)]
        seen, first = set(plans), None
        blocked: set[tuple[int, bool]] = set()
        stuck = 0
        while plans and len(seen) <= _MOST_PLANS:
            plan = plans.pop(0)
            if any(way in blocked for way in enumerate(plan.straight)):
                continue
            way = self._checked(plan, goal, last)
            if way.overlap is None:
                return way
            first = first or way
            stuck += way.overlap.from_start
            if stuck >= _MOST_STUCK:
                break
            met = self._fingers_of(way.overlap)
            if len(met) == 1:  # what it meets is there in every turn
                blocked.add((met[0], plan.straight[met[0]]))
            for other in self._alternatives(plan, way.overlap):
                if other not in seen:
                    seen.add(other)
                    plans.append(other)
        assert first is not None
        return first

    def _checked(self, plan: FingerPlan, goal: FloatArray, last: _Last | None) -> Way:
        times, positions = self._timed(plan, goal)
        pregrasp, checked = None, positions
        if last is not None:
            pregrasp = len(times) - 1
            times = np.concatenate([times[:-1], times[-1] + last.part[0]])
            positions = np.vstack([positions[:-1], last.part[1]])
            checked = checked if last.proven else positions
            # Without a contact, there is nothing to keep a clearance from.
            pregrasp = pregrasp if pregrasp < len(times) - 1 else None
        overlap = check_path(self.hand, checked, self.source, self.around, self._met)[0]
        if overlap is not None:
            self._met.append(overlap)
        names = [f.name for f in self.hand.fingers]
        moved = [bool((self.start[f.own] != goal[f.own]).any()) for f in self.hand.fingers]
        turns = (
            tuple(n for n, t, moves in zip(names, plan.turn, moved, strict=True) if t == k and moves)
            for k in range(max(plan.turn, default=0) + 1)
        )
        return Way(times, positions, pregrasp, tuple(turn for turn in turns if turn), overlap)

    def _alternatives(self, plan: FingerPlan, overlap: PathOverlap) -> Iterator[FingerPlan]:
        """Yield plans that may avoid an overlap: one of two fingers waits, or a finger goes along its closing path."""
        fingers = self._fingers_of(overlap)
        if len(fingers) == 2 and plan.turn[fingers[0]] == plan.turn[fingers[1]]:
            # The finger that was closed later waits first.
            for waits in sorted(fingers, key=self._rank, reverse=True):
                yield replace(plan, turn=_later(plan.turn, waits))
        for finger in fingers:
            if plan.straight[finger]:
                yield replace(plan, straight=tuple(s and k != finger for k, s in enumerate(plan.straight)))
        if len(fingers) == 2 and plan.turn[fingers[0]] != plan.turn[fingers[1]]:
            earlier, later = sorted(fingers, key=lambda f: plan.turn[f])
            swapped = list(plan.turn)
            swapped[earlier], swapped[later] = plan.turn[later], plan.turn[earlier]
            yield replace(plan, turn=tuple(swapped))

    def _fingers_of(self, overlap: PathOverlap) -> list[int]:
        met = [self._finger_of(overlap.link), None if overlap.with_object else self._finger_of(overlap.other)]
        return [f for f in dict.fromkeys(met) if f is not None]

    def _rank(self, finger: int) -> int:
        names = list(self.solution.fingers)
        name = self.hand.fingers[finger].name
        return names.index(name) if name in names else len(names)

    def _finger_of(self, link: str) -> int | None:
        number = self.hand.link_index(link)
        return next((k for k, f in enumerate(self.hand.fingers) if number in f.links), None)

    def _timed(self, plan: FingerPlan, goal: FloatArray) -> _Part:
        """Return times and postures from the open hand to a posture."""
        turned, opening = self._preparation(goal)
        parts = [_joined([time_path(opening, *self.pace)], turned, [range(len(goal))])]
        q = turned
        for turn in range(max(plan.turn, default=0) + 1):
            own = [f for f, t in zip(self.hand.fingers, plan.turn, strict=True) if t == turn]
            straight = [s for s, t in zip(plan.straight, plan.turn, strict=True) if t == turn]
            target = q.copy()
            for finger in own:
                target[finger.own] = goal[finger.own]
            if (target == q).all():
                continue
            paths = [
                time_path(self._stages(f.joints, q, target, straight=s), *self.pace)
                for f, s in zip(own, straight, strict=True)
            ]
            parts.append(_joined(paths, target, [f.joints for f in own]))
            q = target
        return _concatenated(parts, goal)

    def _preparation(self, end: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
        """Return the first posture after everything but the closing joints has moved, and the path there."""
        in_fingers = {j for finger in self.hand.fingers for j in finger.joints}
        first = [
            j
            for j, joint in enumerate(self.hand.joints)
            if abs(end[j] - self.start[j]) > STILL and (joint.role is not JointRole.CLOSING or j not in in_fingers)
        ]
        turned = self.start.copy()
        turned[first] = end[first]
        return turned, self._line(first, self.start, turned) if first else [self.start[None]]

    def _line(self, joints: Sequence[int], start: FloatArray, end: FloatArray) -> list[FloatArray]:
        """Return the straight line between two postures, with a corner where a follower starts or stops."""
        return [closing_path(self.hand, joints, start, end, np.abs(end - start), 1), end[None]]

    def _stages(
        self, joints: tuple[int, ...], start: FloatArray, end: FloatArray, *, straight: bool
    ) -> list[FloatArray]:
        """Return the stages of one finger; the other fingers rest."""
        goal = start.copy()
        goal[list(joints)] = end[list(joints)]
        if straight:
            return self._line(joints, start, goal)
        if _closed_at_once(self.solution):
            return _path_at_once(self.solution, self.hand, joints, start, goal)
        return list(closing_stages(self.hand, joints, start, goal))


def in_turn(turns: Sequence[Sequence[str]]) -> str:
    """Say which fingers move at the same time, and which wait, e.g. "'index' and 'middle', then 'thumb'"."""
    return ", then ".join(" and ".join(f"'{name}'" for name in turn) for turn in turns)


def refuse_way(way: Way, hand: Hand) -> None:
    """Raise an error that says why no path is free.

    Raises:
        MotionError: the way is not free.
    """
    found = way.overlap
    if found is None:
        return
    k = min(int(found.place), len(way.times) - 1)
    after = min(k + 1, len(way.times) - 1)
    time = way.times[k] + (found.place - k) * (way.times[after] - way.times[k])
    raise MotionError(
        f"No free path to the touch was found for hand '{hand.name}': {found.sentence} "
        f"{time:.2f} s after the start of the first path that was tried; other orders of the fingers and paths joint "
        "by joint failed, too."
    )


def _later(turn: tuple[int, ...], waits: int) -> tuple[int, ...]:
    """Return turns in which one finger moves after its former turn and before the next one."""
    own = turn[waits]
    return tuple(t + 1 if k == waits or t > own else t for k, t in enumerate(turn))


def _concatenated(parts: Sequence[_Part], goal: FloatArray) -> _Part:
    """Return parts that follow each other as one; where none moves, one way-point at the goal."""
    times, positions = parts[0]
    for later, path in parts[1:]:
        times = np.concatenate([times[:-1], times[-1] + later])
        positions = np.vstack([positions[:-1], path])
    positions = positions.copy()
    positions[-1] = goal
    return times, positions


def _joined(paths: list[TimedPath], end: FloatArray, joints: Sequence[Sequence[int]]) -> _Part:
    """Return times and postures of paths that are gone through at the same time, each by some of the joints."""
    duration = max((path.duration for path in paths), default=0.0)
    grid = distinct(np.concatenate([np.zeros(1), *(path.samples(duration) for path in paths)]))
    positions = np.tile(paths[0].corners[0] if paths else end, (len(grid), 1))
    for own, path in zip(joints, paths, strict=True):
        moved = [j for j in own if np.ptp(path.corners[:, j]) > 0.0]
        if moved:
            positions[:, moved] = path.stretched_at(grid, duration)[:, moved]
    positions[-1] = end
    return grid, positions


def _closed_at_once(solution: GraspSolution) -> bool:
    chosen = [result.best for result in solution.fingers.values()]
    return any(best is not None and best.order != ClosingOrder.PROXIMAL_FIRST for best in chosen)


def _path_at_once(
    solution: GraspSolution, hand: Hand, joints: Sequence[int], start: FloatArray, end: FloatArray
) -> list[FloatArray]:
    """Return the path on which joints move together, each at its speed and until its end, as stages."""
    speed = np.array([solution.speeds.get(name, 1.0) for name in hand.joint_names])
    path = closing_path(hand, joints, start, end, speed, AT_ONCE_STEPS)
    return [path, eased(path[-1], end)] if np.abs(end - path[-1]).max(initial=0.0) > STILL else [path]
