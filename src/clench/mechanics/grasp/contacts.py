"""Contacts with their models: where fingers push, and how far forces may lean (docs/method.md section 6).

Two models, after Murray, Li and Sastry (1994), chapter 5:

- *point contact with friction*: `f = (f_t1, f_t2, f_n)`, `|f_t| <= mu f_n`;
- *soft finger*: also a torque about the normal, `f = (f_t1, f_t2, f_n, m)`, in one elliptic cone
  `sqrt(|f_t|^2 / mu^2 + m^2 / gamma^2) <= f_n` with the torsional coefficient gamma [m].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from math import dist
from numbers import Integral
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.defaults import FRICTION
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import Body

from .loads import ends_of

#: Default torsional coefficient of soft fingers [m]: torque about the normal per normal force; MuJoCo's default.
DEFAULT_TORSION: Final = 0.005
#: Contacts of a link whose places and normals differ by less are one [m, -].
_SAME: Final = 1e-9
#: Normals whose length is off by more than this are refused [-].
_UNIT: Final = 1e-6


class ContactModel(StrEnum):
    """Name the contact models."""

    POINT = "point"
    """point contact with friction: a force inside a cone"""
    SOFT = "soft"
    """soft finger: also a torque about the normal"""


@dataclass(frozen=True, eq=False)
class ContactSet:
    """The contacts of a grasp in one frame.

    Args:
        positions: [m], shape (C, 3).
        normals: unit, into the object (the way a finger pushes), shape (C, 3).
        friction: sliding friction of every pair of link and object [-], shape (C,).
        torsion: torsional coefficient of soft fingers [m], shape (C,); None: point contacts with friction.
        links: index of the touching link in the hand, shape (C,).

    Raises:
        CommandError: shapes do not fit, values are not finite, normals are not unit, or friction or torsion is not
            above 0.
    """

    positions: FloatArray
    normals: FloatArray
    friction: FloatArray
    torsion: FloatArray | None = None
    links: NDArray[np.int64] | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        count = len(self.positions)
        check_friction(self.friction)
        for key, shape in (("positions", (count, 3)), ("normals", (count, 3)), ("friction", (count,))):
            _check_shape(getattr(self, key), shape, key)
        if count and np.abs(np.linalg.norm(self.normals, axis=1) - 1.0).max() > _UNIT:
            raise CommandError("contacts.normals: expected unit vectors.")
        if self.torsion is not None:
            _check_shape(self.torsion, (count,), "torsion")
            if count and self.torsion.min() <= 0.0:
                raise CommandError(f"contacts.torsion: expected numbers above 0 m, got {self.torsion.min():g}.")

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def width(self) -> int:
        """Number of force components per contact: 3 of a point contact, 4 of a soft finger."""
        return 3 if self.torsion is None else 4

    @cached_property
    def frames(self) -> FloatArray:
        """Axes of the contact frames in columns: two tangents and the inward normal, right-handed, shape (C, 3, 3)."""
        return contact_frames(self.normals)

    @cached_property
    def reach(self) -> FloatArray:
        """Semi-axes of the cones at unit normal force: friction, friction and torsion, shape (C, width - 1)."""
        columns = [self.friction, self.friction]
        return np.stack(columns if self.torsion is None else [*columns, self.torsion], axis=1)

    def cone_slack(self, forces: FloatArray) -> FloatArray:
        """Return how far forces lie inside their cones, `f_n - |(f_t / mu, m / gamma)|` [N], shape (C,).

        Args:
            forces: in the contact frames [N, Nm], shape (C, width).
        """
        leaning = np.concatenate([forces[:, :2], forces[:, 3:]], axis=1) / self.reach
        slack: FloatArray = forces[:, 2] - np.linalg.norm(leaning, axis=1)
        return slack

    def cone_edges(self, count: int) -> FloatArray:
        """Return the edges of the polyhedra inside the cones, at unit normal force, shape (C, N, width).

        Point contacts have `count` edges, evenly spaced from the first tangent; soft fingers have two more, with the
        largest torque and no sliding force.

        Raises:
            CommandError: fewer than 3 edges.
        """
        around = edge_directions(count)
        edges = np.zeros((len(self), count + 2 * (self.width - 3), self.width))
        edges[:, :, 2] = 1.0
        edges[:, :count, :2] = self.friction[:, None, None] * around
        if self.torsion is not None:
            edges[:, count, 3], edges[:, count + 1, 3] = self.torsion, -self.torsion
        return edges


def make_contacts(
    positions: ArrayLike,
    inward_normals: ArrayLike,
    friction: ArrayLike = FRICTION,
    *,
    model: ContactModel | str = ContactModel.POINT,
    torsion: ArrayLike = DEFAULT_TORSION,
    links: Sequence[int] | None = None,
) -> ContactSet:
    """Make contacts from arrays; normals are normalised, friction and torsion may be one number for all.

    Args:
        positions: [m], shape (C, 3). inward_normals: into the object, shape (C, 3).
        friction: [-]. model: see `ContactModel`. torsion: of soft fingers [m]. links: indices in the hand.

    Raises:
        CommandError: see `ContactSet`; also a normal of length zero, or an unknown model.
    """
    if model not in list(ContactModel):
        raise CommandError(f"contact_model: expected one of {', '.join(ContactModel)}, got {model!r}.")
    p = np.array(positions, dtype=np.float64).reshape(-1, 3)
    n = np.array(inward_normals, dtype=np.float64).reshape(-1, 3)
    lengths = np.linalg.norm(n, axis=1, keepdims=True)
    if not (np.isfinite(lengths).all() and (lengths > 0.0).all()):
        raise CommandError("contacts.normals: expected finite vectors of some length.")

    def each(value: ArrayLike, key: str) -> FloatArray:
        try:
            return np.broadcast_to(np.asarray(value, dtype=np.float64), (len(p),)).copy()
        except (TypeError, ValueError):
            raise CommandError(f"{key}: expected one number, or one for each of {len(p)} contacts.") from None

    return ContactSet(
        positions=p,
        normals=n / lengths,
        friction=each(friction, "friction"),
        torsion=each(torsion, "torsion") if model == ContactModel.SOFT else None,
        links=None if links is None else np.array(links, dtype=np.int64).reshape(-1),
    )


def without_repeats(links: Sequence[int], positions: Sequence[FloatArray], normals: Sequence[FloatArray]) -> list[int]:
    """Return the indices of contacts, each place of a link once: a touch that stops two joints is listed for both.

    Args:
        links: indices of the touching links. positions: [m]. normals: unit; links in a corner have two at one place.
    """
    if len(links) < 2:
        return list(range(len(links)))
    kept: list[int] = []
    for i, link in enumerate(links):
        known = (k for k in kept if links[k] == link)
        if not any(max(dist(positions[k], positions[i]), dist(normals[k], normals[i])) <= _SAME for k in known):
            kept.append(i)
    return kept


def contact_frames(normals: FloatArray) -> FloatArray:
    """Return right-handed frames with the given third axes, in columns, shape (C, 3, 3).

    The first tangent is perpendicular to the coordinate axis that is farthest from the normal.
    """
    far = np.eye(3)[np.abs(normals).argmin(axis=1)] if len(normals) else np.empty((0, 3))
    first = _cross(far, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, _cross(normals, first), normals], axis=2)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of rows; for small arrays, `np.cross` takes ten times as long."""
    product: FloatArray = a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]
    return product


@lru_cache(maxsize=32)
def edge_directions(count: int, turned: float = 0.0) -> FloatArray:
    """Return unit directions of a cone's edges in the tangent plane, shape (count, 2).

    Args:
        count: of the edges. turned: by this part of the angle between two edges [-].

    Raises:
        CommandError: fewer than 3.
    """
    if not isinstance(count, Integral) or count < 3:
        raise CommandError(f"edges: expected a whole number of at least 3 edges of the friction cone, got {count!r}.")
    angles = 2.0 * np.pi * (np.arange(count) + turned) / count
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    directions.flags.writeable = False
    return directions


def pair_friction(hand: Hand, link: int, body: Body) -> float:
    """Return the friction of a link on a body [-]: the smaller of theirs, else the known one, else `FRICTION`.

    No pair grips better than its more slippery side; an unknown side is taken to be as good as the known one.
    """
    known = [mu for mu in (hand.links[link].friction, body.friction) if mu is not None]
    return min(known, default=FRICTION)


def check_friction(friction: ArrayLike, key: str = "friction") -> None:
    """Refuse friction that is not a finite number above 0.

    Raises:
        CommandError: with the first such value.
    """
    try:
        values = np.atleast_1d(np.asarray(friction, dtype=np.float64))
    except (TypeError, ValueError):
        raise CommandError(f"{key}: expected a finite number above 0, got {friction!r}.") from None
    bad = values[~(np.isfinite(values) & (values > 0.0))]
    if bad.size:
        raise CommandError(f"{key}: expected a finite number above 0, got {bad.flat[0]:g}; nothing holds without it.")


def friction_range(friction: float | tuple[float, float], key: str = "friction") -> tuple[float, float]:
    """Return the lowest and the highest friction of a number, which is a range of one value, or of a pair [-].

    Raises:
        CommandError: a value is not finite or not above 0, or the first friction of a range is the larger one.
    """
    low, high = ends_of(friction, key)
    for end in (low, high):
        check_friction(end, key)
    return float(low), float(high)


def _check_shape(value: FloatArray, shape: tuple[int, ...], key: str) -> None:
    if value.shape != shape:
        raise CommandError(f"contacts.{key}: expected shape {shape}, got {value.shape}.")
    if not np.isfinite(value).all():
        raise CommandError(f"contacts.{key}: expected finite numbers.")
