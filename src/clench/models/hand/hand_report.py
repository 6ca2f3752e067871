"""Describe the interpretation of a hand, with the reasons: the output of `clench hand`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from clench.models.shapes import CollisionSource

from .findings import Finding
from .hand import Hand


@dataclass(frozen=True)
class JointReport:
    """Describe one joint; angles in rad."""

    name: str
    finger: str | None
    role: str
    role_reason: str
    direction: int | None
    direction_reason: str
    open_value: float
    open_reason: str
    lower: float
    upper: float
    velocity: float | None
    effort: float | None
    follows: str | None
    ratio: float | None
    offset: float | None
    coupling_reason: str


@dataclass(frozen=True)
class FingerReport:
    """Describe one finger: length from its first joint to its tip when open [m]."""

    name: str
    is_thumb: bool
    joints: tuple[str, ...]
    links: tuple[str, ...]
    tip_link: str
    length: float


@dataclass(frozen=True)
class LinkReport:
    """Describe one link: kinds of its shapes and number of triangles by collision source."""

    name: str
    parent: str | None
    joint: str | None
    shapes: Mapping[str, tuple[str, ...]]
    triangles: Mapping[str, int]


@dataclass(frozen=True)
class HandReport:
    """Describe a hand; rows for tables come from the `…_rows` methods, text only.

    Args:
        palm_center [m], palm_normal: in the palm frame. Others as in `Hand`.
    """

    name: str
    path: str | None
    palm: str
    palm_center: tuple[float, ...]
    palm_normal: tuple[float, ...]
    collision_source: str
    degrees_of_freedom: int
    fingers: tuple[FingerReport, ...]
    joints: tuple[JointReport, ...]
    links: tuple[LinkReport, ...]
    fixed_links: tuple[str, ...]
    allowed_pairs: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    findings: tuple[Finding, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)

    def summary_rows(self) -> list[tuple[str, str]]:
        """Return label and text: palm frame, centre, normal, counts."""
        return [
            ("hand", self.name if self.path is None else f"{self.name} ({self.path})"),
            ("palm link", f"{self.palm} (its frame is the pose that a command gives)"),
            ("palm centre", f"{_vector(self.palm_center)} m, centroid of the finger bases"),
            ("palm normal", f"{_vector(self.palm_normal)}, the side on which the fingers close"),
            ("fingers", ", ".join(f.name + (" (thumb)" if f.is_thumb else "") for f in self.fingers)),
            ("degrees of freedom", f"{self.degrees_of_freedom} ({len(self.joints)} joints)"),
            ("collision source", self.collision_source),
            ("fixed links", ", ".join(self.fixed_links)),
        ]

    def joint_rows(self) -> list[tuple[str, str, str, str, str, str, str]]:
        """Return finger, joint, role, direction, open value, limits [deg], and the reasons, for every joint."""
        return [_joint_row(j) for j in self.joints]

    def coupling_rows(self) -> list[tuple[str, str, str]]:
        """Return follower, rule and reason of every coupling."""
        return [
            (j.name, f"{j.ratio:g} x {j.follows}" + (f" {j.offset:+.4g} rad" if j.offset else ""), j.coupling_reason)
            for j in self.joints
            if j.follows is not None and j.ratio is not None
        ]


def describe_hand(hand: Hand, findings: tuple[Finding, ...] | None = None) -> HandReport:
    """Return the interpretation of a hand.

    Args:
        hand: as loaded. findings: of a closer look; None: findings of the loader.
    """
    return HandReport(
        name=hand.name,
        path=None if hand.path is None else str(hand.path),
        palm=hand.links[hand.palm].name,
        palm_center=tuple(float(x) for x in hand.palm_center),
        palm_normal=tuple(float(x) for x in hand.palm_normal),
        collision_source=str(hand.default_source),
        degrees_of_freedom=len(hand.joints) - len(hand.couplings),
        fingers=_fingers(hand),
        joints=tuple(_joint(hand, i) for i in range(len(hand.joints))),
        links=_links(hand),
        fixed_links=tuple(hand.links[i].name for i in hand.fixed_links),
        allowed_pairs=_allowed_pairs(hand),
        warnings=hand.warnings,
        findings=hand.findings if findings is None else findings,
    )


def _allowed_pairs(hand: Hand) -> tuple[tuple[str, str], ...]:
    pairs = hand.allowed_pairs_for(hand.default_source)
    return tuple((hand.links[a].name, hand.links[b].name) for a, b in pairs)


def _fingers(hand: Hand) -> tuple[FingerReport, ...]:
    from clench.models.hand.understanding.finger_geometry import finger_line

    found = []
    for finger in hand.fingers:
        line = finger_line(hand, finger, hand.open_angles())
        found.append(
            FingerReport(
                name=finger.name,
                is_thumb=finger.is_thumb,
                joints=tuple(hand.joints[j].name for j in finger.joints),
                links=tuple(hand.links[i].name for i in finger.links),
                tip_link=hand.links[finger.tip_link].name,
                length=float(np.linalg.norm(line.tip - line.anchors[0])),
            )
        )
    return tuple(found)


def _joint(hand: Hand, index: int) -> JointReport:
    joint = hand.joints[index]
    coupling = next((c for c in hand.couplings if c.follower == index), None)
    finger = next((f.name for f in hand.fingers if index in f.joints), None)
    return JointReport(
        name=joint.name,
        finger=finger,
        role=str(joint.role),
        role_reason=joint.role_reason,
        direction=joint.direction if joint.role == "closing" else None,
        direction_reason=joint.direction_reason,
        open_value=joint.open_value,
        open_reason=joint.open_reason,
        lower=joint.lower,
        upper=joint.upper,
        velocity=joint.velocity,
        effort=joint.effort,
        follows=None if coupling is None else hand.joints[coupling.leader].name,
        ratio=None if coupling is None else coupling.ratio,
        offset=None if coupling is None else coupling.offset,
        coupling_reason="" if coupling is None else coupling.reason,
    )


def _links(hand: Hand) -> tuple[LinkReport, ...]:
    found = []
    for link in hand.links:
        shapes = {str(s): tuple(str(shape.kind) for shape in link.shapes[s]) for s in CollisionSource}
        triangles = {
            str(s): sum(len(shape.mesh.triangles) for shape in link.shapes[s] if shape.mesh is not None)
            for s in CollisionSource
        }
        parent = None if link.parent < 0 else hand.links[link.parent].name
        joint = None if link.joint < 0 else hand.joints[link.joint].name
        found.append(LinkReport(link.name, parent, joint, shapes, triangles))
    return tuple(found)


def _joint_row(joint: JointReport) -> tuple[str, str, str, str, str, str, str]:
    direction = {1: "+", -1: "-", None: ""}[joint.direction]
    reasons = [f"role: {joint.role_reason}"]
    if joint.direction is not None:
        reasons.append(f"direction: {joint.direction_reason}")
    reasons.append(f"open: {joint.open_reason}")
    return (
        joint.finger or "",
        joint.name,
        joint.role,
        direction,
        f"{np.rad2deg(joint.open_value):.1f}",
        f"{np.rad2deg(joint.lower):.1f} .. {np.rad2deg(joint.upper):.1f}",
        "; ".join(reasons),
    )


def _vector(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{v:z.3f}" for v in values) + "]"
