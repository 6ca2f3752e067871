"""The scene of a curl plane at the end of a finger's closing: a plain value, drawn elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clench.core.pose import FloatArray
from clench.solver.solution import Contact

from .loops import Loop


@dataclass(frozen=True, eq=False)
class SectionCurve:
    """One curve of the object's section: the loop, and whether it is of an obstacle."""

    loop: Loop
    obstacle: bool


@dataclass(frozen=True, eq=False)
class LinkSection:
    """The section of one link: its name, the joint (index in the plan) that moves it, and its borders."""

    name: str
    joint: int
    loops: tuple[Loop, ...]


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Place a joint in its plane, with its motion.

    Args:
        name: of the joint. position: its place from the palm outwards in its plan.
        pivot: at the end [m], shape (2,). arm: from there to the next joint or the tip [m], shape (2,).
        turn, full_turn: turned by, and by at most, x towards z [rad].
        angle, open_angle, limit: model angles [rad].
    """

    name: str
    position: int
    pivot: FloatArray
    arm: FloatArray
    turn: float
    full_turn: float
    angle: float
    open_angle: float
    limit: float


@dataclass(frozen=True, eq=False)
class PlaneContact:
    """Place a contact in a plane: point [m] and in-plane unit normal, shape (2,) each; `number` counts from 0.

    `plane` counts the finger's curl planes and, after them, those drawn through contacts that lie on none; `place`
    says in words which one it is.
    """

    contact: Contact
    number: int
    point: FloatArray
    normal: FloatArray
    plane: int
    place: str


@dataclass(frozen=True, eq=False)
class PlaneScene:
    """The content of the picture of one plane.

    Args:
        axis_group, plane: which plane, as in `PlaneContact`. place: which one, in words. offset: along y [m].
        section: of the object. palm: loops of the links that do not move.
        open_links, closed_links: sections of the links that the axis group's joints move.
        joints: of this axis group, palm side first.
        contacts: contacts of the candidate on this plane. others: contacts on other planes of the axis group.
    """

    axis_group: int
    plane: int
    place: str
    offset: float
    section: tuple[SectionCurve, ...]
    palm: tuple[Loop, ...]
    open_links: tuple[LinkSection, ...]
    closed_links: tuple[LinkSection, ...]
    joints: tuple[JointMotion, ...]
    contacts: tuple[PlaneContact, ...]
    others: tuple[PlaneContact, ...]


def turned(v: FloatArray, angle: float) -> FloatArray:
    """Return a vector of a plane turned, x towards z [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def along_y(offset: float) -> str:
    """Return a place along y [m] in words."""
    return f"y = {round(offset * 1e3, 1) + 0.0:+.1f} mm"  # adding zero turns -0.0 into 0.0


def bounds(scenes: Sequence[PlaneScene]) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a box around the finger, open and closed, and the part of the object within its reach."""
    loops = [loop for s in scenes for link in (*s.open_links, *s.closed_links) for loop in link.loops]
    points = [loop.points for loop in loops]
    points += [np.array([j.pivot, j.pivot + 0.7 * turned(j.arm, -j.turn)]) for s in scenes for j in s.joints]
    points += [np.array([c.point]) for s in scenes for c in s.contacts]
    links = np.vstack(points)
    low, high = links.min(axis=0), links.max(axis=0)
    reach = 0.35 * float((high - low).max())
    near = [c.loop.points for s in scenes for c in s.section if not c.obstacle]
    if near:
        section = np.vstack(near)
        low = np.maximum(np.minimum(low, section.min(axis=0)), low - reach)
        high = np.minimum(np.maximum(high, section.max(axis=0)), high + reach)
    return low, high
