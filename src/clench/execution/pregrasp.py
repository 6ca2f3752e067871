"""The pregrasp: every finger off the object by a clearance (docs/method.md section 7)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from clench.closing.collision.path_check import find_path_overlap
from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, MotionError
from clench.core.pose import FloatArray, invert
from clench.models.hand.hand import Finger, Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .landing import CLEARANCE
from .step_check import placed_object
from .trajectory import Trajectory, plan_trajectory

#: Steps in which the closing path is walked back, and halvings that find the place within a step.
_STEPS = 100
_HALVINGS = 30


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
    trajectory = plan_trajectory(solution, hand, force=True)
    q = posture(solution.joint_angles, hand, "joint_angles")
    poses, T_palm_world = hand.link_poses(q), solution.hand_pose.inverse()
    for finger in hand.fingers:
        own, moving = list(finger.joints), _moving_links(hand, finger, trajectory)
        contacts = [c for c in solution.contacts if c.finger == finger.name and not c.passed]
        links = [hand.link_index(c.link) for c in contacts]
        touching = [(k, c) for k, c in zip(links, contacts, strict=True) if k in moving]
        if not touching:
            continue
        places = np.array([T_palm_world.apply(c.position) for _, c in touching])
        normals = np.array([T_palm_world.rotation @ c.normal for _, c in touching])
        local = np.array([(invert(poses[k]) @ np.append(p, 1.0)) for (k, _), p in zip(touching, places, strict=True)])
        numbers = [k for k, _ in touching]

        def gap(
            time: float,
            own: list[int] = own,
            numbers: list[int] = numbers,
            local: FloatArray = local,
            places: FloatArray = places,
            normals: FloatArray = normals,
        ) -> float:
            there = q.copy()
            there[own] = trajectory.at(time)[own]
            moved = np.einsum("kij,kj->ki", hand.link_poses(there)[numbers], local)[:, :3]
            return float(((moved - places) * normals).sum(axis=1).min())

        back = _latest_clear(gap, trajectory, clearance)
        q[own] = trajectory.at(back)[own]
    touch, source = trajectory.positions[-1], CollisionSource(solution.collision_source)
    around = None if obj is None else placed_object(solution, obj)
    for before in (q, trajectory.positions[0]):
        if find_path_overlap(hand, np.array([touch, before]), source, around) is None:
            return dict(zip(hand.joint_names, before.tolist(), strict=True))
    return dict(zip(hand.joint_names, q.tolist(), strict=True))


def _latest_clear(gap: Callable[[float], float], trajectory: Trajectory, clearance: float) -> float:
    """Return the last time of a trajectory before which the gap is large enough; its start when it never is."""
    times = np.linspace(trajectory.duration, 0.0, _STEPS + 1)
    for later, earlier in pairwise(times.tolist()):
        if gap(earlier) >= clearance:
            low, high = earlier, later
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if gap(middle) >= clearance else (low, middle)
            return float(low)
    return 0.0


def _moving_links(hand: Hand, finger: Finger, trajectory: Trajectory) -> tuple[int, ...]:
    """Return the links of a finger that the trajectory moves."""
    moved: FloatArray = np.ptp(trajectory.positions, axis=0)
    first = next((k for k, j in enumerate(finger.joints) if moved[j] > 0.0), None)
    if first is None:
        return ()
    moving: set[int] = set()
    for i in finger.links:
        link = hand.links[i]
        if link.joint in finger.joints[first:] or link.parent in moving:
            moving.add(i)
    return tuple(sorted(moving))
