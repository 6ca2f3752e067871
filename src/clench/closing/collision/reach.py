"""Measure the distance of a posed finger from an object, and test whether closing can reach the object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from clench.closing.finger_plan import FingerPlan, last_closing_joint
from clench.closing.link_bodies import link_bodies
from clench.closing.linkage import placed_links
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource
from clench.models.tessellation import TESSELLATION_DEVIATION

from .packed_object import PackedObject, role_body

if TYPE_CHECKING:
    from clench.kernels.geometry.bodies import BodyArrays


def graspable_body(obj: GraspObject, packed: PackedObject) -> BodyArrays:
    """Return the graspable bodies of an object as one body, in the object's frame, without obstacles."""
    if all(role is BodyRole.GRASPABLE for role in packed.body_roles):
        return packed.bodies
    return role_body(obj, BodyRole.GRASPABLE)


def obstacle_body(obj: GraspObject) -> BodyArrays:
    """Return the obstacles of an object as one body, in the object's frame."""
    return role_body(obj, BodyRole.OBSTACLE)


def nearest_link(
    hand: Hand,
    q: FloatArray,
    links: Sequence[int],
    source: CollisionSource,
    target: BodyArrays,
    T_palm_target: FloatArray,
) -> tuple[float, int]:
    """Return the smallest gap between some links and a body [m], and the link that has it; infinite and -1 for none.

    Exact but for cylinders and ellipsoids, which count as the polyhedra that are swept (docs/method.md section 5).

    Args:
        hand: the hand. q: angles of all its joints [rad], shape (J,). links: indices of the links that count.
        source: their geometry. target: see `graspable_body`. T_palm_target: its pose, shape (4, 4).
    """
    from clench.kernels.geometry.smallest_gap import smallest_gap

    poses = placed_links(hand, q)
    wanted = np.array(links, dtype=np.int64)
    gap, link = smallest_gap(link_bodies(hand, source), wanted, poses, target, np.ascontiguousarray(T_palm_target[:3]))
    return max(gap, 0.0), link


def beyond_reach(
    hand: Hand, plan: FingerPlan, source: CollisionSource, target: BodyArrays, T_palm_target: FloatArray
) -> tuple[float, float]:
    """Return how much farther a body is than any point of the finger can get, negative if nearer, and that reach [m].

    Both are measured from the anchor of the first closing joint; the reach is that of the finger stretched out.
    """
    from clench.kernels.geometry.smallest_gap import smallest_gap

    room = _room(hand, plan, source)
    gap, _ = smallest_gap(
        room.pivot,
        np.zeros(1, dtype=np.int64),
        np.ascontiguousarray(np.eye(4)[None, :3]),
        target,
        np.ascontiguousarray(T_palm_target[:3]),
    )
    return gap - room.reach, room.reach


def beside(
    hand: Hand, plan: FingerPlan, source: CollisionSource, target: BodyArrays, T_palm_target: FloatArray
) -> float:
    """Return how far a body lies to the side of everything that closing moves [m], at least 0.

    Closing joints that are parallel move their links in planes; a finger with several axis groups gives 0.
    """
    room = _room(hand, plan, source)
    if len(plan.axis_groups) > 1 or target.root[0] < 0:
        return 0.0
    across = plan.axis_groups[0].T_palm_axis_group[:3, 1]
    places = target.vertices @ (T_palm_target[:3, :3].T @ across) + T_palm_target[:3, 3] @ across
    # Corner by corner: numpy takes the least of three in a row ten times as long.
    corners = [places[numbers] for numbers in target.elements.T]
    low = min(float((places - target.radius).min()) for places in corners)
    high = max(float((places + target.radius).max()) for places in corners)
    return float(max(low - room.high, room.low - high, 0.0))


class _Room(NamedTuple):
    """Bounds of all places that closing can bring a finger to, in the palm frame.

    Args:
        pivot: anchor of the first closing joint, as a body. reach: no point gets farther from it [m].
        low, high: of all moved points along y of the first axis group [m].
    """

    pivot: BodyArrays
    reach: float
    low: float
    high: float


def _room(hand: Hand, plan: FingerPlan, source: CollisionSource) -> _Room:
    """Return a finger's room, found once per plan; round shapes are inscribed here, and given their deviation back."""
    return plan.kept(("room", source), lambda: _make_room(hand, plan, source))


def _make_room(hand: Hand, plan: FingerPlan, source: CollisionSource) -> _Room:
    from clench.kernels.geometry.bodies import Elements, pack_bodies

    own = [p.joint for p in plan.joints]
    moved = last_closing_joint(hand, plan.finger, own)
    poses = hand.link_poses(plan.posture)
    mover = {link.joint: i for i, link in enumerate(hand.links) if link.joint >= 0}
    anchors = np.array([(poses[mover[j]] @ np.append(hand.joints[j].anchor, 1.0))[:3] for j in own])
    arms = np.cumsum([0.0, *np.linalg.norm(np.diff(anchors, axis=0), axis=1)])
    reach, low, high = 0.0, np.inf, -np.inf
    for mesh in link_meshes(hand, source):
        if mesh.link in moved:
            k = own.index(moved[mesh.link])
            points = mesh.tree.vertices @ poses[mesh.link][:3, :3].T + poses[mesh.link][:3, 3]
            reach = max(reach, arms[k] + float(np.linalg.norm(points - anchors[k], axis=1).max()))
            along = points @ plan.axis_groups[0].T_palm_axis_group[:3, 1]
            low, high = min(low, float(along.min())), max(high, float(along.max()))
    spare = TESSELLATION_DEVIATION
    pivot = pack_bodies([Elements(anchors[:1], np.zeros((1, 3), dtype=np.int32), np.zeros(1))])
    return _Room(pivot, float(reach) + spare, low - spare, high + spare)
