"""Findings about a hand: a code, names, numbers, a sentence, and advice."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from clench.core.showing.short_repr import short_repr
from clench.core.showing.visible_text import visible


class Severity(StrEnum):
    """Name how much a finding matters."""

    WARNING = "warning"
    """something looks wrong; answers may be wrong until it is settled"""
    NOTE = "note"
    """nothing looks wrong, but it explains the behaviour of the hand"""


class FindingCode(StrEnum):
    """Name the kinds of findings; docs/hand-report.md gives advice for each."""

    AXIS_NOT_UNIT = "axis_not_unit"
    """the model gives an axis of another length than 1"""
    AXES_ALMOST_PARALLEL = "axes_almost_parallel"
    """neighbouring closing joints are not quite parallel, so that they do not share curl planes"""
    LIMITS_MISSING = "limits_missing"
    """the model gives a joint no limits"""
    LIMITS_REVERSED = "limits_reversed"
    """the lower limit is above the upper one"""
    LIMITS_ZERO_WIDTH = "limits_zero_width"
    """both limits are the same angle"""
    LIMITS_TOO_WIDE = "limits_too_wide"
    """a joint may turn by more than a whole turn"""
    LIMITS_TOO_NARROW = "limits_too_narrow"
    """no joint may turn by more than a few degrees"""
    EFFORT_PLACEHOLDER = "effort_placeholder"
    """an effort limit that no finger has"""
    EFFORT_MISSING = "effort_missing"
    """neither model nor hand file limits the torque of a joint"""
    LENGTHS_TOO_LARGE = "lengths_too_large"
    """lengths as if millimetres were taken for metres"""
    LENGTHS_TOO_SMALL = "lengths_too_small"
    """lengths as if they were scaled down once too often"""
    COLLISION_FROM_VISUALS = "collision_from_visuals"
    """links without collision shapes collide with their visual shapes"""
    HULL_OFF_MESH = "hull_off_mesh"
    """convex hulls replace concave meshes"""
    NO_SHAPE = "no_shape"
    """a joint moves nothing that has a shape"""
    SHAPE_LEFT_OUT = "shape_left_out"
    """a shape of a kind that a hand cannot have"""
    SELF_COLLISION_AT_OPEN = "self_collision_at_open"
    """links overlap before anything closes, and must not"""
    OVERLAP_ALLOWED = "overlap_allowed"
    """links overlap before anything closes, and may, since they do so in the model's own posture"""
    PAIRS_EXCLUDED = "pairs_excluded"
    """the model excludes pairs of links of different fingers, which are never checked"""
    THUMB_OPPOSES_NOTHING = "thumb_opposes_nothing"
    """the thumb and the fingers never close towards each other"""
    NO_THUMB = "no_thumb"
    """no finger could be told to be the thumb"""
    ONE_FINGER = "one_finger"
    """the hand has only one finger"""
    DIRECTION_UNCERTAIN = "direction_uncertain"
    """a closing direction that the limits do not tell"""
    DIRECTIONS_OPPOSED = "directions_opposed"
    """joints of one finger close in opposite senses"""
    FOLLOWER_NOT_PARALLEL = "follower_not_parallel"
    """a joint follows a closing joint about another axis"""
    DIRECTION_IGNORED = "direction_ignored"
    """the hand file gives a direction to a joint that follows another"""
    COUPLING_LEFT_OUT = "coupling_left_out"
    """a coupling to a joint that is no part of the hand"""
    COUPLING_MISSING = "coupling_missing"
    """a coupling that the maker publishes and the file leaves out"""
    JOINT_HELD = "joint_held"
    """a joint before the palm that is not revolute is held still"""
    LINKS_LEFT_OUT = "links_left_out"
    """other limbs of the robot"""


@dataclass(frozen=True)
class Finding:
    """State one finding about a hand.

    Args:
        code: its kind. text: the finding, with numbers. advice: the remedy, often a line of the hand file.
        severity: see `Severity`. joints, links: names concerned.
        numbers: by name, units in the name (`angle_deg`, `depth_m`).
    """

    code: FindingCode
    text: str
    advice: str = ""
    severity: Severity = Severity.WARNING
    joints: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    numbers: Mapping[str, float] = field(default_factory=dict)

    __repr__ = short_repr


def in_hand_file(table: str, name: str, line: str) -> str:
    """Return the entry for the hand file, e.g. ``under [joints.X]: direction = 1``."""
    return f"under {table_header(table, name)}: {line}"


def table_header(table: str, name: str) -> str:
    """Return the line that begins a table of the hand file, e.g. ``[joints.X]``."""
    key = name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{visible(name)}"'
    return f"[{table}.{key}]"


def quoted(names: tuple[str, ...] | list[str]) -> str:
    """Return names in quotes, each on one line, with commas between."""
    return ", ".join(f"'{visible(name)}'" for name in names)
