"""Split the subtree of the palm into fingers: serial chains of revolute joints from the palm to the tip."""

from __future__ import annotations

import numpy as np

from clench.core.exceptions import FileError, HandError, UnknownNameError
from clench.core.pose import FloatArray
from clench.models.hand.findings import Finding, FindingCode, quoted
from clench.models.hand.hand import Finger, Hand, Link
from clench.models.hand.hand_file import FingerOverride, HandFile

from .finger_geometry import link_reach
from .finger_names import names_thumb, place_names, short_names

#: A finger is a thumb when its likeness to the others is so much lower than theirs to each other [-].
_THUMB_UNLIKE = 0.6
#: Links that reach equally far differ by less than this [m]; the one later in the chain is the tip then.
_SAME_REACH = 1e-4


def own_chains(hand: Hand) -> list[tuple[int, ...]]:
    """Return the own joints of every finger, palm side first; a joint that several fingers share belongs to none.

    Args:
        hand: links, joints and palm are used.
    """
    paths = {i: _joints_from_palm(hand, i) for i in range(len(hand.links))}
    chains = {path for path in paths.values() if path}
    leaves = sorted(c for c in chains if not any(o != c and o[: len(c)] == c for o in chains))
    own = []
    for chain in leaves:
        others = {j for c in leaves if c != chain for j in c}
        own.append(tuple(j for j in chain if j not in others))
    return sorted(own)


def find_fingers(hand: Hand, overrides: HandFile) -> tuple[tuple[Finger, ...], list[Finding]]:
    """Return the fingers, named by their joints and links (thumbs by name only), and the findings.

    Raises:
        UnknownNameError, FileError: the hand file names an unknown joint or link.
        HandError: no chain of joints moves any geometry.
    """
    found = own_chains(hand)
    chains = [chain for chain in found if _with_shape(hand, chain)]
    findings = [_bare_chain(hand, c) for c in found if c not in chains]
    if not chains:
        raise HandError(f"{hand.name}: has no closing joint: no joint below the palm moves any geometry.")
    if len(chains) == 1:
        findings.append(
            Finding(
                FindingCode.ONE_FINGER,
                "The hand has only one finger.",
                "If there should be more, look at the joints that made none, or name the palm (--palm).",
            )
        )
    given = {name: o for name, o in overrides.fingers.items() if o.joints is not None}
    if given:
        named = {name: _given_chain(hand, name, o, overrides) for name, o in given.items()}
        taken = {j for chain in named.values() for j in chain}
        chains = [c for c in (tuple(j for j in chain if j not in taken) for chain in chains) if c]
    else:
        named = {}
    links = [_links_of(hand, chain) for chain in chains]
    names = short_names(
        [[hand.joints[j].name for j in chain] for chain in chains],
        [[hand.links[i].name for i in members] for members in links],
    )
    fingers = [_finger(hand, name, chain) for name, chain in zip(names, chains, strict=True) if name not in named]
    fingers += [_finger(hand, name, chain) for name, chain in named.items()]
    return tuple(sorted(fingers, key=lambda f: f.joints[0])), findings


def _bare_chain(hand: Hand, chain: tuple[int, ...]) -> Finding:
    return Finding(
        FindingCode.NO_SHAPE,
        f"Joints {_quoted(hand, chain)} move no geometry; they make no finger.",
        "Give the links that they move a collision or visual shape in the model, if this is a finger.",
        joints=tuple(hand.joints[j].name for j in chain),
    )


def find_thumb(fingers: tuple[Finger, ...], stretch: FloatArray, closing: FloatArray) -> int | None:
    """Return the finger that opposes the others, or None if no finger stands out.

    Args:
        fingers: a name that says thumb decides.
        stretch: unit vectors from base to tip, shape (F, 3). closing: unit closing directions of the tips, (F, 3).
    """
    named = [i for i, f in enumerate(fingers) if f.is_thumb]
    if named or len(fingers) < 3:
        return named[0] if named else None
    likeness = stretch @ stretch.T + closing @ closing.T
    np.fill_diagonal(likeness, 0.0)
    n = len(fingers)
    to_others = likeness.sum(axis=1) / (n - 1)
    thumb = int(np.argmin(to_others))
    rest = [i for i in range(n) if i != thumb]
    among = likeness[np.ix_(rest, rest)].sum() / max(1, (n - 1) * (n - 2))
    return thumb if among - to_others[thumb] > _THUMB_UNLIKE else None


def row_places(bases: FloatArray, thumb: int | None, thumb_tip: FloatArray) -> list[float]:
    """Return where every finger stands in the row of the fingers other than the thumb, from the thumb's side [m].

    Args:
        bases: anchor of every finger's first joint [m], shape (F, 3). thumb: its index. thumb_tip: its tip [m].
    """
    others = [i for i in range(len(bases)) if i != thumb]
    if thumb is None or len(others) < 2:
        return [0.0] * len(bases)
    middle = bases[others].mean(axis=0)
    row = np.linalg.svd(bases[others] - middle)[2][0]
    towards_thumb = 1.0 if (thumb_tip - middle) @ row >= 0.0 else -1.0
    return [float(-towards_thumb * (b - middle) @ row) for b in bases]


def name_fingers(hand: Hand, thumb: int | None, places: list[float], overrides: HandFile) -> tuple[Finger, ...]:
    """Return the fingers with the missing names, the thumb, and the hand file's entries.

    Args:
        hand: with fingers. thumb: its index. places: along the row of fingers, from the thumb's side [m].

    Raises:
        UnknownNameError: the hand file names a finger or link that does not exist.
    """
    names = place_names(places, thumb, [f.name for f in hand.fingers])
    for name in overrides.fingers:
        if name not in names:
            raise UnknownNameError("finger", name, f"hand '{hand.name}' (named by {overrides.path})", names)
    fingers = []
    for i, (name, finger) in enumerate(zip(names, hand.fingers, strict=True)):
        override = overrides.fingers.get(name, FingerOverride())
        is_thumb = i == thumb if override.thumb is None else override.thumb
        tip = finger.tip_link if override.tip is None else hand.link_index(override.tip)
        if tip not in finger.links:
            links = ", ".join(hand.links[k].name for k in finger.links)
            raise FileError(
                overrides.path, f"fingers.{name}.tip: link '{override.tip}' is not in this finger. Links: {links}."
            )
        if not any(hand.links[tip].shapes.values()):
            raise FileError(overrides.path, f"fingers.{name}.tip: link '{override.tip}' has no geometry.")
        fingers.append(Finger(name, finger.links, finger.joints, is_thumb, tip))
    return tuple(fingers)


def fixed_links(links: tuple[Link, ...], fingers: tuple[Finger, ...], palm: int) -> tuple[int, ...]:
    """Return the links that no finger moves and that an object can hit; the palm is always one."""
    moved = {i for f in fingers for i in f.links}
    return tuple(i for i, link in enumerate(links) if i not in moved and (i == palm or any(link.shapes.values())))


def _joints_from_palm(hand: Hand, link: int) -> tuple[int, ...]:
    """Return the joints between the palm and a link below it; empty elsewhere."""
    joints: list[int] = []
    while link != hand.palm:
        if link < 0:
            return ()
        if hand.links[link].joint >= 0:
            joints.append(hand.links[link].joint)
        link = hand.links[link].parent
    return tuple(joints[::-1])


def _links_of(hand: Hand, chain: tuple[int, ...]) -> tuple[int, ...]:
    """Return the links whose nearest joint is one of the chain."""
    own = set(chain)
    found = []
    for i in range(len(hand.links)):
        path = _joints_from_palm(hand, i)
        if path and path[-1] in own:
            found.append(i)
    return tuple(found)


def _finger(hand: Hand, name: str, chain: tuple[int, ...]) -> Finger:
    with_shape = _with_shape(hand, chain)
    if not with_shape:
        raise HandError(f"{hand.name}: no link moved by the joints {_quoted(hand, chain)} has any geometry.")
    return Finger(name, _links_of(hand, chain), chain, names_thumb(name), _tip_link(hand, chain, with_shape))


def _tip_link(hand: Hand, chain: tuple[int, ...], links: list[int]) -> int:
    """Return a finger's most distal link: past the most joints and, among equals, with the farthest reach.

    The order of links in the file tells nothing: a pad on a proximal link may come after all that moves beyond it.
    """
    place = {joint: n for n, joint in enumerate(chain)}
    depths = {i: place[_joints_from_palm(hand, i)[-1]] for i in links}
    last = [i for i in links if depths[i] == max(depths.values())]
    return max(last, key=lambda i: (round(link_reach(hand, i) / _SAME_REACH), i))


def _with_shape(hand: Hand, chain: tuple[int, ...]) -> list[int]:
    return [i for i in _links_of(hand, chain) if any(hand.links[i].shapes.values())]


def _quoted(hand: Hand, chain: tuple[int, ...]) -> str:
    return quoted([hand.joints[j].name for j in chain])


def _given_chain(hand: Hand, name: str, override: FingerOverride, overrides: HandFile) -> tuple[int, ...]:
    """Return the joint indices that a hand file lists, checked to be one chain below the palm."""
    assert override.joints is not None
    owner = f"hand '{hand.name}' (fingers.{name}.joints in {overrides.path})"
    for joint in override.joints:
        if joint not in hand.joint_names:
            raise UnknownNameError("joint", joint, owner, hand.joint_names)
    chain = tuple(hand.joint_index(joint) for joint in override.joints)
    paths = [_joints_from_palm(hand, i) for i in range(len(hand.links))]
    if not any(tuple(j for j in path if j in chain) == chain for path in paths):
        raise FileError(
            overrides.path, f"fingers.{name}.joints: expected one chain of joints below the palm, palm side first."
        )
    return chain
