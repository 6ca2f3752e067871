"""Separate links that always overlap, like those of a knuckle, from links that overlap only in some postures."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from clench.core.pose import FloatArray
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.hand.hand import Hand, JointRole
from clench.models.hand.link_mesh import LinkMesh, link_meshes, overlap_depth
from clench.models.shapes import CollisionSource

Pairs = frozenset[tuple[int, int]]

#: Shares of the way to its limits by which each joint is turned alone [-].
_ALONE = (-1.0, -0.5, -0.1, 0.1, 0.5, 1.0)
#: Postures in which all joints between two links turn simultaneously.
_DRAWS = 16


class Overlaps(NamedTuple):
    """Pairs of link indices that overlap in the open hand, without pairs that the model excludes.

    Args:
        always: pairs that overlap in every sampled posture.
        when_open: pairs of one finger's links, or of a finger and the palm, that are free in other postures.
    """

    always: Pairs
    when_open: Pairs


NO_OVERLAPS = Overlaps(frozenset(), frozenset())


def find_overlaps(hand: Hand, source: CollisionSource) -> Overlaps:
    """Find the pairs of links that overlap when the hand is open, and look for a posture in which they are free.

    Args:
        source: shapes of the links. source: which shapes the links have.
    """
    start = hand.open_angles()
    poses = hand.link_poses(start)
    always, when_open = set(), set()
    for a, b in itertools.combinations(link_meshes(hand, source), 2):
        pair = (a.link, b.link)
        if pair in hand.allowed_pairs or overlap_depth(a, b, poses) <= ALLOWED_PENETRATION:
            continue
        if all(_overlap(hand, a, b, q) for q in _postures(hand, start, *pair)):
            always.add(pair)
        elif not _of_two_fingers(hand, *pair):
            when_open.add(pair)
    return Overlaps(frozenset(always), frozenset(when_open))


def overlapping(hand: Hand, source: CollisionSource, pairs: Iterable[tuple[int, int]], q: FloatArray) -> Pairs:
    """Return the pairs of link indices that overlap at a posture.

    Args:
        hand: the hand. source: which shapes its links have. pairs: which are looked at. q: all angles [rad], (J,).
    """
    meshes = {mesh.link: mesh for mesh in link_meshes(hand, source)}
    return frozenset(pair for pair in pairs if _overlap(hand, meshes[pair[0]], meshes[pair[1]], q))


def _overlap(hand: Hand, a: LinkMesh, b: LinkMesh, q: FloatArray) -> bool:
    return overlap_depth(a, b, hand.link_poses(q)) > ALLOWED_PENETRATION


def _postures(hand: Hand, start: FloatArray, a: int, b: int) -> Iterator[FloatArray]:
    """Yield postures [rad] that differ in the joints between two links; the same ones at every call."""
    leaders = {c.follower: c.leader for c in hand.couplings}
    turned = sorted({leaders.get(j, j) for j in _joints_above(hand, a) ^ _joints_above(hand, b)})
    turned = [j for j in turned if hand.joints[j].role is not JointRole.UPSTREAM]
    low, high = (np.array([getattr(hand.joints[j], limit) for j in turned]) for limit in ("lower", "upper"))
    for k, j in enumerate(turned):
        for share in _ALONE:
            q = start.copy()
            q[j] += share * (high[k] - start[j] if share > 0.0 else start[j] - low[k])
            yield hand.coupled(q)
    rng = np.random.default_rng(0)
    for _ in range(_DRAWS if turned else 0):
        q = start.copy()
        q[turned] = rng.uniform(low, high)
        yield hand.coupled(q)


def _of_two_fingers(hand: Hand, a: int, b: int) -> bool:
    owners = [next((f.name for f in hand.fingers if link in f.links), None) for link in (a, b)]
    return None not in owners and owners[0] != owners[1]


def _joints_above(hand: Hand, link: int) -> set[int]:
    """Return the joints between a link and the model's root."""
    found = set()
    while link >= 0:
        found.add(hand.links[link].joint)
        link = hand.links[link].parent
    return found - {-1}
