"""How the joint angles change when the object is not quite where it was thought to be (METHOD.md section 5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.base.errors import ClenchError
from clench.base.pose import FloatArray, invert
from clench.base.tolerances import TOUCH_FRACTION
from clench.grasp.exact import HandBodies, hand_bodies, swept_deviation
from clench.grasp.scene import PackedObject, hash_hand, pack_object
from clench.grasp.stages import Stage, StageTouch, carried_links, closing_stages, stage_touches
from clench.models.command_file import LIMIT_TOLERANCE
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource

from .solution import FingerStatus, GraspSolution

#: A touch whose normal is this close to perpendicular to the motion grazes: its cosine [-].
GRAZING = 1e-3
#: Touches that change a joint equally to this fraction say the same [-].
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Hold the change of every joint angle per change of the object's pose; the hand stays where it is.

    An entry is infinite where no such number exists; `reasons` says why. Joints that stopped at a limit, and joints
    that do not close, have 0.

    Args:
        joints: names of all joints. origin: of the object in the world [m], shape (3,).
        translation: per shift of the object along the world's axes [rad/m], shape (J, 3).
        rotation: per turn of the object about axes through its origin that are parallel to the world's [rad/rad],
            shape (J, 3).
        stopped_by: what stopped a joint that moved on its own: ``"limit"``, the object's or a link's name.
        reasons: a sentence for every joint that has an infinite entry.
    """

    joints: tuple[str, ...]
    origin: FloatArray
    translation: FloatArray
    rotation: FloatArray
    stopped_by: Mapping[str, str]
    reasons: Mapping[str, str]

    @property
    def matrix(self) -> FloatArray:
        """Translation and rotation side by side, shape (J, 6)."""
        return np.hstack([self.translation, self.rotation])

    def change(self, translation: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Return the change of every joint to first order [rad], shape (J,); infinite where it is not known.

        Args:
            translation: of the object in the world [m], shape (3,). rotation: rotation vector about its origin [rad],
                shape (3,).
        """
        return _product(self.matrix, np.hstack([translation, rotation]))

    def worst_change(self, translation: float, rotation: float) -> FloatArray:
        """Return the largest change of every joint to first order [rad], shape (J,).

        Args:
            translation: the object is off by up to this along every axis [m]. rotation: and about every axis [rad].
        """
        return _product(np.abs(self.matrix), np.repeat([translation, rotation], 3))

    def to_dict(self) -> dict[str, Any]:
        """Return the form that is written as JSON; null stands for infinite."""
        return {
            "origin": self.origin.tolist(),
            "translation": {name: _finite(row) for name, row in zip(self.joints, self.translation, strict=True)},
            "rotation": {name: _finite(row) for name, row in zip(self.joints, self.rotation, strict=True)},
            "stopped_by": dict(self.stopped_by),
            "reasons": dict(self.reasons),
        }


def sensitivity(solution: GraspSolution, hand: Hand, obj: GraspObject) -> Sensitivity:
    """Return how the joint angles of a solution change with the object's pose (METHOD.md section 5).

    A joint that a touch stopped stops where the gap is used up, and a gap changes by n·(velocity of the link's point -
    velocity of the object's point), whatever features touch. Joints before it, and fingers that closed earlier, are
    where their own touches let them be. Obstacles move with the object.

    Args:
        solution: closed proximal first, once. hand, obj: those that it was computed for.

    Raises:
        ClenchError: another hand or object.
    """
    source = CollisionSource(solution.collision_source)
    packed = pack_object(obj)
    _check_same(solution, hand, packed, source)
    names = hand.joint_names
    for key, given in (("open_angles", solution.open_angles), ("joint_angles", solution.joint_angles)):
        for name in names:
            if name not in given:
                raise ClenchError(f"{key}: the solution has no angle of joint '{name}'.")
    opened = np.array([solution.open_angles[name] for name in names])
    final = np.array([solution.joint_angles[name] for name in names])
    closed = [hand.finger(name) for name, f in solution.fingers.items() if f.status is not FingerStatus.NO_MOTION]
    moved = [finger for finger in closed if solution.fingers[finger.name].status is not FingerStatus.BLOCKED]
    stages = closing_stages(hand, moved, opened, final)
    rows = _Rows(solution, hand, obj, packed, source, stages)
    for number, stage in enumerate(stages):
        rows.add(number, stage, opened[stage.leader])
    change = np.where(rows.known, rows.change, np.inf)
    origin = solution.object_pose.position
    return Sensitivity(names, origin, change[:, :3], change[:, 3:], rows.stopped_by, rows.reasons)


class _Rows:
    """Fill in the change of the joints stage by stage: a stage depends on those before it alone."""

    def __init__(
        self,
        solution: GraspSolution,
        hand: Hand,
        obj: GraspObject,
        packed: PackedObject,
        source: CollisionSource,
        stages: list[Stage],
    ) -> None:
        joints = len(hand.joints)
        self.hand, self.obj, self.solution = hand, obj, solution
        self.change = np.zeros((joints, 6))
        self.known = np.ones((joints, 6), dtype=np.bool_)
        self.stopped_by: dict[str, str] = {}
        self.reasons: dict[str, str] = {}
        moved = carried_links(hand)
        self.carried = np.vstack([moved, np.zeros(joints)])  # the last row is the object's
        self.poses = poses_at(hand, np.array([s.posture for s in stages]).reshape(-1, joints))
        self.mover = np.zeros(joints, dtype=np.int64)
        for i, link in enumerate(hand.links):
            if link.joint >= 0:
                self.mover[link.joint] = i
        self.axes = np.array([j.axis for j in hand.joints]).reshape(-1, 3)
        self.anchors = np.array([j.anchor for j in hand.joints]).reshape(-1, 3)
        self.touches: dict[int, list[StageTouch]] = {}
        bodies = hand_bodies(hand, source)
        T_palm_object = invert(solution.hand_pose.matrix) @ solution.object_pose.matrix
        moves = np.array([moved @ (s.rates != 0.0) & ~_at_limit(hand, s) for s in stages], dtype=np.bool_)
        self.tie = _tolerance(bodies, self.poses)
        deviation = swept_deviation(hand, source, packed)
        for touch in stage_touches(
            bodies, packed, T_palm_object, self.poses, moves.reshape(-1, len(hand.links)), self.tie, deviation
        ):
            self.touches.setdefault(touch.stage, []).append(touch)

    def add(self, number: int, stage: Stage, opened: float) -> None:
        """Find what stopped a stage, and fill in its joints."""
        joint = self.hand.joints[stage.leader]
        if _at_limit(self.hand, stage):
            self.stopped_by[joint.name] = "limit"
            return
        moved = abs(stage.posture[stage.leader] - opened) > LIMIT_TOLERANCE
        row, known, reason = self._row(number, stage, bool(moved))
        for j in np.flatnonzero(stage.rates):
            self.change[j], self.known[j] = stage.rates[j] * row, known
            if reason:
                self.reasons[self.hand.joints[j].name] = f"{joint.name}: {reason}."

    def _row(self, number: int, stage: Stage, moved: bool) -> tuple[FloatArray, NDArray[np.bool_], str]:
        """Return the change of a stage's leader, shape (6,), where it is known, and why not elsewhere."""
        joint = self.hand.joints[stage.leader]
        at = self.poses[number, self.mover]
        axes = np.einsum("jab,jb->ja", at[:, :3, :3], self.axes)
        anchors = np.einsum("jab,jb->ja", at[:, :3, :3], self.anchors) + at[:, :3, 3]
        nothing = np.zeros(6, np.bool_)
        rows: list[FloatArray] = []
        unknown, held, grazing, bound = nothing.copy(), nothing.copy(), False, np.inf
        for touch in sorted(self.touches.get(number, ()), key=lambda t: t.gap):
            if touch.gap > bound:
                break
            speeds = _cross(axes, touch.position - anchors) * self._moves(touch)[:, None]
            gaps = speeds @ touch.normal
            rate, speed = float(gaps @ stage.rates), float(np.linalg.norm(stage.rates @ speeds))
            if rate * joint.direction >= -GRAZING * speed:
                grazing = grazing or (speed > 0.0 and abs(rate) < GRAZING * speed)
                continue
            if not rows:
                bound = touch.gap + self.tie
                self.stopped_by[joint.name] = self._met(touch)
            shift = self._shift(touch)
            rows.append((shift - gaps @ self.change) / rate)
            # Where the joints before it keep a touch as it is, a joint that it holds from the start stays, too.
            held |= np.abs(rows[-1]) > _SAME * np.abs(shift / rate).max()
            unknown |= (~self.known & (np.abs(gaps) > _SAME * speed)[:, None]).any(axis=0)
        if not rows:
            return np.zeros(6), nothing, "it grazes what stops it" if grazing else "no touch is found where it stopped"
        spread = np.ptp(rows, axis=0) > _SAME * np.abs(rows).max()
        text = "it touches at several places at once" if spread.any() else ""
        if held.any() and not moved:
            spread, text = spread | held, "it is stopped before it moves"
        if unknown.any():
            text = "the change of a joint before it is not known"
        return rows[0], ~(spread | unknown), text

    def _moves(self, touch: StageTouch) -> FloatArray:
        """Return 1 for joints that move the link, less 1 for those that move what it touches, shape (J,)."""
        moves: FloatArray = self.carried[touch.link] - self.carried[touch.met]
        return moves

    def _shift(self, touch: StageTouch) -> FloatArray:
        """Return how fast the touched point moves along the normal with the object's pose, shape (6,)."""
        if touch.met < len(self.hand.links):
            return np.zeros(6)
        T = self.solution.hand_pose
        normal = T.rotation @ touch.normal
        return np.concatenate([normal, _cross(T.apply(touch.position) - self.solution.object_pose.position, normal)])

    def _met(self, touch: StageTouch) -> str:
        return self.hand.links[touch.met].name if touch.met < len(self.hand.links) else self.obj.name


def _at_limit(hand: Hand, stage: Stage) -> bool:
    joint = hand.joints[stage.leader]
    limit = joint.upper if joint.direction > 0 else joint.lower
    return abs(float(stage.posture[stage.leader]) - limit) <= LIMIT_TOLERANCE


def _tolerance(bodies: HandBodies, poses: FloatArray) -> float:
    """Return the distance below which links touch [m]."""
    root = bodies.links.root
    balls = bodies.links.node[root[root >= 0]]
    reach = np.linalg.norm(balls[:, :3], axis=1) + balls[:, 3]
    away = np.linalg.norm(poses[:, root >= 0][..., :3, 3], axis=2)
    return TOUCH_FRACTION * float((away + reach).max(initial=0.0))


def _check_same(solution: GraspSolution, hand: Hand, packed: PackedObject, source: CollisionSource) -> None:
    """Refuse another hand or object than those that were solved for.

    Raises:
        ClenchError: with what differs.
    """
    wanted, _, body = solution.geometry_hash.partition("+")
    if hash_hand(hand, source) != wanted:
        raise ClenchError(f"hand '{hand.name}' is not the one that the solution of '{solution.hand}' was computed for.")
    if packed.geometry_hash != body:
        raise ClenchError(f"the object is not the '{solution.object}' that the solution was computed for.")


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of vectors, shape (..., 3); NumPy's own takes ten times as long for a few."""
    x: FloatArray = a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]
    return x


def _product(matrix: FloatArray, change: FloatArray) -> FloatArray:
    """Return the product of a matrix with infinite entries; these do not count where the change is 0."""
    counts = np.where(change == 0.0, 0.0, matrix)
    sums: FloatArray = np.where(np.isinf(counts), 0.0, counts) @ change
    return np.where(np.isinf(counts).any(axis=1), np.inf, sums)


def _finite(row: FloatArray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in row]
