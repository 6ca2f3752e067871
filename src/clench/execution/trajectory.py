"""Timed joint paths from the open hand to the touch; all fingers arrive together (docs/method.md section 7)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, FileError
from clench.core.files.form_errors import form_sentence
from clench.core.files.json_files import non_finite_path, read_json, write_json
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import described
from clench.models.hand.hand import DEFAULT_SPEED, Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

from .landing import CLEARANCE
from .next_steps import AFTER_TOUCH, Phase, phases_after, plan_after_touch, points_after
from .step_check import refuse_after, refuse_start
from .timing import ACCELERATION
from .trajectory_checks import check_joints, check_points, check_rates, check_velocities
from .way_to_touch import WayFinder, in_turn, refuse_way

SCHEMA = "clench.trajectory/1"
#: No smaller fraction of the velocity limits makes sense, or can be computed with [-].
SLOWEST = 1e-6


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A timed motion of all joints from the open hand to the touch.

    Between two way-points the joints move at constant speed.

    Args:
        hand, object: names.
        joints: names of all joints, in model order.
        times: of the way-points [s], shape (N,), rising from 0.
        positions: joint angles [rad], shape (N, J); the first is the open hand, the last the touch.
        velocity_limits: of the joints [rad/s], shape (J,).
        pregrasp: index of the way-point from which all contacts are reached simultaneously, or None.
        after: for a solution with next steps, the motion after the touch: the squeeze and the steps.
        speed: fraction of the velocity limits that was used [-]. acceleration: largest of every joint [rad/s²].
        turns: names of the fingers that move together on the way to the pregrasp, or to the touch without one. Fingers
            of a later turn wait for the earlier turns.
        open_bodies: names of the object's bodies that are surfaces without an inside: a link that passes through one of
            them does not overlap it.
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
    turns: tuple[tuple[str, ...], ...] = ()
    open_bodies: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return described(
            self,
            hand=self.hand,
            object=self.object,
            joints=len(self.joints),
            points=len(self.times),
            duration=self.duration,
            pregrasp=self.pregrasp,
            next_steps=len(self.after),
        )

    @property
    def touches_at_once(self) -> bool:
        """Whether all fingers touch at the same moment: from a pregrasp, or because only one finger moves."""
        return self.pregrasp is not None or sum(map(len, self.turns)) <= 1

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about fingers that wait, and about fingers that do not touch at the same moment."""
        found = []
        if len(self.turns) > 1:
            found.append(f"Fingers wait for each other, so that they do not meet: {in_turn(self.turns)}.")
        if not self.touches_at_once:
            found.append("The path has no pregrasp: fingers may touch one after another, and push the object.")
        if self.open_bodies:
            names = ", ".join(f"'{name}'" for name in self.open_bodies)
            found.append(f"Not proven: no link passes through {names}, which is a surface without an inside.")
        return tuple(found)

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
            "turns": [list(turn) for turn in self.turns],
            "open_bodies": list(self.open_bodies),
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
            FileError: the file is missing, is not JSON, or is no trajectory; the message names the key.
        """
        return _read(read_json(path, "a trajectory, as `clench solve --out` writes it"), str(path))


def plan_trajectory(
    solution: GraspSolution,
    hand: Hand,
    *,
    obj: GraspObject | None = None,
    speed: float = 1.0,
    acceleration: float = ACCELERATION,
    clearance: float = CLEARANCE,
    force: bool = False,
) -> Trajectory:
    """Plan and time a free path from the open hand to the touch, and on to the next steps (docs/motions.md).

    The path is proven free. Over all of it, no link of the hand overlaps another link, the object or an obstacle by
    more than 10 µm, in the geometry of the solution. The hand report lists the pairs of links that may overlap.

    With the object, the hand first moves to a pregrasp off the object, on a straight line in joint space. From there,
    all fingers touch at the same moment, at 10 mm/s. A finger that would meet something on the line goes along its
    closing path, joint by joint. If two fingers would meet, one waits for the other. Without the object, or without a
    free pregrasp, every finger goes along its closing path. Fingers may then touch one after another.

    The slowest of the fingers that move together sets the duration. Posture joints that differ between the open hand
    and the solution move first. Without the object, clench checks only links against each other.

    Args:
        solution: the solution.
        hand: the hand it was computed for.
        obj: the object that was solved for; the solution gives its pose.
        speed: fraction of the velocity limits to use, above 0 and up to 1.
        acceleration: largest of every joint [rad/s²].
        clearance: distance of the pregrasp from the object [m]; less if the way from there is not free.
        force: return a path even if none is free.

    Raises:
        MotionError: no free path was found; the sentence names the links that would overlap, and when.
        CommandError: the solution is of another hand, lacks a joint, has more than one round, or has a next step
            outside a joint's limits; or `speed`, `acceleration` or `clearance` is out of range.
        UnknownNameError: a next step of a joint that the hand does not have.
    """
    check_type(solution, GraspSolution, "solution")
    check_type(hand, Hand, "hand")
    if obj is not None:
        check_type(obj, GraspObject, "obj")
    _check_rounds(solution)
    if not SLOWEST <= speed <= 1.0:
        raise CommandError(f"speed: expected a fraction above 0 and up to 1, at least {SLOWEST:g}, got {speed}.")
    for key, value in (("acceleration", acceleration), ("clearance", clearance)):
        if not (np.isfinite(value) and value > 0.0):
            raise CommandError(f"{key}: expected a finite number above 0, got {value!r}.")
    limits = np.array([j.velocity or DEFAULT_SPEED for j in hand.joints])
    pace = _pace(limits, speed, acceleration)
    after = plan_after_touch(solution, hand, pace)
    finder = WayFinder(solution, hand, obj, pace)
    if not force and finder.around is not None:
        refuse_start(hand, finder.start, finder.source, finder.around)
    way = finder.find(clearance)
    if not force:
        refuse_way(way, hand)
        refuse_after(solution, hand, after)
    return Trajectory(
        hand=solution.hand,
        object=solution.object,
        joints=hand.joint_names,
        times=way.times,
        positions=way.positions,
        velocity_limits=limits,
        pregrasp=way.pregrasp,
        after=after,
        speed=float(speed),
        acceleration=float(acceleration),
        turns=way.turns,
        open_bodies=() if obj is None else tuple(body.name for body in obj.bodies if not body.closed),
    )


def plan_closing(solution: GraspSolution, hand: Hand) -> tuple[FloatArray, FloatArray]:
    """Return the path on which all fingers close at the same time, each along its closing path; it may not be free.

    Returns:
        times [s], (N,), and postures [rad], (N, J).

    Raises:
        CommandError: the solution has more than one round, is of another hand, or lacks a joint.
    """
    _check_rounds(solution)
    limits = np.array([j.velocity or DEFAULT_SPEED for j in hand.joints])
    return WayFinder(solution, hand, None, _pace(limits, 1.0, ACCELERATION)).closing()


def _check_rounds(solution: GraspSolution) -> None:
    if solution.rounds != 1:
        raise CommandError(
            f"rounds: expected a solution of 1 round, got {solution.rounds} (0 is until rest): of joints that were "
            "gone through more than once no path is kept."
        )


def _pace(limits: FloatArray, speed: float, acceleration: float) -> tuple[FloatArray, FloatArray]:
    return limits * speed, np.full(len(limits), float(acceleration))


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
    turns: list[list[str]] = []
    open_bodies: list[str] = []


def _read(data: Any, source: str) -> Trajectory:
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise FileError(source, f"schema: expected '{SCHEMA}'.")
    bad = non_finite_path(data)
    if bad is not None:
        raise FileError(source, f"{bad}: expected a finite number.")
    try:
        form = msgspec.convert(data, _Form)
    except msgspec.ValidationError as error:
        raise FileError(source, form_sentence(error, _Form)) from None
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
        turns=tuple(tuple(turn) for turn in form.turns),
        open_bodies=tuple(form.open_bodies),
    )
