"""Approach poses: random places of the open hand just off an object's surface, palm towards it."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from numbers import Real
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, ObjectError
from clench.core.memory import in_parts
from clench.core.pose import FloatArray, Pose, invert, quaternion_from_rotation, rotation_about
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject

from .depths import clear_distance, first_touch, hand_depths
from .packed_object import PackedObject, pack_object

#: Largest angle between the palm's normal and the surface's [rad].
MAX_TILT: Final = np.pi / 6.0
#: The hand stops between these distances before its first touch [m].
BACK_OFF: Final = (0.001, 0.025)
#: Draws per pose before giving up.
_ATTEMPTS: Final = 100


def approach_poses(
    hand: Hand, obj: GraspObject, count: int, seed: int, *, preshape: Mapping[str, float] | None = None
) -> list[Pose]:
    """Draw poses of the palm, `T_world_palm`, from which the open hand can close around an object.

    Each pose starts from a random point of the graspable surface, drawn by area. The palm's centre is put over the
    point. The palm's normal points into the surface, tilted by up to 30 degrees, and the roll is random. The open hand
    comes in along its normal until it first touches the object, and is backed off by 1 to 25 mm. A pose from which it
    touches an obstacle first is drawn again. If all of 100 draws touch an obstacle first, as around a sheet of paper on
    a table, the draw that got nearest to the surface gives the pose. The first poses are the same for every `count`.

    Args:
        hand: the hand, with its default collision source.
        obj: the object at its pose, with its obstacles.
        count: number of poses.
        seed: the same seed gives the same poses, bit for bit; not negative.
        preshape: angles [rad] by joint name that replace the open posture's.

    Raises:
        CommandError: a negative count or seed, an angle that is not finite.
        UnknownNameError: a joint of the preshape that does not exist.
        ObjectError: the object has no graspable surface, or no free pose was found.
    """
    if count < 0:
        raise CommandError(f"approach poses: expected a count of 0 or more, got {count}.")
    return list(itertools.islice(drawn_poses(hand, obj, seed, {} if preshape is None else preshape), count))


def drawn_poses(hand: Hand, obj: GraspObject, seed: int, preshape: Mapping[str, float]) -> Iterator[Pose]:
    """Draw the poses of `approach_poses` one after another, without end; arguments and errors as there."""
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    if seed < 0:
        raise CommandError(f"seed: expected a whole number of at least 0, got {seed}.")
    q = _open_posture(hand, preshape)
    packed = pack_object(obj)
    surface = GraspableSurface(obj, packed)
    T_world_object = obj.pose.matrix

    def drawn(number: int) -> Pose:
        # One random stream per pose, so that no pose depends on the number of poses or of repeated draws.
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, number))))
        return Pose.from_matrix(T_world_object @ _draw(rng, hand, q, packed, surface, obj.name))

    return map(drawn, itertools.count())


class GraspableSurface:
    """Draw points of the graspable surface by area.

    `triangles` are indices of the full tree; `shares` are their cumulative shares of the area.

    Raises:
        ObjectError: no graspable surface.
    """

    def __init__(self, obj: GraspObject, packed: PackedObject) -> None:
        self.tree = packed.full_tree
        graspable = np.array([role is BodyRole.GRASPABLE for role in packed.body_roles])[self.tree.body]
        self.triangles = np.flatnonzero(graspable)
        parts = in_parts(len(self.triangles))
        areas = np.concatenate([np.empty(0), *(self._areas(self.triangles[some]) for some in parts)])
        if not areas.sum() > 0.0:
            raise ObjectError(f"object '{obj.name}': expected a graspable body with a surface to approach, found none.")
        self.shares = np.cumsum(areas) / areas.sum()

    def _areas(self, triangles: NDArray[np.intp]) -> FloatArray:
        """Return the areas of triangles [m^2], 0 for those without a normal."""
        a, b, c = self.tree.vertices[self.tree.triangles[triangles]].transpose(1, 0, 2)
        areas: FloatArray = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return areas * self.tree.normals[triangles].any(axis=1)

    def draw(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Return a point [m] and the outward unit normal there, each shape (3,)."""
        number = min(int(np.searchsorted(self.shares, rng.random(), side="right")), len(self.shares) - 1)
        triangle = self.triangles[number]
        root, other = np.sqrt(rng.random()), rng.random()
        weights = np.array([1.0 - root, root * (1.0 - other), root * other])
        return weights @ self.tree.vertices[self.tree.triangles[triangle]], self.tree.normals[triangle]


def _open_posture(hand: Hand, preshape: Mapping[str, float]) -> FloatArray:
    """Return the open posture with the angles of a preshape, followers coupled, shape (J,) [rad]."""
    joints = list(hand.joints)
    if not isinstance(preshape, Mapping):
        raise CommandError(f"preshape: expected angles in radians by joint name, got {type(preshape).__name__}.")
    for name, angle in preshape.items():
        if not (isinstance(angle, Real) and abs(angle) <= sys.float_info.max):
            raise CommandError(f"preshape.{name}: expected a finite angle in radians, got {angle!r}.")
        index = hand.joint_index(name)
        joints[index] = replace(joints[index], open_value=float(angle))
    return replace(hand, joints=tuple(joints)).open_angles()


def _draw(
    rng: np.random.Generator, hand: Hand, q: FloatArray, packed: PackedObject, surface: GraspableSurface, name: str
) -> FloatArray:
    """Return a random `T_object_palm`, shape (4, 4), where the open hand is free, with the object before it."""
    stopped: tuple[float, FloatArray | None] = np.inf, None
    for _ in range(_ATTEMPTS):
        point, normal = surface.draw(rng)
        rotation = _facing(rng, hand.palm_normal, -normal)
        back_off = rng.uniform(*BACK_OFF)
        T_object_palm = np.eye(4)
        T_object_palm[:3, :3] = rotation
        T_object_palm[:3, 3] = point - rotation @ hand.palm_center
        into = rotation @ hand.palm_normal
        outside = clear_distance(hand, q, packed, invert(T_object_palm)) + BACK_OFF[1]
        T_object_palm[:3, 3] -= outside * into
        travel, body = first_touch(hand, q, packed, invert(T_object_palm), hand.palm_normal)
        if not np.isfinite(travel):
            continue
        T_object_palm[:3, 3] += (travel - back_off) * into
        left = outside - travel
        is_obstacle = packed.body_roles[body] is BodyRole.OBSTACLE
        if is_obstacle and left >= stopped[0]:
            continue
        depths = hand_depths(hand, q, packed, invert(T_object_palm))
        if any(depth.place is not None for depth in depths):
            continue
        if not is_obstacle:
            return T_object_palm
        stopped = left, T_object_palm
    if stopped[1] is not None:
        return stopped[1]
    raise ObjectError(f"object '{name}': found no free approach for hand '{hand.name}' in {_ATTEMPTS} draws.")


def _facing(rng: np.random.Generator, palm_normal: FloatArray, target: FloatArray) -> FloatArray:
    """Return a rotation that maps the palm's normal to within `MAX_TILT` of a target, randomly rolled, shape (3, 3)."""
    # Uniform over the cap of directions around the target: its height is uniform.
    height = rng.uniform(np.cos(MAX_TILT), 1.0)
    around, roll = rng.uniform(0.0, 2.0 * np.pi, 2)
    across = _perpendicular(target)
    other = np.cross(target, across)
    tilt = np.sqrt(1.0 - height * height) * (np.cos(around) * across + np.sin(around) * other)
    direction = height * target + tilt
    rotation: FloatArray = rotation_about(direction, roll) @ _basis(direction) @ _basis(palm_normal).T
    return Pose(wxyz=quaternion_from_rotation(rotation)).rotation


def _basis(direction: FloatArray) -> FloatArray:
    """Return a right-handed frame whose last axis is a direction, as columns, shape (3, 3)."""
    z = direction / np.linalg.norm(direction)
    x = _perpendicular(z)
    return np.column_stack([x, np.cross(z, x), z])


def _perpendicular(direction: FloatArray) -> FloatArray:
    """Return a unit vector perpendicular to another, shape (3,)."""
    axis = np.eye(3)[int(np.argmin(np.abs(direction)))]
    v = np.cross(direction, axis)
    unit: FloatArray = v / np.linalg.norm(v)
    return unit
