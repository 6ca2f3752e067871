"""Find the opposition zones of a hand: places and distances at which pads come to face each other (docs/method.md
section 9).

A preshape fixes the posture joints and bends the outer joints. The first closing joint of every finger then closes. A
zone describes two opposing sides of the hand on the way: the middle between their pads, the axis from one side to the
other, the distance, and how well the pads face each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.hand.pads import Pad, closing_joints_of, closing_limit, finger_pads
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.batch_solver import BatchSolver

from .preshape_cache import ZONE, Entry, cache_key, keep_preshapes, read_preshapes
from .preshape_names import name_preshapes

#: Preshapes of a hand at most; the first one is the open hand.
PRESHAPES = 24
#: Distances between pads are sorted into bins with these borders [m].
APERTURES = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.055, 0.07, 0.09, 0.12, 0.16])
#: Zones that oppose less well are of no use [-]: 1 when pads face each other and close along one line.
WELL = 0.25
#: Preshapes that are drawn, and shares of the first closing joint's range at which pads are looked at.
_DRAWS = 700
_SHARES = np.linspace(0.05, 0.95, 10)
#: Bend of a finger's outer joints before it closes, as shares of their ranges [-].
_BENT = (0.0, 0.0, 0.15, 0.3, 0.45)
#: In a hand with a thumb, side-to-side finger joints stay within this share of their range around the open value.
_SPREAD = 0.3
#: The best preshapes of every bin of apertures are kept, if they differ by this in some joint [rad].
_PER_APERTURE = 4
_APART = 0.25
#: The hand reaches nothing beyond this distance [m].
_FAR = 100.0


@dataclass(frozen=True, eq=False)
class Preshape:
    """A preshape of a hand, and the zones on the way from there.

    Args:
        name: "open", or a description, see `name_preshapes`.
        angles: by joint name [rad]: every posture joint, and open values of closing joints.
        center: middles of its zones in the palm frame [m], shape (Z, 3). axis: unit vectors from one side (thumb) to
            the other, shape (Z, 3).
        row: from the first to the last pad of the other side, across the axis [m], shape (Z, 3).
        aperture: distance of the pads [m], shape (Z,). quality: how well they oppose, -1 to 1, shape (Z,).
    """

    name: str
    angles: dict[str, float]
    center: FloatArray
    axis: FloatArray
    row: FloatArray
    aperture: FloatArray
    quality: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: name, angles, range of the aperture [m], and aperture and quality of the best zone."""
        best = int(self.quality.argmax()) if len(self.quality) else None
        return {
            "name": self.name,
            "angles": dict(self.angles),
            "aperture_range": None if best is None else [float(self.aperture.min()), float(self.aperture.max())],
            "aperture": None if best is None else float(self.aperture[best]),
            "quality": None if best is None else float(self.quality[best]),
        }


@dataclass(frozen=True, eq=False)
class _Pads:
    """Pads at S shares of closing: points [m] and normals, and the unit directions in which they move, (S, P, 3)."""

    point: FloatArray
    normal: FloatArray
    moving: FloatArray


def opposition_zones(hand: Hand, fingers: tuple[str, ...] | None = None) -> tuple[Preshape, ...]:
    """Return the preshapes of a hand whose pads come to face each other, with their zones; the open hand first.

    They are the same for every call, and found once per hand: nothing random depends on a seed of the caller. Later
    processes read them from the cache folder (see `clench.solver.preshapes.preshape_cache`).

    Args:
        hand: the hand. fingers: names of the closing fingers; None: all.
    """
    names = tuple(finger.name for finger in hand.fingers) if fingers is None else fingers
    return hand.kept(("preshapes", names), lambda: _read_zones(hand, names))


def _read_zones(hand: Hand, names: tuple[str, ...]) -> tuple[Preshape, ...]:
    """Return the preshapes from the cache folder, or find them."""
    key = cache_key(hand, names)
    entries = read_preshapes(key, hand.joint_names)
    if entries is None:
        entries = list(_find_zones(hand, names))
        keep_preshapes(key, entries)
    return _named(hand, entries)


def _named(hand: Hand, entries: list[Entry]) -> tuple[Preshape, ...]:
    """Return preshapes with names and arrays."""
    zones = [np.array(entry.zones, dtype=np.float64).reshape(-1, ZONE) for entry in entries]
    outer = {hand.joints[j].name for f in hand.fingers if not f.is_thumb for j in closing_joints_of(hand, f)}
    bent = [not outer.isdisjoint(entry.angles) for entry in entries]
    names = name_preshapes([(rows[:, 9], rows[:, 10], is_bent) for rows, is_bent in zip(zones, bent, strict=True)])
    opened = {name: hand.joints[hand.joint_index(name)].open_value for name in posture_joints(hand)}
    return tuple(
        Preshape(
            name,
            {**opened, **entry.angles},
            center=rows[:, :3],
            axis=rows[:, 3:6],
            row=rows[:, 6:9],
            aperture=rows[:, 9],
            quality=rows[:, 10],
        )
        for name, entry, rows in zip(names, entries, zones, strict=True)
    )


def posture_joints(hand: Hand, fingers: tuple[Finger, ...] | None = None) -> list[str]:
    """Return the posture joints of some fingers that follow no other joint; of all fingers by default."""
    followers = {c.follower for c in hand.couplings}
    own = [j for finger in (hand.fingers if fingers is None else fingers) for j in finger.joints if j not in followers]
    return [hand.joints[j].name for j in own if hand.joints[j].role is JointRole.POSTURE]


def _find_zones(hand: Hand, names: tuple[str, ...]) -> Iterator[Entry]:
    """Yield the open hand and the best preshapes of every aperture, or nothing if no two sides face each other."""
    pads, sides = finger_pads(hand), list(opposing_sides(hand, names))
    places = {pad.finger: k for k, pad in enumerate(pads)}
    sides = [(one, [f for f in other if f in places]) for one, other in sides if one in places]
    sides = [(one, other) for one, other in sides if other]
    if not sides:
        return
    postures, shapes = _draw(hand)
    found = _move(hand, pads, postures)
    candidates = []
    for number, shape in enumerate(shapes):
        here = _Pads(*(column[number] for column in (found.point, found.normal, found.moving)))
        zones = [_zones(here, places[one], [places[f] for f in other]) for one, other in sides]
        candidates.append((shape, *(np.concatenate(columns) for columns in zip(*zones, strict=True))))
    for number in _chosen(hand, names, candidates):
        start, *columns = candidates[number]
        yield Entry(_angles(hand, start) if number else {}, np.column_stack(columns).tolist())


def opposing_sides(hand: Hand, names: tuple[str, ...]) -> Iterator[tuple[int, list[int]]]:
    """Yield one finger and the fingers that it may oppose: a thumb and some others; without a thumb, any two sides."""
    closing = [k for k, finger in enumerate(hand.fingers) if finger.name in names]
    thumbs = [k for k in closing if hand.fingers[k].is_thumb]
    others = [k for k in closing if k not in thumbs]
    for one in thumbs or closing:
        across = [k for k in others if k != one]
        if across:
            yield one, across
        if thumbs and len(across) > 2:
            yield one, across[:2]
        elif not thumbs and len(across) > 1:
            yield from ((one, [k]) for k in across)


def _draw(hand: Hand) -> tuple[FloatArray, list[FloatArray]]:
    """Return preshapes as postures at all shares of closing, (N, S, J), and the start of each, (J,) [rad]."""
    rng = np.random.default_rng(0)
    has_thumb = any(finger.is_thumb for finger in hand.fingers)
    postures, shapes = [], []
    for number in range(_DRAWS):
        q = np.array([j.open_value for j in hand.joints])
        spread = rng.random() < 0.5
        bent = float(rng.choice(_BENT)) if number else 0.0
        for finger in hand.fingers:
            for j in finger.joints:
                joint = hand.joints[j]
                if joint.role is not JointRole.POSTURE or not joint.upper > joint.lower or not number:
                    continue
                drawn = float(rng.uniform(joint.lower, joint.upper))
                if finger.is_thumb or not has_thumb:
                    q[j] = drawn
                elif spread:
                    q[j] = np.clip(q[j] + _SPREAD * (drawn - q[j]), joint.lower, joint.upper)
            share = bent * (float(rng.uniform(0.0, 1.0)) if finger.is_thumb else 1.0)
            for j in closing_joints_of(hand, finger)[1:]:
                q[j] += share * (closing_limit(hand, j) - q[j])
        start = hand.coupled(q)
        shapes.append(start)
        postures.append(_closed(hand, start))
    return np.array(postures), shapes


def _closed(hand: Hand, start: FloatArray) -> FloatArray:
    """Return a posture with the first closing joint of every finger closed by all shares, shape (S, J)."""
    q = np.repeat(start[None], len(_SHARES), axis=0)
    for finger in hand.fingers:
        for j in closing_joints_of(hand, finger)[:1]:
            q[:, j] += _SHARES * (closing_limit(hand, j) - q[:, j])
    return np.array([hand.coupled(row) for row in q])


def _move(hand: Hand, pads: Sequence[Pad], postures: FloatArray) -> _Pads:
    """Return the pads at postures (N, S, J): shapes (N, S, P, 3)."""
    flat = postures.reshape(-1, postures.shape[2])
    links = [pad.link for pad in pads]
    point, normal = np.array([pad.point for pad in pads]), np.array([pad.normal for pad in pads])
    poses = poses_at(hand, flat)[:, links]
    shape = (*postures.shape[:2], len(pads), 3)
    points = (np.einsum("npij,pj->npi", poses[..., :3, :3], point) + poses[..., :3, 3]).reshape(shape)
    normals = np.einsum("npij,pj->npi", poses[..., :3, :3], normal).reshape(shape)
    moved = np.gradient(points, axis=1)
    size = np.linalg.norm(moved, axis=-1, keepdims=True)
    return _Pads(points, normals, moved / np.where(size > 1e-9, size, 1.0))


def _zones(pads: _Pads, one: int, others: list[int]) -> tuple[FloatArray, ...]:
    """Return centres, axes, rows, apertures and qualities of the zones of two sides, at all pairs of shares."""
    group = pads.point[:, others].mean(axis=1)
    between = group[None] - pads.point[:, one][:, None]
    aperture = np.linalg.norm(between, axis=2)
    axis = between / np.maximum(aperture, 1e-9)[..., None]
    facing = np.minimum(
        np.einsum("abk,ak->ab", axis, pads.normal[:, one]),
        -np.einsum("abk,bok->abo", axis, pads.normal[:, others]).mean(axis=2),
    )
    closing = np.minimum(
        np.einsum("abk,ak->ab", axis, pads.moving[:, one]),
        -np.einsum("abk,bok->abo", axis, pads.moving[:, others]).mean(axis=2),
    )
    quality = (0.75 * facing + 0.25 * closing).ravel()
    center = (0.5 * (group[None] + pads.point[:, one][:, None])).reshape(-1, 3)
    well = (quality > WELL) & (aperture.ravel() < APERTURES[-1])
    row = np.broadcast_to(pads.point[:, others[-1]] - pads.point[:, others[0]], between.shape)
    row = row - np.einsum("abk,abk->ab", row, axis)[..., None] * axis
    columns = center, axis.reshape(-1, 3), row.reshape(-1, 3), aperture.ravel(), quality
    return tuple(column[well] for column in columns)


def _chosen(hand: Hand, names: tuple[str, ...], candidates: list[tuple[FloatArray, ...]]) -> list[int]:
    """Return the open hand and the best candidates of every aperture, without candidates whose closing has no
    certificate.

    The best of every aperture come first, then the second best, and so on.
    """
    best = np.full((len(candidates), len(APERTURES) - 1), -np.inf)
    for number, (*_, aperture, quality) in enumerate(candidates):
        if len(aperture):
            np.maximum.at(best[number], np.searchsorted(APERTURES, aperture, side="right") - 1, quality)
    chosen, refused = [0], set[int]()
    for rank in range(_PER_APERTURE):
        for column in best.T:
            order = np.argsort(-column, kind="stable")
            kept = 0
            for number in order[: len(order) // 2].tolist():
                if not column[number] > WELL or len(chosen) >= PRESHAPES or kept > rank:
                    break
                if number in chosen:
                    kept += 1
                elif number in refused or not _apart(candidates, chosen, number):
                    continue
                elif _closes(hand, names, candidates[number][0]):
                    chosen.append(number)
                    kept += 1
                else:
                    refused.add(number)
    return chosen


def _apart(candidates: list[tuple[FloatArray, ...]], chosen: list[int], number: int) -> bool:
    return all(np.abs(candidates[number][0] - candidates[c][0]).max() > _APART for c in chosen)


def _closes(hand: Hand, names: tuple[str, ...], start: FloatArray) -> bool:
    """Say whether the closing from a posture is certified without an object: some links interlock."""
    command = GraspCommand(hand_pose=Pose.identity(), preshape=_angles(hand, start), fingers=names, planes=1)
    far_away = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, _FAR]])
    return bool(BatchSolver(hand, _nothing(), command).solve(far_away, None, 1).certified[0])


@cache
def _nothing() -> GraspObject:
    return GraspObject.load("sphere:r=0.001")


def _angles(hand: Hand, start: FloatArray) -> dict[str, float]:
    """Return the angles that a command must name for a posture: joints off the open hand, without followers."""
    opened, followers = hand.open_angles(), {c.follower for c in hand.couplings}
    own: NDArray[np.intp] = np.array([j for finger in hand.fingers for j in finger.joints if j not in followers])
    return {hand.joints[j].name: float(start[j]) for j in own.tolist() if start[j] != opened[j]}
