"""List the pairs of links that may overlap: adjacent, excluded by the model or the hand file.

Shapes that overlap in every posture near the open one are allowed to as well; see `overlaps`.
"""

from __future__ import annotations

import itertools

import numpy as np

from clench.core.exceptions import UnknownNameError
from clench.models.hand.findings import Finding, FindingCode, quoted
from clench.models.hand.hand import Hand, Link
from clench.models.hand.hand_file import HandFile
from clench.models.hand.reading.compiled import CompiledModel
from clench.models.hand.reading.kinematics import Skeleton
from clench.models.hand.reading.link_geometry import collides

#: Number of pairs that a finding names at most.
_NAMED = 3


def allowed_pairs(compiled: CompiledModel, skeleton: Skeleton, links: tuple[Link, ...]) -> tuple[tuple[int, int], ...]:
    """Return the pairs of link indices that may overlap, sorted.

    Args:
        compiled: the model. skeleton: its kinematics. links: with shapes.
    """
    pairs = adjacent_pairs(links) | _excluded(compiled, skeleton)
    return tuple(sorted(pairs))


def with_given_pairs(hand: Hand, overrides: HandFile) -> tuple[tuple[int, int], ...]:
    """Return the hand's allowed pairs with those of the hand file.

    Raises:
        UnknownNameError: no such link.
    """
    names = [link.name for link in hand.links]
    pairs = set(hand.allowed_pairs)
    for pair in overrides.allowed_pairs:
        for name in pair:
            if name not in names:
                raise UnknownNameError("link", name, f"hand '{hand.name}' (allowed_pairs in {overrides.path})", names)
        pairs.add(_pair(*(names.index(name) for name in pair)))
    return tuple(sorted(pairs))


def check_excluded(hand: Hand) -> list[Finding]:
    """Return a finding that counts the pairs of links of different fingers that the model excludes.

    Args:
        hand: with fingers, and without the pairs of a hand file.
    """
    finger_of = {link: finger.name for finger in hand.fingers for link in finger.links}
    solid = {i for i, link in enumerate(hand.links) if any(link.shapes.values())}
    adjacent = adjacent_pairs(hand.links)
    pairs = [
        (hand.links[a].name, hand.links[b].name)
        for a, b in hand.allowed_pairs
        if {a, b} <= solid and (a, b) not in adjacent and len({finger_of.get(a), finger_of.get(b)} - {None}) == 2
    ]
    if not pairs:
        return []
    listed = ", ".join(f"{quoted((a,))} - {quoted((b,))}" for a, b in pairs[:_NAMED])
    more = ", …" if len(pairs) > _NAMED else ""
    count = (
        "One pair of links of different fingers is"
        if len(pairs) == 1
        else f"{len(pairs)} pairs of links of different fingers are"
    )
    return [
        Finding(
            FindingCode.PAIRS_EXCLUDED,
            f"{count} never checked against each other, because the model excludes them: {listed}{more}.",
            "Nothing to do, if these links cannot meet. Else remove their <exclude> from the model, or give their "
            "geoms contype and conaffinity that fit each other.",
            links=tuple(dict.fromkeys(name for pair in pairs for name in pair)),
            numbers={"pairs": len(pairs)},
        )
    ]


def _pair(a: int, b: int) -> tuple[int, int]:
    return (a, b) if a < b else (b, a)


def adjacent_pairs(links: tuple[Link, ...]) -> set[tuple[int, int]]:
    """Return pairs that are fixed to each other, and neighbours across one place of the chain.

    Links fixed to each other are one piece; several joints at one place (links without geometry between) are
    one neighbourhood.
    """
    piece: list[int] = []
    for i, link in enumerate(links):
        piece.append(i if link.joint >= 0 or link.parent < 0 else piece[link.parent])
    solid = {p for p, link in zip(piece, links, strict=True) if any(link.shapes.values())}
    up = {p: piece[links[p].parent] if links[p].parent >= 0 else -1 for p in set(piece)}

    def neighbour(p: int) -> int:
        p = up[p]
        while p >= 0 and p not in solid:
            p = up[p]
        return p

    return {
        _pair(a, b)
        for a, b in itertools.combinations(range(len(links)), 2)
        if piece[a] == piece[b] or neighbour(piece[a]) == piece[b] or neighbour(piece[b]) == piece[a]
    }


def _excluded(compiled: CompiledModel, skeleton: Skeleton) -> set[tuple[int, int]]:
    """Return pairs that the model excludes, by name or by its collision masks."""
    m = compiled.model
    link = skeleton.link_of_body
    pairs = set()
    for signature in m.exclude_signature:
        a, b = int(signature) >> 16, int(signature) & 0xFFFF
        if a in link and b in link:
            pairs.add(_pair(link[a], link[b]))
    masks = {}
    for body in link:
        geoms = range(int(m.body_geomadr[body]), int(m.body_geomadr[body]) + int(m.body_geomnum[body]))
        solid = [g for g in geoms if collides(m, g)]
        if solid:
            masks[body] = (
                int(np.bitwise_or.reduce(m.geom_contype[solid])),
                int(np.bitwise_or.reduce(m.geom_conaffinity[solid])),
            )
    for (a, (type_a, affinity_a)), (b, (type_b, affinity_b)) in itertools.combinations(masks.items(), 2):
        if not (type_a & affinity_b) and not (type_b & affinity_a):
            pairs.add(_pair(link[a], link[b]))
    return pairs
