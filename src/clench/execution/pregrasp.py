"""The pregrasp: every finger off the object by a clearance (docs/method.md section 7)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clench.closing.collision.path_check import find_path_overlap
from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, MotionError
from clench.core.pose import FloatArray, invert
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Finger, Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .landing import CLEARANCE
from .step_check import placed_object
from .trajectory import plan_closing, plan_trajectory

#: Steps in which the closing path is walked back. The step in which the gap becomes large enough is parted again.
_STEPS = 100
_PARTINGS = 5


def plan_pregrasp(
    solution: GraspSolution, hand: Hand, *, obj: GraspObject | None = None, clearance: float = CLEARANCE
) -> dict[str, float]:
    """Return the posture in which every touching finger stands off by a clearance [rad].

    With the object, the result is the pregrasp of `plan_trajectory`: from it, a free straight line reaches all contacts
    simultaneously. Without the object, or without such a posture, every finger is backed off along its closing path. If
    the straight line from there is not free, the pregrasp is the open hand. The clearance is then measured at the
    contacts: every contact point of a link is that far off the object's tangent plane. For a convex object, this is at
    most its distance from the object. A finger that cannot get this far is taken back to its start; a finger without
    contact keeps the solution's angles.

    Args:
        solution: the solution. hand, obj: the hand and object that were solved for. clearance: [m].

    Raises:
        CommandError: a clearance that is not finite and above 0; the solution is of another hand.
    """
    check_type(solution, GraspSolution, "solution")
    check_type(hand, Hand, "hand")
    if obj is not None:
        check_type(obj, GraspObject, "obj")
    if not (np.isfinite(clearance) and clearance > 0.0):
        raise CommandError(f"clearance: expected a finite number above 0 m, got {clearance!r}.")
    if obj is not None:
        try:
            way = plan_trajectory(solution, hand, obj=obj, clearance=clearance)
        except MotionError:
            way = None
        if way is not None and way.pregrasp is not None:
            return dict(zip(hand.joint_names, way.positions[way.pregrasp].tolist(), strict=True))
    times, path = plan_closing(solution, hand)
    touch = posture(solution.joint_angles, hand, "joint_angles")
    q = touch.copy()
    for finger in hand.fingers:
        gap = _finger_gap(solution, hand, finger, times, path)
        if gap is not None:
            back = _latest_clear(gap, float(times[-1]), clearance)
            q[finger.own] = _angles_at(np.array([back]), times, path[:, finger.own])[0]
    source = CollisionSource(solution.collision_source)
    around = None if obj is None else placed_object(solution, obj)
    for before in (q, path[0]):
        if find_path_overlap(hand, np.array([touch, before]), source, around) is None:
            return dict(zip(hand.joint_names, before.tolist(), strict=True))
    return dict(zip(hand.joint_names, q.tolist(), strict=True))


def _finger_gap(
    solution: GraspSolution, hand: Hand, finger: Finger, times: FloatArray, path: FloatArray
) -> Callable[[FloatArray], FloatArray] | None:
    """Return a function that gives the gap at a finger's contacts at times of a path; None without such a contact.

    The gap is the smallest distance of the contact points of its links from the planes tangent to the object [m].

    Args:
        solution: the solution. hand: the hand. finger: one of its fingers.
        times: of the way-points [s], (N,). path: their postures [rad], (N, J).
    """
    moving = _moving_links(hand, finger, path)
    touching = [c for c in solution.contacts if c.finger == finger.name and not c.passed]
    touching = [c for c in touching if hand.link_index(c.link) in moving]
    if not touching:
        return None
    links = [hand.link_index(c.link) for c in touching]
    T_palm_world = solution.hand_pose.inverse()
    places = np.array([T_palm_world.apply(c.position) for c in touching])
    normals = np.array([T_palm_world.rotation @ c.normal for c in touching])
    there = posture(solution.joint_angles, hand, "joint_angles")
    poses = poses_at(hand, there[None], links)[0]
    local = np.array([(invert(T) @ np.append(p, 1.0)) for T, p in zip(poses, places, strict=True)])

    def gap(at: FloatArray) -> FloatArray:
        postures = np.tile(there, (len(at), 1))
        postures[:, finger.own] = _angles_at(at, times, path[:, finger.own])
        moved = np.einsum("skij,kj->ski", poses_at(hand, postures, links), local)[..., :3]
        smallest: FloatArray = ((moved - places) * normals).sum(axis=2).min(axis=1)
        return smallest

    return gap


def _angles_at(at: FloatArray, times: FloatArray, path: FloatArray) -> FloatArray:
    """Return the angles of a path at some times, shape (S, K)."""
    return np.array([np.interp(at, times, column) for column in path.T]).T


def _latest_clear(gap: Callable[[FloatArray], FloatArray], end: float, clearance: float) -> float:
    """Return the last time before an end at which the gap is large enough; 0 when it never is."""
    later, earlier = end, 0.0
    for _ in range(1 + _PARTINGS):
        times = np.linspace(later, earlier, _STEPS + 1)
        clear = np.flatnonzero(gap(times[1:]) >= clearance)
        if not len(clear):
            return earlier
        later, earlier = float(times[clear[0]]), float(times[clear[0] + 1])
    return earlier


def _moving_links(hand: Hand, finger: Finger, path: FloatArray) -> tuple[int, ...]:
    """Return the links of a finger that a path moves."""
    moved: FloatArray = np.ptp(path, axis=0)
    first = next((k for k, j in enumerate(finger.joints) if moved[j] > 0.0), None)
    if first is None:
        return ()
    moving: set[int] = set()
    for i in finger.links:
        link = hand.links[i]
        if link.joint in finger.joints[first:] or link.parent in moving:
            moving.add(i)
    return tuple(sorted(moving))
