"""Compute how the joint angles change with a small error of the object's pose (docs/method.md section 5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clench.closing.collision.packed_object import PackedObject, hash_hand, pack_object
from clench.closing.finger_plan import closing_joints
from clench.core.argument_types import check_type
from clench.core.exceptions import ClenchError
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.models.command import ClosingOrder
from clench.models.hand.hand import Finger, Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.object_loading import collision_source_named
from clench.models.shapes import CollisionSource
from clench.scoring.closing_stages import closing_stages, stages_at_once
from clench.scoring.pose_change import PoseChange
from clench.solver.solution import FingerStatus, GraspSolution


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The change of every joint angle per change of the object's pose; the hand keeps its pose.

    An entry is infinite where no such number exists; `reasons` says why. Joints that stopped at a limit, and joints
    that do not close, have 0.

    Args:
        joints: names of all joints. origin: of the object in the world [m], shape (3,).
        translation: per shift of the object along the world's axes [rad/m], shape (J, 3).
        rotation: per turn of the object about axes through its origin that are parallel to the world's [rad/rad],
            shape (J, 3).
        stopped_by: what stopped each independently moving joint: ``"limit"``, the object's name or a link's name.
        reasons: a sentence for every joint that has an infinite entry.
    """

    joints: tuple[str, ...]
    origin: FloatArray
    translation: FloatArray
    rotation: FloatArray
    stopped_by: Mapping[str, str]
    reasons: Mapping[str, str]

    __repr__ = short_repr

    @property
    def matrix(self) -> FloatArray:
        """Translation and rotation side by side, shape (J, 6)."""
        return np.hstack([self.translation, self.rotation])

    def change(self, translation: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Return the change of every joint to first order [rad], shape (J,); infinite if unknown.

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
    """Return how the joint angles of a solution change with the object's pose (docs/method.md section 5).

    A contact stops a joint when the gap is used up. For any pair of features, the gap changes by n·(velocity of the
    link's point - velocity of the object's point). Joints before this joint, and fingers that closed earlier, follow
    their own contacts. Obstacles move with the object.

    Args:
        solution: closed in one round. hand, obj: the hand and object that were solved for.

    Raises:
        ClenchError: another hand or object.
    """
    check_type(solution, GraspSolution, "solution")
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    source = collision_source_named(solution.collision_source)
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
    origin = solution.object_pose.position
    text = _not_covered(solution, hand, moved)
    if text:
        unknown = {names[j]: text for finger in moved for j in closing_joints(hand, finger)}
        columns = np.where(np.isin(names, list(unknown))[:, None], np.inf, np.zeros((len(names), 3)))
        return Sensitivity(names, origin, columns, columns.copy(), {}, unknown)
    orders = {f.best.order for f in solution.fingers.values() if f.best is not None}
    if orders <= {ClosingOrder.PROXIMAL_FIRST}:
        stages = closing_stages(hand, moved, opened, final)
    else:
        stages = stages_at_once(hand, moved, opened, final, solution.speeds)
    rows = PoseChange(hand, packed, source, solution.hand_pose, solution.object_pose, stages, obj.name)
    for number, stage in enumerate(stages):
        rows.add(number, stage, opened[stage.leader])
    change = np.where(rows.known, rows.change, np.inf)
    return Sensitivity(names, origin, change[:, :3], change[:, 3:], rows.stopped_by, rows.reasons)


def _not_covered(solution: GraspSolution, hand: Hand, moved: Sequence[Finger]) -> str:
    """Return why the contacts that stopped the joints cannot be recomputed, or nothing."""
    for finger in moved:
        result = solution.fingers[finger.name]
        if result.best is None:
            return f"the solution has no candidate of {finger.name}; in which order it closed is not known"
        if solution.rounds != 1:
            return "its joints were gone through more than once; changes are known for one round alone"
        if any(c.breakaway and c.follower in finger.joints for c in hand.couplings):
            return f"joints of {finger.name} break away; changes are known for joints that stop as one"
    return ""


def _check_same(solution: GraspSolution, hand: Hand, packed: PackedObject, source: CollisionSource) -> None:
    """Refuse a hand or an object that differs from the solved one.

    Raises:
        ClenchError: names the difference.
    """
    wanted, _, body = solution.geometry_hash.partition("+")
    if hash_hand(hand, source) != wanted:
        raise ClenchError(f"hand '{hand.name}' is not the one that the solution of '{solution.hand}' was computed for.")
    if packed.geometry_hash != body:
        raise ClenchError(f"the object is not the '{solution.object}' that the solution was computed for.")


def _product(matrix: FloatArray, change: FloatArray) -> FloatArray:
    """Return the product of a matrix with infinite entries; these do not count where the change is 0."""
    counts = np.where(change == 0.0, 0.0, matrix)
    sums: FloatArray = np.where(np.isinf(counts), 0.0, counts) @ change
    return np.where(np.isinf(counts).any(axis=1), np.inf, sums)


def _finite(row: FloatArray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in row]
