"""Propose where the palm goes: the zones of a hand on the opposing pairs of an object (docs/method.md section 9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.solver.preshapes.preshapes import Preshape

from .pairs import Pairs

#: A zone's pads are farther apart than the pair by up to this [m].
_ROOM = 0.01
#: Pairs that are looked at for every proposal, and how far a zone's aperture may miss [m].
_LOOKS = 12
_MISS = 0.012
#: Weight of good opposition against an aperture error [-].
_OPPOSED = 6.0
#: Share of the proposals that vary a good one, once there are so many good ones [-].
VARIED = 0.7
_ENOUGH_GOOD = 3
#: Standard deviations of a variation: turn [rad] and shift [m].
_TURN, _SHIFT = 0.15, 0.005
#: Rows of pads longer than this [m] are laid along the object's long side. They are laid so as often as the object is
#: longer than wide times this [-], and askew by this [rad].
_ROW, _ALIGNED, _ASKEW = 0.01, 1.2, 0.25
#: Distance that a hand of a deep arm may go past its place [m].
DEEP = 0.06
#: Shares of the proposals go to arms by the power of their success [-].
_GREED = 2.0


@dataclass(frozen=True)
class Arm:
    """One way of proposing.

    Args:
        shape: number of the preshape. fingers: names of the closing fingers.
        deep: the hand goes on past its place until the palm is at the object.
    """

    shape: int
    fingers: tuple[str, ...]
    deep: bool


@dataclass(frozen=True, eq=False)
class Proposals:
    """N places of the palm.

    Args:
        arm: number of the arm, shape (N,). T_object_palm: shape (N, 4, 4). center: of the zone in the palm frame [m],
            shape (N, 3).
    """

    arm: NDArray[np.int64]
    T_object_palm: FloatArray
    center: FloatArray

    def __len__(self) -> int:
        return len(self.arm)

    def taken(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Proposals:
        """Return some of them."""
        return Proposals(self.arm[rows], self.T_object_palm[rows], self.center[rows])


@dataclass(eq=False)
class Proposer:
    """Draw proposals; ways that gave good grasps are drawn more often.

    Args:
        arms: the ways. shapes: the preshapes by number of the arm's. pairs: of the object.
    """

    arms: tuple[Arm, ...]
    shapes: tuple[Preshape, ...]
    pairs: Pairs

    def __post_init__(self) -> None:
        """Start with the estimates from the zones."""
        promise = np.array([self._promise(arm) for arm in self.arms])
        self._tried, self._good = np.full(len(self.arms), 2.0), 2.0 * promise
        self._usable = promise > 0.0
        self._best: list[tuple[float, int, FloatArray, FloatArray]] = []

    @property
    def is_hopeless(self) -> bool:
        """Whether no zone of the hand spans a pair of the object."""
        return not self._usable.any()

    def draw(self, rng: np.random.Generator, count: int) -> Proposals:
        """Return so many proposals."""
        varied = int(VARIED * count) if len(self._best) >= _ENOUGH_GOOD else 0
        parts = [self._fresh(rng, count - varied)]
        if varied:
            parts.append(self._varied(rng, varied))
        return Proposals(
            *(np.concatenate(c) for c in zip(*((p.arm, p.T_object_palm, p.center) for p in parts), strict=True))
        )

    def learn(self, proposals: Proposals, score: FloatArray, keep: int = 64) -> None:
        """Learn from the results of proposals.

        Args:
            proposals: the closed ones. score: how good each is, 0 for no use, shape (N,).
            keep: how many good ones are varied, the best ones.
        """
        np.add.at(self._tried, proposals.arm, 1.0)
        np.add.at(self._good, proposals.arm[score > 0.0], 1.0)
        for n in np.flatnonzero(score > 0.0):
            self._best.append((float(score[n]), int(proposals.arm[n]), proposals.T_object_palm[n], proposals.center[n]))
        self._best.sort(key=lambda found: -found[0])
        del self._best[keep:]

    def _promise(self, arm: Arm) -> float:
        """Return how well an arm's zones oppose at the widths of the pairs [-]; 0 when none fits."""
        shape = self.shapes[arm.shape]
        if not len(shape.aperture) or not len(self.pairs):
            return 0.0
        low, high = (np.searchsorted(self.pairs.width, shape.aperture + m) for m in (-_ROOM - _MISS, _MISS))
        spanned = high > low
        return float(shape.quality[spanned].max(initial=0.0)) * (0.5 if arm.deep else 1.0)

    def _fresh(self, rng: np.random.Generator, count: int) -> Proposals:
        success = np.where(self._usable, (self._good / self._tried) ** _GREED, 0.0)
        arm = np.sort(rng.choice(len(self.arms), count, p=success / success.sum()))
        looks = rng.integers(len(self.pairs), size=(count, _LOOKS))
        room, noise = rng.uniform(0.0, _ROOM, (count, _LOOKS)), rng.gumbel(size=(count, _LOOKS))
        pick = rng.random(count)
        centers, axes, rows_of = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
        pair = np.empty(count, dtype=np.int64)
        for a in np.unique(arm):
            rows, shape = np.flatnonzero(arm == a), self.shapes[self.arms[a].shape]
            wanted = self.pairs.width[looks[rows]] + room[rows]
            miss = np.abs(wanted[..., None] - shape.aperture)
            cost = np.maximum(miss - _MISS, 0.0) / 0.002 + miss / _MISS - _OPPOSED * shape.quality
            look = np.argmin(cost.min(axis=2) - 0.3 * noise[rows], axis=1)
            here = cost[np.arange(len(rows)), look]
            # Zones that are about as good as the best one share the proposals.
            near = here < here.min(axis=1, keepdims=True) + 0.5
            zone = np.argmax(np.cumsum(near, axis=1) > (pick[rows] * near.sum(axis=1))[:, None], axis=1)
            centers[rows], axes[rows], pair[rows] = shape.center[zone], shape.axis[zone], looks[rows, look]
            rows_of[rows] = shape.row[zone]
        way = self.pairs.way[pair]
        T = np.zeros((count, 4, 4))
        turn = frames(way) @ frames(axes).transpose(0, 2, 1)
        roll = self._roll(rng, pair, np.einsum("nij,nj->ni", turn, rows_of))
        T[:, :3, :3] = turns_about(way, roll) @ turn
        T[:, :3, 3] = self.pairs.middle[pair] - np.einsum("nij,nj->ni", T[:, :3, :3], centers)
        T[:, 3, 3] = 1.0
        return Proposals(arm.astype(np.int64), T, centers)

    def _roll(self, rng: np.random.Generator, pair: NDArray[np.int64], row: FloatArray) -> FloatArray:
        """Return the rolls of hands about the lines of pairs that lay rows of pads along the object's long side, (N,)
        [rad].

        Args:
            rng: draws. pair: which pairs, (N,). row: of pads, in the object's frame, not turned yet [m], (N, 3).
        """
        count, way, along = len(pair), self.pairs.way[pair], self.pairs.along[pair]
        sine, cosine = (np.cross(row, along) * way).sum(axis=1), (row * along).sum(axis=1)
        straight = np.arctan2(sine, cosine) + np.pi * rng.integers(2, size=count) + _ASKEW * rng.normal(size=count)
        aligned = (rng.random(count) < _ALIGNED * self.pairs.longer[pair]) & (np.linalg.norm(row, axis=1) > _ROW)
        return np.where(aligned, straight, rng.uniform(0.0, 2.0 * np.pi, count))

    def _varied(self, rng: np.random.Generator, count: int) -> Proposals:
        # The better one of two good ones: better ones are varied more often.
        chosen = rng.integers(len(self._best), size=(count, 2)).min(axis=1)
        arm = np.array([self._best[k][1] for k in chosen], dtype=np.int64)
        T, center = np.array([self._best[k][2] for k in chosen]), np.array([self._best[k][3] for k in chosen])
        return Proposals(arm, vary(rng, T, center, _TURN, _SHIFT), center)


def vary(rng: np.random.Generator, T: FloatArray, center: FloatArray, turn: float, shift: float) -> FloatArray:
    """Return poses turned about a point and shifted at random, shape (N, 4, 4).

    Args:
        T: poses, shape (N, 4, 4). center: the point in the frame that is turned [m], shape (N, 3).
        turn, shift: standard deviations of every component [rad], [m].
    """
    vector = rng.normal(size=(len(T), 3)) * turn
    angle = np.linalg.norm(vector, axis=1)
    R = turns_about(vector / np.maximum(angle, 1e-12)[:, None], angle)
    moved = T.copy()
    moved[:, :3, :3] = T[:, :3, :3] @ R
    away = center - np.einsum("nij,nj->ni", R, center) + rng.normal(size=(len(T), 3)) * shift
    moved[:, :3, 3] += np.einsum("nij,nj->ni", T[:, :3, :3], away)
    return moved


def frames(first: FloatArray) -> FloatArray:
    """Return right-handed frames with the given first axes, in columns, shape (N, 3, 3)."""
    least = np.eye(3)[np.abs(first).argmin(axis=1)]
    second = np.cross(first, least)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=2)


def turns_about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Return rotations about unit axes (N, 3) by angles (N,) [rad], shape (N, 3, 3)."""
    K = np.zeros((len(axis), 3, 3))
    K[:, [2, 0, 1], [1, 2, 0]] = axis
    K[:, [1, 2, 0], [2, 0, 1]] = -axis
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    turned: FloatArray = np.eye(3) + s * K + (1.0 - c) * (K @ K)
    return turned
