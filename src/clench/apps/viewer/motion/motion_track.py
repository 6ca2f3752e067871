"""A motion to play: posture, palm and object over time, from a planned trajectory or from a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

import clench
from clench.apps.viewer.session.settled_answer import SettledAnswer
from clench.core.exceptions import MotionError
from clench.core.pose import FloatArray, Pose
from clench.execution.simulation.filming import Film
from clench.execution.simulation.mujoco_scene import Scene

#: How long squeeze and lift are shown [s], and how far the object is lifted [m].
SQUEEZE_SECONDS: Final = 0.4
LIFT_SECONDS: Final = 1.2
LIFT: Final = 0.06
#: Time between two recorded states [s].
_EVERY: Final = 0.02
#: Forces below this are not drawn [N].
_FAINT: Final = 0.02


@dataclass(frozen=True, eq=False)
class Frame:
    """Where everything is at a time.

    Args:
        posture: of all joints [rad], shape (J,). hand, object: poses of palm and object. phase: its name.
        points, forces: measured forces on the object [m], [N], shape (C, 3) each.
    """

    posture: FloatArray
    hand: Pose
    object: Pose
    phase: str
    points: FloatArray
    forces: FloatArray


@dataclass(frozen=True, eq=False)
class MotionTrack:
    """A motion over time; N states.

    Args:
        times: [s], rising from 0, shape (N,). postures: [rad], shape (N, J).
        hands, objects: rows [w, x, y, z, X, Y, Z] of palm and object, shape (N, 7).
        phases: when each begins [s], and its name. note: a sentence about the motion.
        measured: points and forces of every state; empty where none were measured.
    """

    times: FloatArray
    postures: FloatArray
    hands: FloatArray
    objects: FloatArray
    phases: tuple[tuple[float, str], ...]
    note: str = ""
    measured: Sequence[tuple[FloatArray, FloatArray]] = ()

    @property
    def duration(self) -> float:
        """Time from its start to its end [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> Frame:
        """Return where everything is at a time [s]."""
        k = int(np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, max(len(self.times) - 2, 0)))
        after = min(k + 1, len(self.times) - 1)
        span = self.times[after] - self.times[k]
        share = float(np.clip((time - self.times[k]) / span, 0.0, 1.0)) if span > 0.0 else 0.0
        posture = (1.0 - share) * self.postures[k] + share * self.postures[after]
        phase = [name for begin, name in self.phases if begin <= time + 1e-9][-1]
        points, forces = self.measured[k] if self.measured else (np.empty((0, 3)), np.empty((0, 3)))
        hand, thing = (_between(rows[k], rows[after], share) for rows in (self.hands, self.objects))
        return Frame(posture, hand, thing, phase, points, forces)


def _between(one: FloatArray, other: FloatArray, share: float) -> Pose:
    near = other if one[:4] @ other[:4] >= 0.0 else np.concatenate([-other[:4], other[4:]])
    row = (1.0 - share) * one + share * near
    return Pose(row[4:], row[:4] / np.linalg.norm(row[:4]))


def planned_track(settled: SettledAnswer) -> MotionTrack:
    """Return the planned motion of an answer: open, touch, squeeze, next steps or lift.

    Raises:
        ClenchError: see `clench.plan_trajectory`; a path that is not free is shown, and noted.
    """
    quick = settled.quick
    hand, obj, state = quick.hand, quick.obj, quick.state
    solution = clench.execution.complete(settled.solution, hand, obj, mass=state.mass, friction=state.friction)
    try:
        way, note = clench.plan_trajectory(solution, hand, obj=obj), ""
    except MotionError as error:
        way, note = clench.plan_trajectory(solution, hand, obj=obj, force=True), f"Not free: {error}"
    parts: list[tuple[str, FloatArray, FloatArray]] = []
    close = 0 if way.pregrasp is None else way.pregrasp
    if close:
        parts.append(("open → pregrasp", way.times[: close + 1], way.positions[: close + 1]))
    parts.append(("→ touch", way.times[close:] - way.times[close], way.positions[close:]))
    parts += [(phase.name, phase.times, phase.positions) for phase in way.after]
    lifts = not way.after and bool(solution.contacts)
    if lifts:
        # The object stops the joints, whatever they are told beyond the touch.
        still = np.repeat(way.positions[-1:], 2, axis=0)
        parts.append(("squeeze", np.array([0.0, SQUEEZE_SECONDS]), still))
        parts.append(("lift", np.array([0.0, LIFT_SECONDS]), still))
    times, postures, phases, begin = [np.zeros(0)], [np.zeros((0, len(hand.joints)))], [], 0.0
    for name, t, q in parts:
        phases.append((begin, name))
        times.append(begin + t)
        postures.append(q)
        begin += float(t[-1])
    t = np.concatenate(times)
    up = np.zeros((len(t), 7))
    if lifts:
        up[:, 6] = LIFT * np.clip((t - (begin - LIFT_SECONDS)) / LIFT_SECONDS, 0.0, 1.0)
    hands, objects = solution.hand_pose.wxyz_xyz + up, solution.object_pose.wxyz_xyz + up
    note = " ".join([note, *way.notes]).strip()
    pressing = t > begin - LIFT_SECONDS - 1e-9 if lifts else np.zeros(len(t), dtype=np.bool_)
    forces = [_planned(settled, height if now else None) for height, now in zip(up[:, 6], pressing, strict=True)]
    return MotionTrack(t, np.concatenate(postures), hands, objects, tuple(phases), note, forces)


def _planned(settled: SettledAnswer, height: float | None) -> tuple[FloatArray, FloatArray]:
    """Return where planned forces act, at a height above the touch [m], and the forces; none without a height."""
    if height is None or settled.squeeze is None:
        return np.empty((0, 3)), np.empty((0, 3))
    points = np.array([contact.position for contact in settled.squeeze.grasp.contacts]).reshape(-1, 3)
    return points + np.array([0.0, 0.0, height]), settled.squeeze.forces


class Recorder(Film):
    """Keep the states of a simulation in place of pictures."""

    def __init__(self, hand_pose: Pose) -> None:
        super().__init__()
        self._hand_pose = hand_pose
        self._rows: list[tuple[float, FloatArray, float, FloatArray, tuple[FloatArray, FloatArray]]] = []
        self._phases: list[tuple[float, str]] = []

    def begin(self, scene: Scene, data: Any) -> None:
        """Start anew."""
        self._scene, self._next = scene, 0.0
        self._start = float(data.time)
        self._rows, self._phases = [], [(0.0, "closing on the free object")]
        self.look(data)

    def look(self, data: Any) -> None:
        """Keep a state when one is due."""
        time = float(data.time) - self._start
        if self._rows and time < self._next - 1e-9:
            return
        scene, body = self._scene, self._scene.object_body
        pose = np.concatenate([data.xquat[body], data.xpos[body]])
        lift = float(data.qpos[scene.lift]) if scene.lift >= 0 else 0.0
        self._rows.append((time, data.qpos[scene.qpos].copy(), lift, pose, _measured(scene, data)))
        self._next = time + _EVERY

    def go_on(self, data: Any) -> None:
        """Go on from a state that may be earlier than the last one."""
        self._next = float(data.time) - self._start

    def still(self, name: str, data: Any) -> None:
        """Note that a phase is over."""
        following = {"touch": "squeezing", "squeeze": "pulling or lifting"}
        if name in following:
            self._phases.append((float(data.time) - self._start, following[name]))

    def track(self, note: str) -> MotionTrack | None:
        """Return the recorded motion, or None if nothing moved."""
        rows = sorted(self._rows, key=lambda row: row[0])
        if len(rows) < 2:
            return None
        hands = np.repeat(self._hand_pose.wxyz_xyz[None], len(rows), axis=0)
        hands[:, 6] += [row[2] for row in rows]
        return MotionTrack(
            np.array([row[0] for row in rows]),
            np.array([row[1] for row in rows]),
            hands,
            np.array([row[3] for row in rows]),
            tuple(self._phases),
            note,
            [row[4] for row in rows],
        )


def _measured(scene: Scene, data: Any) -> tuple[FloatArray, FloatArray]:
    """Return where links press on the object, and the forces on it in the world, shape (C, 3) each."""
    import mujoco

    ours, points, forces = set(scene.object_geoms), [], []
    wrench = np.zeros(6)
    for k, contact in enumerate(data.contact):
        if (contact.geom1 in ours) == (contact.geom2 in ours):
            continue
        mujoco.mj_contactForce(scene.model, data, k, wrench)
        # The force is that on the second geom; the rows of the frame are its axes in the world.
        force = contact.frame.reshape(3, 3).T @ wrench[:3] * (1.0 if contact.geom2 in ours else -1.0)
        if np.linalg.norm(force) > _FAINT:
            points.append(contact.pos.copy())
            forces.append(force)
    return np.array(points).reshape(-1, 3), np.array(forces).reshape(-1, 3)
