"""Check a hand before its use: findings of the loader, links that overlap in the open hand, thumbs."""

from __future__ import annotations

import itertools

from clench.core.argument_types import check_type
from clench.core.showing.visible_text import visible
from clench.core.tolerances import ALLOWED_PENETRATION
from clench.models.hand.findings import Finding, FindingCode, Severity, in_hand_file
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes, overlap_depth
from clench.models.hand.understanding.allowed_pairs import adjacent_pairs
from clench.models.hand.understanding.hulls import check_hulls
from clench.models.hand.understanding.opposition import check_thumbs
from clench.models.shapes import CollisionSource


def check_hand(hand: Hand, source: CollisionSource | str | None = None) -> tuple[Finding, ...]:
    """Return everything that looks wrong or is worth knowing about a hand, warnings first.

    Args:
        hand: see `Hand.load`. source: geometry of its links; None is the hand's default.
    """
    check_type(hand, Hand, "hand")
    chosen = hand.default_source if source is None else CollisionSource(source)
    found = [*hand.findings, *_overlaps(hand, chosen), *check_thumbs(hand)]
    if chosen is CollisionSource.ENGINE:
        found += check_hulls(hand)
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


def _overlaps(hand: Hand, source: CollisionSource) -> list[Finding]:
    always = set(hand.allowed_pairs_for(source))
    allowed = set(hand.allowed_pairs_from(source, hand.open_angles()))
    found = []
    for a, b, depth in open_overlaps(hand, source):
        names = (hand.links[a].name, hand.links[b].name)
        numbers = {"depth_m": depth}
        text = f"Links '{names[0]}' and '{names[1]}' overlap by {depth * 1e3:.3g} mm at the open posture"
        if (a, b) in allowed:
            why = "they may, since the model excludes the pair or they overlap in every posture that was looked at"
            if (a, b) not in always:
                why = "a motion that starts so may go on so, and one that starts with them apart keeps them apart"
            found.append(
                Finding(
                    FindingCode.OVERLAP_ALLOWED,
                    f"{text}; {why}.",
                    "Nothing to do, unless these links meet on the real hand while it closes: then slim their shapes.",
                    Severity.NOTE,
                    links=names,
                    numbers=numbers,
                )
            )
            continue
        mover = _moving_joint(hand, a, b)
        pair = f'allowed_pairs = [["{visible(names[0])}", "{visible(names[1])}"]]'
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
