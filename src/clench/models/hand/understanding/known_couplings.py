"""Report couplings that makers publish and often leave out of their files; clench never adds them by itself."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from clench.models.hand.findings import Finding, FindingCode, Severity, quoted, table_header
from clench.models.hand.hand import Finger, Hand, JointRole


@dataclass(frozen=True)
class KnownCoupling:
    """State a published coupling: both joints close together.

    Args:
        hand: its name. leader, follower: patterns of whole joint names, apart from prefixes; `{}` in the follower's is
            the leader's group.
        ratio: of their closing angles [-]. offset: [rad]. breakaway: the follower goes on when the leader is stopped.
        distal: the follower is the finger's last joint. source: who publishes it.
    """

    hand: str
    leader: str
    follower: str
    ratio: float
    source: str
    offset: float = 0.0
    breakaway: bool = False
    distal: bool = True


_BARRETT: Final = "https://support.barrett.com/wiki/Hand/280/KinematicsJointRangesConversionFactors"
_SVH: Final = "schunk_svh_description, the maker's ROS package"

KNOWN_COUPLINGS: Final = (
    # Motor to joint 125:1 and, by a cable over the base, 93.75:1: the distal joint turns by 125/93.75 - 1 of the other.
    KnownCoupling(
        "BarrettHand BH8-280", r"(finger_?\d_)med(?:_joint)?", "{}dist(?:_joint)?", 1 / 3, _BARRETT, breakaway=True
    ),
    KnownCoupling(
        "PSYONIC Ability Hand",
        r"((?:index|middle|ring|pinky)_)q1",
        "{}q2",
        1.05851325,
        "the maker's MuJoCo simulator, github.com/psyonicinc/ability-hand-api",
        offset=0.72349796,
    ),
    # One tendon pulls both, in equal shares as in MuJoCo Menagerie's model.
    KnownCoupling(
        "Shadow Dexterous Hand",
        r"((?:FF|MF|RF|LF)J)2",
        "{}1",
        1.0,
        "one tendon for both joints, github.com/google-deepmind/mujoco_menagerie (shadow_hand)",
        breakaway=True,
    ),
    KnownCoupling("SCHUNK SVH", "()Thumb_Flexion", "j3", 1.01511, _SVH, distal=False),
    KnownCoupling("SCHUNK SVH", "()Thumb_Flexion", "j4", 1.44889, _SVH),
    KnownCoupling("SCHUNK SVH", "()Ring_Finger", "j12", 1.3588, _SVH, distal=False),
    KnownCoupling("SCHUNK SVH", "()Ring_Finger", "j16", 1.42093, _SVH),
    KnownCoupling("SCHUNK SVH", "()Pinky", "j13", 1.3588, _SVH, distal=False),
    KnownCoupling("SCHUNK SVH", "()Pinky", "j17", 1.42307, _SVH),
    KnownCoupling("SCHUNK SVH", "()Index_Finger_Distal", "j14", 1.045, _SVH),
    KnownCoupling("SCHUNK SVH", "()Middle_Finger_Distal", "j15", 1.0454, _SVH),
)


def check_couplings(hand: Hand) -> list[Finding]:
    """Return a finding for every hand whose file leaves out couplings that are published, with lines that add them."""
    tied = {c.follower for c in hand.couplings}
    found: dict[str, list[tuple[KnownCoupling, int, int]]] = {}
    for finger in hand.fingers:
        for known in KNOWN_COUPLINGS:
            for leader, follower in _matches(hand, finger, known):
                if follower not in tied:
                    found.setdefault(known.hand, []).append((known, leader, follower))
    return [_missing(hand, name, pairs) for name, pairs in found.items()]


def _matches(hand: Hand, finger: Finger, known: KnownCoupling) -> list[tuple[int, int]]:
    """Return leader and follower among the closing joints of a finger."""
    closing = [j for j in finger.joints if hand.joints[j].role is JointRole.CLOSING]
    found = []
    for leader in closing:
        match = re.fullmatch(rf"(.*?)(?<![A-Za-z]){known.leader}", hand.joints[leader].name)
        if match is None:
            continue
        wanted = re.escape(match[1]) + known.follower.format(re.escape(match[2]))
        later = [j for j in closing if j != leader and re.fullmatch(wanted, hand.joints[j].name)]
        found += [(leader, j) for j in later if not known.distal or j == finger.joints[-1]]
    return found


def _missing(hand: Hand, name: str, pairs: list[tuple[KnownCoupling, int, int]]) -> Finding:
    rules, lines = [], []
    for known, leader, follower in pairs:
        one, other = hand.joints[leader], hand.joints[follower]
        ratio, offset = known.ratio * one.direction * other.direction, known.offset * other.direction
        shift = f" {offset:+.6g} rad" if offset else ""
        rules.append(f"'{other.name}' = {ratio:.6g} x '{one.name}'{shift}")
        lines += [table_header("joints", other.name), f'follows = "{one.name}"', f"ratio = {ratio:.12g}"]
        lines += [f"offset = {offset:.12g}"] if offset else []
        lines += ["breakaway = true"] if known.breakaway else []
    sources = ", ".join(dict.fromkeys(known.source for known, _, _ in pairs))
    joints = tuple(hand.joints[follower].name for _, _, follower in pairs)
    return Finding(
        FindingCode.COUPLING_MISSING,
        f"The joints look like those of the {name}, and the maker's file leaves out the coupling of {quoted(joints)}: "
        f"{'; '.join(rules)} (source: {sources}).",
        "If it is this hand, write in the hand file:\n" + "\n".join(lines),
        Severity.WARNING,
        joints=joints,
    )
