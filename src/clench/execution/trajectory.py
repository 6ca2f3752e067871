"""Timed joint paths from the open hand to the touch, on which all fingers arrive together (METHOD.md section 7)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from clench.base.errors import CommandError, FileError
from clench.base.json_files import non_finite_path, read_json, write_json
from clench.base.pose import FloatArray
from clench.models.command import ClosingOrder
from clench.models.hand.hand import DEFAULT_SPEED, Hand, JointRole
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solve.posture import posture
from clench.solve.solution import GraspSolution

from .closing_path import STILL, closing_path, distinct
from .landing import CLEARANCE, LANDING_SPEED, is_clear, plan_landing
from .next_steps import AFTER_TOUCH, Phase, phases_after, plan_after_touch, points_after
from .timing import ACCELERATION, TimedPath, time_path
from .trajectory_checks import check_joints, check_points, check_rates, check_velocities

SCHEMA = "clench.trajectory/1"
#: No smaller fraction of the velocity limits makes sense, or can be computed with [-].
SLOWEST = 1e-6
#: Way-points per stage; speed rises from zero and falls to zero within each.
STAGE_STEPS = 8
#: Way-points of a path on which all joints move at once, besides those at which one stops.
AT_ONCE_STEPS = 32
#: Where the way from a pregrasp is not clear, one nearer to the touch is tried: shares of the clearance [-].
_CLEARANCES = (1.0, 0.4, 0.1)
#: Times [s], shape (N,), and postures [rad], shape (N, J).
_Part = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Hold way-points of all joints; between two of them joints move at constant speed.

    Args:
        hand, object: names.
        joints: names of all joints, in model order.
        times: of the way-points [s], shape (N,), rising from 0.
        positions: joint angles [rad], shape (N, J); the first is the open hand, the last the touch.
        velocity_limits: of the joints [rad/s], shape (J,).
        pregrasp: number of the way-point from which all contacts are reached at once; None when there is none.
        after: where the solution has next steps: what comes after the touch, the squeeze and the steps.
        speed: fraction of the velocity limits that was used [-]. acceleration: largest of every joint [rad/s²].
    """

    hand: str
    object: str
    joints: tuple[str, ...]
    times: FloatArray
    positions: FloatArray
    velocity_limits: FloatArray
    pregrasp: int | None = None
    after: tuple[Phase, ...] = ()
    speed: float = 1.0
    acceleration: float = ACCELERATION

    @property
    def duration(self) -> float:
        """Time from the open hand to the touch [s]."""
        return float(self.times[-1])

    @property
    def pace(self) -> tuple[FloatArray, FloatArray]:
        """Largest velocity [rad/s] and acceleration [rad/s²] that was planned with, of every joint, shape (J,) each."""
        return _pace(self.velocity_limits, self.speed, self.acceleration)

    def at(self, time: float) -> FloatArray:
        """Return the angles at a time [s], shape (J,); before the start the first, after the end the last."""
        return np.array([np.interp(time, self.times, column) for column in self.positions.T])

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, schema `clench.trajectory/1`."""
        last = len(self.times) - 1
        phases = ["open", *["closing"] * (last - 1), "touch"] if last else ["touch"]
        pregrasp = None
        if self.pregrasp is not None:
            pregrasp = dict(zip(self.joints, self.positions[self.pregrasp].tolist(), strict=True))
            phases[self.pregrasp : last] = ["pregrasp", *["landing"] * (last - 1 - self.pregrasp)]
        return {
            "schema": SCHEMA,
            "hand": self.hand,
            "object": self.object,
            "joints": list(self.joints),
            "velocity_limits": self.velocity_limits.tolist(),
            "speed": self.speed,
            "acceleration": self.acceleration,
            "pregrasp": pregrasp,
            "points": [
                *(
                    {"time": float(t), "phase": phase, "positions": q.tolist()}
                    for t, phase, q in zip(self.times, phases, self.positions, strict=True)
                ),
                *points_after(self.after, self.duration),
            ],
        }

    def save(self, path: str | Path) -> None:
        """Write the JSON form, atomically.

        Raises:
            ClenchError: a number is not finite. FileError: the file cannot be written.
        """
        write_json(path, self.to_dict(), "trajectory")

    @classmethod
    def load(cls, path: str | Path) -> Trajectory:
        """Read a file written by `save`.

        Raises:
            FileError: missing, not JSON, or not a trajectory; the message names the key.
        """
        return _read(read_json(path), str(path))


def plan_trajectory(
    solution: GraspSolution,
    hand: Hand,
    *,
    obj: GraspObject | None = None,
    speed: float = 1.0,
    acceleration: float = ACCELERATION,
    clearance: float = CLEARANCE,
) -> Trajectory:
    """Time a path to the touch, so that all fingers touch at the same moment, slowly; then to the next steps.

    With the object, the hand goes to a pregrasp off it, and from there straight to all contacts at once, at 10 mm/s.
    The way to the pregrasp is a straight line in joint space where the exact depth shows that to be clear, else every
    finger goes joint by joint. Without the object, or where none of this is clear, every finger goes through its
    closing path as it was computed; then a finger's later joints close after its first ones touched. The slowest finger
    sets the duration, the others are slowed down to it. Posture joints that differ between the open hand and the
    solution move first. Where all joints closed at once, they do so here, each until it was held.

    Args:
        solution: the solution.
        hand: the hand it was computed for.
        obj: the object it was computed for; the solution says where it is.
        speed: fraction of the velocity limits to use, above 0 and up to 1.
        acceleration: largest of every joint [rad/s²].
        clearance: of the pregrasp [m]; less where the way from there is not clear.

    Raises:
        CommandError: the solution is of another hand, lacks a joint, has more than one round, or a next step outside a
            joint's limits; or `speed`, `acceleration` or `clearance` is out of range.
        UnknownNameError: a next step of a joint that the hand does not have.
    """
    if solution.rounds != 1:
        raise CommandError(
            f"rounds: expected a solution of 1 round, got {solution.rounds} (0 is until rest): of joints that were "
            "gone through more than once no path is kept."
        )
    if not SLOWEST <= speed <= 1.0:
        raise CommandError(f"speed: expected a fraction above 0 and up to 1, at least {SLOWEST:g}, got {speed}.")
    for key, value in (("acceleration", acceleration), ("clearance", clearance)):
        if not (np.isfinite(value) and value > 0.0):
            raise CommandError(f"{key}: expected a finite number above 0, got {value!r}.")
    limits = np.array([j.velocity or DEFAULT_SPEED for j in hand.joints])
    pace = _pace(limits, speed, acceleration)
    after = plan_after_touch(solution, hand, pace)
    times, positions, pregrasp = _to_touch(solution, hand, obj, pace, clearance)
    names = solution.hand, solution.object, hand.joint_names
    return Trajectory(*names, times, positions, limits, pregrasp, after, float(speed), float(acceleration))


def _pace(limits: FloatArray, speed: float, acceleration: float) -> tuple[FloatArray, FloatArray]:
    return limits * speed, np.full(len(limits), float(acceleration))


def _to_touch(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject | None,
    pace: tuple[FloatArray, FloatArray],
    clearance: float,
) -> tuple[FloatArray, FloatArray, int | None]:
    """Return times and postures from the open hand to the touch, and the number of the pregrasp."""
    end = posture(solution.joint_angles, hand, "joint_angles")
    for share in _CLEARANCES if obj is not None else ():
        assert obj is not None
        found = _landed(solution, hand, obj, pace, share * clearance)
        if found is not None:
            (before, way), (later, path) = found
            pregrasp = len(before) - 1
            times = np.concatenate([before[:-1], before[-1] + later])
            # Where nothing touches, there is nothing to stand off.
            return times, np.vstack([way[:-1], path]), pregrasp if pregrasp < len(times) - 1 else None
    return *_way(solution, hand, end, pace, straight=False), None


def _landed(
    solution: GraspSolution, hand: Hand, obj: GraspObject, pace: tuple[FloatArray, FloatArray], clearance: float
) -> tuple[_Part, _Part] | None:
    """Return the way to a pregrasp and the straight line from there to all contacts at once; None when not clear."""
    end = posture(solution.joint_angles, hand, "joint_angles")
    landing = plan_landing(solution, hand, clearance)
    if landing is None:
        return None
    source = CollisionSource(solution.collision_source)
    if not is_clear(solution, hand, obj, [landing, end], source):
        return None
    slow = np.minimum(pace[0], np.abs(end - landing) * (LANDING_SPEED / clearance))
    last = _joined([time_path([np.array([landing, end])], slow, pace[1])], end, [range(len(end))])
    for straight in (True, False):
        way = _way(solution, hand, landing, pace, straight=straight)
        if is_clear(solution, hand, obj, list(way[1]), source):
            return way, last
    return None


def _way(
    solution: GraspSolution, hand: Hand, end: FloatArray, pace: tuple[FloatArray, FloatArray], *, straight: bool
) -> _Part:
    """Return times and postures from the open hand to a posture: in one line, or as the fingers closed."""
    start = posture(solution.open_angles, hand, "open_angles")
    turned, opening = _preparation(hand, start, end)
    if straight:
        stages = [[np.array([turned, end])]] * len(hand.fingers)
    elif _closed_at_once(solution):
        stages = [_path_at_once(solution, hand, turned, end)] * len(hand.fingers)
    else:
        stages = [list(_stages(hand, f.joints, turned, end)) for f in hand.fingers]
    before = time_path(opening, *pace)
    times, path = _joined([before], turned, [range(len(end))])
    grid, positions = _joined([time_path(found, *pace) for found in stages], end, [f.joints for f in hand.fingers])
    return np.concatenate([times[:-1], times[-1] + grid]), np.vstack([path[:-1], positions])


def _joined(paths: list[TimedPath], end: FloatArray, joints: Sequence[Sequence[int]]) -> _Part:
    """Return times and postures of paths that are gone through at the same time, each by some of the joints."""
    duration = max((path.duration for path in paths), default=0.0)
    grid = distinct(np.concatenate([np.zeros(1), *(path.samples(duration) for path in paths)]))
    positions = np.tile(paths[0].corners[0] if paths else end, (len(grid), 1))
    for own, path in zip(joints, paths, strict=True):
        moved = [j for j in own if np.ptp(path.corners[:, j]) > 0.0]
        if moved:
            positions[:, moved] = np.array([path.stretched_at(t, duration) for t in grid])[:, moved]
    positions[-1] = end
    return grid, positions


def _preparation(hand: Hand, start: FloatArray, end: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Return the open posture after everything but the closing joints has moved, and the path there."""
    in_fingers = {j for finger in hand.fingers for j in finger.joints}
    first = [
        j
        for j, joint in enumerate(hand.joints)
        if abs(end[j] - start[j]) > STILL and (joint.role is not JointRole.CLOSING or j not in in_fingers)
    ]
    turned = start.copy()
    turned[first] = end[first]
    return turned, [_eased(start, turned)] if first else [start[None]]


def _closed_at_once(solution: GraspSolution) -> bool:
    orders = [c.order for name in solution.fingers for c in _chosen(solution, name)]
    return any(order != ClosingOrder.PROXIMAL_FIRST for order in orders)


def _path_at_once(solution: GraspSolution, hand: Hand, start: FloatArray, end: FloatArray) -> list[FloatArray]:
    """Return the path on which all joints move, each at its speed and until its end, as stages."""
    speed = np.array([solution.speeds.get(name, 1.0) for name in hand.joint_names])
    path = closing_path(hand, range(len(start)), start, end, speed, AT_ONCE_STEPS)
    return [path, _eased(path[-1], end)] if np.abs(end - path[-1]).max(initial=0.0) > STILL else [path]


def _stages(hand: Hand, joints: tuple[int, ...], start: FloatArray, end: FloatArray) -> Iterator[FloatArray]:
    """Yield the stages of a finger: way-points of all joints, shape (n, J), of which only the finger's move."""
    q = start.copy()
    yield q[None].copy()
    followers = {c.follower for c in hand.couplings}
    for leader in joints:
        if leader in followers:
            continue
        group = [leader, *(j for j in _followers(hand, leader) if j in joints)]
        path = closing_path(hand, group, q, end, np.ones(len(q)), STAGE_STEPS)
        yield path
        q = path[-1].copy()
    target = q.copy()
    target[list(joints)] = end[list(joints)]
    yield _eased(q, target)


def _followers(hand: Hand, leader: int) -> list[int]:
    found: list[int] = []
    for coupling in hand.couplings:
        if coupling.leader == leader or coupling.leader in found:
            found.append(coupling.follower)
    return found


def _chosen(solution: GraspSolution, finger: str) -> tuple[Any, ...]:
    result = solution.fingers.get(finger)
    best = None if result is None else result.best
    return () if best is None else (best,)


def _eased(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return way-points, evenly spaced in time, that leave and arrive slowly, shape (n, J)."""
    s = np.linspace(0.0, 1.0, STAGE_STEPS + 1)[:, None]
    path: FloatArray = start + (s * s * (3.0 - 2.0 * s)) * (end - start)
    path[-1] = end
    return path


class _PointForm(msgspec.Struct):
    time: float
    phase: str
    positions: list[float]
    step: int | None = None


class _Form(msgspec.Struct):
    hand: str
    object: str
    joints: list[str]
    velocity_limits: list[float]
    points: list[_PointForm]
    speed: float = 1.0
    acceleration: float = ACCELERATION


def _read(data: Any, source: str) -> Trajectory:
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise FileError(source, f"schema: expected '{SCHEMA}'.")
    bad = non_finite_path(data)
    if bad is not None:
        raise FileError(source, f"{bad}: expected a finite number.")
    try:
        form = msgspec.convert(data, _Form)
    except msgspec.ValidationError as error:
        raise FileError(source, f"{str(error).replace('`', chr(39))}.") from None
    check_rates(source, form.speed, form.acceleration, form.velocity_limits)
    check_points(source, [(p.time, p.positions) for p in form.points])
    check_joints(source, form.joints)
    count = len(form.joints)
    if not form.points:
        raise FileError(source, "points: expected at least one.")
    if len(form.velocity_limits) != count:
        raise FileError(source, f"velocity_limits: expected {count} numbers, got {len(form.velocity_limits)}.")
    for i, point in enumerate(form.points):
        if len(point.positions) != count:
            raise FileError(source, f"points[{i}].positions: expected {count} angles, got {len(point.positions)}.")
        if i and point.time <= form.points[i - 1].time:
            raise FileError(source, f"points[{i}].time: expected more than {form.points[i - 1].time} s.")
    times = np.array([p.time for p in form.points])
    positions = np.array([p.positions for p in form.points]).reshape(len(form.points), count)
    check_velocities(source, form.joints, times, positions, np.array(form.velocity_limits))
    phases = [(p.phase, p.step) for p in form.points]
    last = next((i for i, (phase, _) in enumerate(phases) if phase in AFTER_TOUCH), len(phases)) - 1
    if last < 0:
        raise FileError(source, f"points[0].phase: expected one up to the touch, got '{phases[0][0]}'.")
    return Trajectory(
        hand=form.hand,
        object=form.object,
        joints=tuple(form.joints),
        times=times[: last + 1],
        positions=positions[: last + 1],
        velocity_limits=np.array(form.velocity_limits),
        pregrasp=next((i for i, (phase, _) in enumerate(phases) if phase == "pregrasp"), None),
        after=phases_after(phases[last:], times[last:], positions[last:]),
        speed=form.speed,
        acceleration=form.acceleration,
    )
