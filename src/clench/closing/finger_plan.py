"""Plan how a finger closes at one posture: degrees of freedom, axis groups, outlines (docs/method.md sections 1-2).

A plan depends on the hand and the posture alone; nothing in it knows the object.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clench.core.caching.keeping import Keeper
from clench.core.exceptions import HandError
from clench.core.pose import FloatArray, invert
from clench.core.tolerances import PARALLEL_ANGLE
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.hand.link_mesh import link_meshes
from clench.models.shapes import CollisionSource

from .curl_planes import AxisGroup, MovedLink, axis_group_frame, plane_offsets, refined
from .outlines import extent


@dataclass(frozen=True, eq=False)
class PlannedJoint:
    """Describe a closing joint in its plan.

    Args:
        joint: index in the hand. axis_group, dof: indices in the plan.
        pivot: in its axis group's (x, z) at the open posture [m], shape (2,).
        turn: +1 when its model angle grows with a turn from x towards z, else -1.
        rate: turn per unit of travel of its degree of freedom [-].
        start, stop: travel of the degree of freedom between which it moves [rad].
    """

    joint: int
    axis_group: int
    dof: int
    pivot: FloatArray
    turn: float
    rate: float
    start: float
    stop: float


@dataclass(frozen=True, eq=False)
class FingerPlan(Keeper):
    """The plan for closing one finger from one open posture.

    Args:
        finger: the finger. posture: open angles of all joints of the hand [rad], shape (J,).
        joints: closing joints, palm side first. leaders: leader of each degree of freedom (index in the hand).
        lengths: travel of each degree of freedom to its limit [rad]. axis_groups: see `AxisGroup`.
        speeds: relative speed of each degree of freedom in simultaneous closing. breaks: whether later joints of a
            degree of freedom continue when earlier joints are blocked.
        length: no moved point gets farther from an axis group's origin in its plane, for round shapes nearly [m].
    """

    finger: Finger
    posture: FloatArray
    joints: tuple[PlannedJoint, ...]
    leaders: tuple[int, ...]
    lengths: tuple[float, ...]
    speeds: tuple[float, ...]
    breaks: tuple[bool, ...]
    axis_groups: tuple[AxisGroup, ...]
    length: float

    def lies_in_planes(self, again: bool) -> bool:
        """Say whether the joints of only one axis group ever move together, with earlier joints at rest: then planes
        suffice.

        Args:
            again: all joints move simultaneously, or in several rounds.
        """
        homes: dict[int, set[int]] = {}
        for p in self.joints:
            homes.setdefault(0 if again else p.dof, set()).add(p.axis_group)
        return all(len(axis_groups) == 1 for axis_groups in homes.values())

    def turned(self, hand: Hand, turn: FloatArray) -> FloatArray:
        """Return the angles of all joints of the hand when the plan's joints have turned, shape (J,) [rad]."""
        q = self.posture.copy()
        for p, s in zip(self.joints, turn, strict=True):
            joint = hand.joints[p.joint]
            q[p.joint] = min(max(q[p.joint] + p.turn * s, joint.lower), joint.upper)
        return q

    def angles(self, hand: Hand, travel: FloatArray) -> FloatArray:
        """Return the angles of all joints of the hand when the degrees of freedom have travelled, shape (J,) [rad]."""
        q = self.posture.copy()
        for leader, s in zip(self.leaders, travel, strict=True):
            joint = hand.joints[leader]
            q[leader] = min(max(q[leader] + joint.direction * s, joint.lower), joint.upper)
        return hand.coupled(q)


def plan_finger(
    hand: Hand,
    finger: Finger,
    posture: FloatArray,
    planes: int,
    source: CollisionSource,
    speeds: Mapping[str, float] | None = None,
) -> FingerPlan:
    """Plan a finger's closing from an open posture.

    Args:
        hand: the hand. finger: one of its fingers.
        posture: angles of all joints [rad], couplings hold, shape (J,).
        planes: number of curl planes. source: geometry of the links.
        speeds: by name of a free joint, for simultaneous closing; the default is 1.

    Raises:
        HandError: a coupling that the method does not cover.
    """
    poses = hand.link_poses(posture)
    closing = closing_joints(hand, finger)
    leaders = _leaders(hand, closing)
    mover = {link.joint: i for i, link in enumerate(hand.links) if link.joint >= 0}
    axes = {j: poses[mover[j]][:3, :3] @ hand.joints[j].axis * hand.joints[j].direction for j in closing}
    anchors = {j: (poses[mover[j]] @ np.append(hand.joints[j].anchor, 1.0))[:3] for j in closing}
    split = _axis_groups(closing, axes)
    moved_by = last_closing_joint(hand, finger, closing)
    frames = [_frame(hand, closing, f, axes, anchors, poses, moved_by, source) for f in split]
    joints = []
    for f, members in enumerate(split):
        to_axis_group = invert(frames[f])
        for j in members:
            local = to_axis_group @ np.append(anchors[j], 1.0)
            model_axis = axes[j] * hand.joints[j].direction
            turn = -1.0 if model_axis @ frames[f][:3, 1] > 0.0 else 1.0
            joints.append((j, f, local[[0, 2]], turn))
    planned = tuple(_planned(hand, posture, leaders, j, f, pivot, turn) for j, f, pivot, turn in joints)
    order = list(dict.fromkeys(leaders[j] for j in closing))
    lengths = tuple(_travel(hand, posture, leader) for leader in order)
    axis_groups = _lay_axis_groups(hand, planned, frames, split, poses, moved_by, planes, source)
    return FingerPlan(
        finger,
        posture,
        planned,
        tuple(order),
        lengths,
        tuple((speeds or {}).get(hand.joints[leader].name, 1.0) for leader in order),
        tuple(any(c.breakaway and c.leader == leader for c in hand.couplings) for leader in order),
        axis_groups,
        _length(hand, axis_groups, source),
    )


def closing_joints(hand: Hand, finger: Finger) -> list[int]:
    """Return the joints that closing moves, palm side first: free joints and their followers.

    Raises:
        HandError: a posture joint that follows a closing one, or coupling between fingers.
    """
    closing = [j for j in finger.joints if hand.joints[j].role is JointRole.CLOSING and _is_free(hand, finger, j)]
    for c in hand.couplings:
        follower = hand.joints[c.follower]
        if c.leader in closing and c.follower in finger.joints and c.follower not in closing:
            raise HandError(
                f"{hand.name}: posture joint '{follower.name}' follows closing joint '{hand.joints[c.leader].name}'; "
                "a joint that moves while the finger closes has to be a closing joint."
            )
    return closing


def _is_free(hand: Hand, finger: Finger, joint: int) -> bool:
    """Say whether a closing joint moves on its own or with a closing joint of its own finger."""
    for c in hand.couplings:
        if c.follower == joint:
            leader = hand.joints[c.leader]
            if c.leader in finger.joints and leader.role is JointRole.CLOSING:
                return True
            if leader.role is JointRole.CLOSING:
                raise HandError(
                    f"{hand.name}: joint '{hand.joints[joint].name}' of finger '{finger.name}' follows "
                    f"'{leader.name}' of another finger; coupling between fingers is not supported."
                )
            return False
    return True


def _leaders(hand: Hand, closing: list[int]) -> dict[int, int]:
    leaders = {j: j for j in closing}
    leaders.update({c.follower: c.leader for c in hand.couplings if c.follower in leaders})
    return leaders


def _axis_groups(closing: list[int], axes: dict[int, FloatArray]) -> list[list[int]]:
    """Split closing joints into runs of parallel axes."""
    axis_groups: list[list[int]] = []
    for j in closing:
        if axis_groups and np.linalg.norm(np.cross(axes[axis_groups[-1][0]], axes[j])) <= PARALLEL_ANGLE:
            axis_groups[-1].append(j)
        else:
            axis_groups.append([j])
    return axis_groups


def last_closing_joint(hand: Hand, finger: Finger, closing: list[int]) -> dict[int, int]:
    """Return, for every link of the finger that closing moves, the last closing joint before it."""
    result: dict[int, int] = {}
    for i in finger.links:
        k = i
        while k >= 0:
            if hand.links[k].joint in closing:
                result[i] = hand.links[k].joint
                break
            k = hand.links[k].parent
    return result


def resting_links(hand: Hand, plan: FingerPlan) -> tuple[int, ...]:
    """Return the finger's links that no closing joint moves."""
    closing = {p.joint for p in plan.joints}
    moved: set[int] = set()
    for i in plan.finger.links:
        if hand.links[i].joint in closing or hand.links[i].parent in moved:
            moved.add(i)
    return tuple(i for i in plan.finger.links if i not in moved)


def _frame(
    hand: Hand,
    closing: list[int],
    members: list[int],
    axes: dict[int, FloatArray],
    anchors: dict[int, FloatArray],
    poses: FloatArray,
    moved_by: dict[int, int],
    source: CollisionSource,
) -> FloatArray:
    first = members[0]
    axis, origin = axes[first], anchors[first]
    after = closing.index(first) + 1
    towards = anchors[closing[after]] if after < len(closing) else origin
    across = towards - origin - axis * ((towards - origin) @ axis)
    if np.linalg.norm(across) < 1e-6:
        towards = _farthest(hand, origin, axis, poses, [i for i in moved_by if moved_by[i] in members], source)
    return axis_group_frame(axis, origin, towards)


def _farthest(
    hand: Hand, origin: FloatArray, axis: FloatArray, poses: FloatArray, links: list[int], source: CollisionSource
) -> FloatArray:
    best, result = -1.0, origin
    for i in links:
        for shape in hand.links[i].shapes[source]:
            points = shape.to_mesh(1e-3).vertices @ poses[i][:3, :3].T + poses[i][:3, 3]
            away = points - origin
            distance = np.linalg.norm(away - np.outer(away @ axis, axis), axis=1)
            k = int(np.argmax(distance))
            if distance[k] > best:
                best, result = float(distance[k]), points[k]
    return result


def _travel(hand: Hand, posture: FloatArray, leader: int) -> float:
    joint = hand.joints[leader]
    limit = joint.upper if joint.direction > 0 else joint.lower
    return max(float(joint.direction * (limit - posture[leader])), 0.0)


def _planned(
    hand: Hand, posture: FloatArray, leaders: dict[int, int], j: int, axis_group: int, pivot: FloatArray, turn: float
) -> PlannedJoint:
    """Return a joint's motion: followers move while their coupled angle is inside their limits."""
    order = list(dict.fromkeys(leaders.values()))
    leader = leaders[j]
    direction = hand.joints[leader].direction
    length = _travel(hand, posture, leader)
    dof = order.index(leader)
    if leader == j:
        return PlannedJoint(j, axis_group, dof, pivot, turn, turn * direction, 0.0, length)
    coupling = next(c for c in hand.couplings if c.follower == j)
    at_open = coupling.ratio * posture[leader] + coupling.offset
    speed = coupling.ratio * direction
    lower, upper = hand.joints[j].lower, hand.joints[j].upper
    if speed == 0.0:
        return PlannedJoint(j, axis_group, dof, pivot, turn, 0.0, 0.0, 0.0)
    window = sorted([(lower - at_open) / speed, (upper - at_open) / speed])
    start, stop = max(window[0], 0.0), min(window[1], length)
    return PlannedJoint(j, axis_group, dof, pivot, turn, turn * speed, start, max(stop, start))


def _lay_axis_groups(
    hand: Hand,
    joints: tuple[PlannedJoint, ...],
    frames: list[FloatArray],
    split: list[list[int]],
    poses: FloatArray,
    moved_by: dict[int, int],
    planes: int,
    source: CollisionSource,
) -> tuple[AxisGroup, ...]:
    """Lay the planes of every axis group across the links that its joints, or later ones, move."""
    position = {p.joint: i for i, p in enumerate(joints)}
    placed = []
    for f in range(len(split)):
        to_axis_group = invert(frames[f])
        links = [(i, to_axis_group @ poses[i]) for i in moved_by if joints[position[moved_by[i]]].axis_group >= f]
        extents = _extents(hand, links, source)
        placed.append((links, plane_offsets(extents, planes)))
    most = max(len(offsets) for _, offsets in placed)
    axis_groups = []
    for f, (links, offsets) in enumerate(placed):
        last, arms = position[split[f][-1]], _arms([p for p in joints if p.axis_group == f], position)
        moved = []
        for i, T in links:
            joint = min(position[moved_by[i]], last)
            moved.append(MovedLink(i, joint, T, hand.links[i].shapes[source], joints[joint].pivot, arms[joint]))
        axis_groups.append(AxisGroup(frames[f], refined(offsets, most), tuple(moved)))
    return tuple(axis_groups)


def _extents(hand: Hand, links: list[tuple[int, FloatArray]], source: CollisionSource) -> list[tuple[float, float]]:
    extents = [extent(shape, T) for i, T in links for shape in hand.links[i].shapes[source]]
    return extents or [(0.0, 0.0)]


def _arms(own: list[PlannedJoint], position: dict[int, int]) -> dict[int, float]:
    """Return the length of the chain from an axis group's origin to each of its joints [m]."""
    arm = 0.0
    arms = {}
    for before, p in zip([None, *own], own, strict=False):
        arm += float(np.linalg.norm(p.pivot - (before.pivot if before else 0.0)))
        arms[position[p.joint]] = arm
    return arms


def _length(hand: Hand, axis_groups: tuple[AxisGroup, ...], source: CollisionSource) -> float:
    """Return the length of a finger from the triangles of its links, which need no planes [m]."""
    vertices = {mesh.link: mesh.tree.vertices for mesh in link_meshes(hand, source)}
    length = 0.0
    for moved in (m for axis_group in axis_groups for m in axis_group.moved if m.link in vertices):
        rows = moved.T_axis_group_link[[0, 2]]
        away = vertices[moved.link] @ rows[:, :3].T + (rows[:, 3] - moved.pivot)
        length = max(length, moved.arm + float(np.sqrt((away * away).sum(axis=1).max())))
    return length
