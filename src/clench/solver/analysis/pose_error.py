"""Report how an error of the object's pose changes a grasp: to first order, and re-solved at its corners."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose, quaternion_from_rotation, rotation_about
from clench.core.showing.short_repr import short_repr
from clench.models.command import GraspCommand, as_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.orders import settled
from clench.solver.solution import GraspSolution, SolutionStatus
from clench.solver.solve import solve

from .sensitivity import Sensitivity, sensitivity


@dataclass(frozen=True, eq=False)
class PoseErrorCorner:
    """The answer at one corner of the pose error, compared with the answer without error.

    Args:
        error: shift along [m] and turn about [rad] the world's axes, shape (6,).
        status: of the solve there. change: of every joint [rad], shape (J,).
        lost, gained: links that touch only without the error, and links that touch only with it.
    """

    error: FloatArray
    status: SolutionStatus
    change: FloatArray
    lost: tuple[str, ...]
    gained: tuple[str, ...]

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class PoseErrorReport:
    """The effect of an error of the object's pose on angles and touching links.

    Args:
        translation, rotation: the object is off by up to this along [m] and about [rad] each of the world's axes.
        sensitivity: at the pose itself. touching: links that touch there.
        predicted: largest change of every joint to first order [rad], shape (J,); infinite if unknown.
        corners: the 64 corners of the error, solved again.
    """

    translation: float
    rotation: float
    sensitivity: Sensitivity
    touching: tuple[str, ...]
    predicted: FloatArray
    corners: tuple[PoseErrorCorner, ...]

    __repr__ = short_repr

    @property
    def measured(self) -> FloatArray:
        """Largest change of every joint at any corner [rad], shape (J,)."""
        largest: FloatArray = np.max(np.abs([c.change for c in self.corners]), axis=0)
        return largest

    @property
    def kept(self) -> Mapping[str, float]:
        """At which share of the corners every touching link still touches."""
        return {link: float(np.mean([link not in c.lost for c in self.corners])) for link in self.touching}

    @property
    def gained(self) -> Mapping[str, float]:
        """At which share of the corners other links touch."""
        links = sorted({link for c in self.corners for link in c.gained})
        return {link: float(np.mean([link in c.gained for c in self.corners])) for link in links}

    @property
    def statuses(self) -> Mapping[str, int]:
        """Number of corners that end in each status."""
        found = [c.status for c in self.corners]
        return {status.value: found.count(status) for status in SolutionStatus if status in found}

    def to_dict(self) -> dict[str, Any]:
        """Return the form that is written as JSON; null stands for infinite."""
        names = self.sensitivity.joints
        finite = [float(p) if np.isfinite(p) else None for p in self.predicted]
        return {
            "translation": self.translation,
            "rotation": self.rotation,
            "sensitivity": self.sensitivity.to_dict(),
            "predicted": dict(zip(names, finite, strict=True)),
            "measured": dict(zip(names, self.measured.tolist(), strict=True)),
            "kept": dict(self.kept),
            "gained": dict(self.gained),
            "statuses": dict(self.statuses),
        }


def pose_error(
    hand: Hand,
    obj: GraspObject,
    command: GraspCommand | Pose,
    translation: float = 0.002,
    rotation: float = 0.03490658503988659,
    *,
    solution: GraspSolution | None = None,
) -> PoseErrorReport:
    """Return how an error of the object's pose changes a grasp (docs/method.md section 5, *Sensitivity*).

    Args:
        hand, obj, command: as for `clench.solve`.
        translation: the object is off by up to this along each of the world's axes [m]; default 2 mm.
        rotation: and by up to this about each, through its origin [rad]; default 2 degrees.
        solution: the solution of these three inputs, if it exists already.

    Raises:
        CommandError: an error that is not finite or negative, or a rotation above pi. ClenchError: as for `solve`.
    """
    for key, value, most in (("translation", translation, np.inf), ("rotation", rotation, np.pi)):
        if not (np.isfinite(value) and 0.0 <= value <= most):
            raise CommandError(f"pose error: expected a {key} of 0 or more{_most(most)}, got {value}.")
    command = as_command(command)
    solution = solve(hand, obj, command) if solution is None else solution
    # The order and the posture that were chosen are kept: the hand does not jump at a corner.
    command = settled(command, solution)
    at = np.array([solution.joint_angles[name] for name in hand.joint_names])
    touching = _touching(solution)
    sizes = np.repeat([translation, rotation], 3)
    corners = []
    for signs in itertools.product((-1.0, 1.0), repeat=6):
        error = np.array(signs) * sizes
        there = solve(hand, obj, replace(command, object_pose=displaced(solution.object_pose, error)))
        angles = np.array([there.joint_angles[name] for name in hand.joint_names])
        links = _touching(there)
        lost, gained = (tuple(x for x in a if x not in b) for a, b in ((touching, links), (links, touching)))
        corners.append(PoseErrorCorner(error, there.status, angles - at, lost, gained))
    linear = sensitivity(solution, hand, obj)
    return PoseErrorReport(
        translation, rotation, linear, touching, linear.worst_change(translation, rotation), tuple(corners)
    )


def displaced(pose: Pose, error: FloatArray) -> Pose:
    """Return a pose shifted along the world's axes [m] and turned about its origin by a rotation vector [rad].

    Args:
        error: shift and rotation vector, shape (6,).
    """
    angle = float(np.linalg.norm(error[3:]))
    rotation = rotation_about(error[3:] / angle, angle) @ pose.rotation if angle > 0.0 else pose.rotation
    return Pose(pose.position + error[:3], quaternion_from_rotation(rotation))


def _touching(solution: GraspSolution) -> tuple[str, ...]:
    return tuple(dict.fromkeys(c.link for c in solution.contacts if not c.passed))


def _most(most: float) -> str:
    return f" and at most {most:.4g}" if np.isfinite(most) else ""
