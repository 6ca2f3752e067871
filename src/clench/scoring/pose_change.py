"""Compute how a closed hand's joint angles change with the object's pose, by stage (docs/method.md section 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.packed_object import PackedObject
from clench.closing.link_bodies import HandBodies, hand_bodies, swept_deviation
from clench.core.pose import FloatArray, Pose, invert
from clench.core.tolerances import TOUCH_FRACTION
from clench.models.command_file import LIMIT_TOLERANCE
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from .closing_stages import Stage, StageTouch, at_limit, carried_links, stage_touches

#: A touch whose normal is this close to perpendicular to the motion grazes: its cosine [-].
GRAZING = 1e-3
#: Touches that change a joint equally to this fraction say the same [-].
_SAME = 1e-6


class PoseChange:
    """Fill in the change of the joints stage by stage: a stage depends on those before it alone.

    Args:
        hand, packed, source: the hand and the object. T_world_palm, T_world_object: poses.
        stages: see `closing_stages` and `stages_at_once`. object_name: for `stopped_by`.
    """

    def __init__(
        self,
        hand: Hand,
        packed: PackedObject,
        source: CollisionSource,
        T_world_palm: Pose,
        T_world_object: Pose,
        stages: list[Stage],
        object_name: str = "the object",
    ) -> None:
        joints = len(hand.joints)
        self.hand, self.object_name = hand, object_name
        self.T_world_palm, self.origin = T_world_palm, T_world_object.position
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
        bodies = hand_bodies(hand, source, stages[0].posture if stages else None)
        T_palm_object = invert(T_world_palm.matrix) @ T_world_object.matrix
        moves = np.array(
            [moved @ (s.rates != 0.0) & ~at_limit(hand, s.leader, s.posture) for s in stages], dtype=np.bool_
        )
        self.tie = _tolerance(bodies, self.poses)
        deviation = swept_deviation(hand, source, packed)
        for touch in stage_touches(
            bodies, packed, T_palm_object, self.poses, moves.reshape(-1, len(hand.links)), self.tie, deviation
        ):
            self.touches.setdefault(touch.stage, []).append(touch)

    def add(self, number: int, stage: Stage, opened: float) -> None:
        """Find the contact or limit that stopped a stage, and fill in its joints."""
        joint = self.hand.joints[stage.leader]
        if at_limit(self.hand, stage.leader, stage.posture):
            self.stopped_by[joint.name] = "limit"
            return
        moved = abs(stage.posture[stage.leader] - opened) > LIMIT_TOLERANCE
        row, known, reason = self._row(number, stage, bool(moved))
        if joint.name in self.stopped_by:
            self.stopped_by |= {self.hand.joints[j].name: self.stopped_by[joint.name] for j in stage.leaders}
        for j in stage.stops:
            self.change[j], self.known[j] = stage.rates[j] * row, known
            if reason:
                self.reasons[self.hand.joints[j].name] = f"{joint.name}: {reason}."

    def _row(self, number: int, stage: Stage, moved: bool) -> tuple[FloatArray, NDArray[np.bool_], str]:
        """Return the change of a stage's leader, shape (6,), if it is known, and otherwise the reason."""
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
            if touch.link not in stage.finger.links and touch.met not in stage.finger.links:
                continue
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
            # If the earlier joints preserve a contact, a joint that the contact holds from the start stays, too.
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
        """Return, shape (J,): 1 for joints that move the link, minus 1 for joints that move the touched body."""
        moves: FloatArray = self.carried[touch.link] - self.carried[touch.met]
        return moves

    def _shift(self, touch: StageTouch) -> FloatArray:
        """Return how fast the touched point moves along the normal with the object's pose, shape (6,)."""
        if touch.met < len(self.hand.links):
            return np.zeros(6)
        T = self.T_world_palm
        normal = T.rotation @ touch.normal
        return np.concatenate([normal, _cross(T.apply(touch.position) - self.origin, normal)])

    def _met(self, touch: StageTouch) -> str:
        return self.hand.links[touch.met].name if touch.met < len(self.hand.links) else self.object_name


def _tolerance(bodies: HandBodies, poses: FloatArray) -> float:
    """Return the distance below which links touch [m]."""
    root = bodies.links.root
    balls = bodies.links.node[root[root >= 0]]
    reach = np.linalg.norm(balls[:, :3], axis=1) + balls[:, 3]
    away = np.linalg.norm(poses[:, root >= 0][..., :3, 3], axis=2)
    return TOUCH_FRACTION * float((away + reach).max(initial=0.0))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of vectors, shape (..., 3); NumPy's own takes ten times as long for a few."""
    x: FloatArray = a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]
    return x
