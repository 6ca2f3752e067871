"""Check a hand before it is used: what loading found, links that overlap when it is open, thumbs."""

from __future__ import annotations

import itertools

import numpy as np

from clench.base.pose import FloatArray, invert
from clench.base.tolerances import ALLOWED_PENETRATION
from clench.models.hand.allowed import adjacent_pairs
from clench.models.hand.findings import Finding, FindingCode, Severity, in_hand_file
from clench.models.hand.hand import Hand
from clench.models.hand.opposition import check_thumbs
from clench.models.shapes import CollisionSource

from .depths import LinkMesh, link_meshes


def check_hand(hand: Hand, source: CollisionSource | str | None = None) -> tuple[Finding, ...]:
    """Return everything that looks wrong or is worth knowing about a hand, warnings first.

    Args:
        hand: see `Hand.load`. source: geometry of its links; None is the hand's default.
    """
    chosen = hand.default_source if source is None else CollisionSource(source)
    found = [*hand.findings, *_overlaps(hand, chosen), *check_thumbs(hand)]
    return tuple(sorted(found, key=lambda finding: finding.severity is Severity.NOTE))


def open_overlaps(hand: Hand, source: CollisionSource) -> list[tuple[int, int, float]]:
    """Return pairs of links that overlap at the open posture and how deep [m], adjacent ones left out.

    Round shapes are inscribed polyhedra, so a depth may be too small by `TESSELLATION_DEVIATION` for each side.
    """
    poses = hand.link_poses(hand.open_angles())
    adjacent = adjacent_pairs(hand.links)
    found = []
    for a, b in itertools.combinations(link_meshes(hand, source), 2):
        if (a.link, b.link) in adjacent:
            continue
        depth = overlap_depth(a, b, poses)
        if depth > ALLOWED_PENETRATION:
            found.append((a.link, b.link, depth))
    return found


def overlap_depth(a: LinkMesh, b: LinkMesh, poses: FloatArray) -> float:
    """Return how deep two links overlap [m], 0 when they do not.

    Args:
        a, b: the links. poses: of all links in the palm frame, shape (L, 4, 4).
    """
    from clench.kernels.depth import CROSSINGS, penetration
    from clench.kernels.tree import STACK_SIZE

    centers = [poses[m.link][:3, :3] @ m.center + poses[m.link][:3, 3] for m in (a, b)]
    if np.linalg.norm(centers[0] - centers[1]) > a.radius + b.radius:
        return 0.0
    T_b_a = invert(poses[b.link]) @ poses[a.link]
    depth, *_ = penetration(
        a.tree,
        a.owners,
        a.closed,
        b.tree,
        b.owners,
        b.closed,
        np.ascontiguousarray(T_b_a[:3]),
        np.ascontiguousarray(invert(T_b_a)[:3]),
        np.inf,
        np.empty(CROSSINGS),
        np.empty(STACK_SIZE, dtype=np.int32),
    )
    return float(depth)


def _overlaps(hand: Hand, source: CollisionSource) -> list[Finding]:
    allowed = set(hand.allowed_pairs)
    found = []
    for a, b, depth in open_overlaps(hand, source):
        names = (hand.links[a].name, hand.links[b].name)
        numbers = {"depth_m": depth}
        text = f"Links '{names[0]}' and '{names[1]}' overlap by {depth * 1e3:.3g} mm at the open posture"
        if (a, b) in allowed:
            found.append(
                Finding(
                    FindingCode.OVERLAP_ALLOWED,
                    f"{text}; they may, since the model excludes the pair or starts with it overlapping.",
                    "Nothing to do, unless these links meet on the real hand while it closes: then slim their shapes.",
                    Severity.NOTE,
                    links=names,
                    numbers=numbers,
                )
            )
            continue
        mover = _moving_joint(hand, a, b)
        pair = f'allowed_pairs = [["{names[0]}", "{names[1]}"]]'
        lines = [pair] if mover is None else [pair, in_hand_file("joints", mover, "open = ...")]
        advice = (
            "Fingers that start so are solved but not certified. If the shapes are only coarse there, or the hand "
            f"opens differently, write in the hand file {', or '.join(lines)}."
        )
        found.append(Finding(FindingCode.SELF_COLLISION_AT_OPEN, f"{text}.", advice, links=names, numbers=numbers))
    return found


def _moving_joint(hand: Hand, a: int, b: int) -> str | None:
    """Return the name of the joint nearest before one of two links, or None."""
    for link in (b, a):
        while link >= 0 and hand.links[link].joint < 0:
            link = hand.links[link].parent
        if link >= 0 and hand.links[link].joint >= 0:
            return hand.joints[hand.links[link].joint].name
    return None
