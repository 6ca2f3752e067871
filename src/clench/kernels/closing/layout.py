"""Layout of the arrays that kernels read and write (docs/method.md sections 1 and 2).

A *family* is a set of parallel curl planes shared by consecutive joints of a finger. Its frame has y along the
planes' normal, so in-plane coordinates are (x, z) and a positive turn takes x towards z. Everything in `FingerArrays`
is in family axes at the open posture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class ChainArrays(NamedTuple):
    """The joints; J joints, G groups.

    Args:
        joint_family: (J,), ascending. joint_group: (J,).
        pivot: pivot of each joint relative to the pivot before it in its family [m], (J, 2).
        rate: turn per unit of its group's travel [-], (J,).
        start, stop: travel of the group between which the joint moves [rad], (J,).
        group_length: travel of each group up to its limit [rad], (G,).
        speed: travel of each group per unit of the motion where all move at once [rad], (G,).
        breaks: whether the joints of a group go on when those before them are blocked, (G,).
    """

    joint_family: Ints
    joint_group: Ints
    pivot: Floats
    rate: Floats
    start: Floats
    stop: Floats
    group_length: Floats
    speed: Floats
    breaks: Ints


class OutlineArrays(NamedTuple):
    """The links' outlines on all planes; O outlines, V vertices, S sides.

    Args:
        joint: joint that moves it, (O,). link: (O,). radius: [m], (O,).
        both: 1 where the sides' winding is not known, (O,).
        stadium: bound of the outline, relative to its joint's pivot, (O, 5): all points within a radius, the fifth
            column, of the line between two ends, (x, z) each [m].
        vertex_first: first vertex of each outline, (O + 1,). vertex: relative to the joint's pivot [m], (V, 2).
        side_first: first side of each outline, (O + 1,).
        side: rows (n_x, n_z, g, t_a, t_b) relative to the joint's pivot, (S, 5): outward unit normal, offset, and the
            two ends along (-n_z, n_x) [m].
    """

    joint: Ints
    link: Ints
    radius: Floats
    both: Ints
    stadium: Floats
    vertex_first: Ints
    vertex: Floats
    side_first: Ints
    side: Floats


class Outline(NamedTuple):
    """Name one outline: its number, its ranges of vertices and sides, radius, `both`, and the kind of its vertices."""

    number: int
    v0: int
    v1: int
    s0: int
    s1: int
    radius: float
    both: bool
    tip: int


class HandArrays(NamedTuple):
    """The fingers of a hand, each at one or several postures ("entries"), in one piece.

    E entries, F families, P planes. Every index is global, and what belongs to one entry stands together: an item of
    work is a range of groups and a range of planes.

    Args:
        entry_group: first group of each entry, (E + 1,). entry_family: first family of each entry, (E + 1,).
        chain: the joints. outlines: the links, by plane.
        family_pose: (F, 3, 4). An entry's first is in the palm frame. Each other one is in a frame on the last pivot of
            the family before: it has that family's axes, and turns with its last joint.
        family_plane: first plane of each family, (F + 1,). plane_offset: place along y [m], (P,).
        family_reach: no moved point gets farther from the family's origin in the plane [m], (F,).
        family_length: length of the finger [m], the scale of its tolerances, (F,).
        plane_outline: first outline of each plane, (P + 1,).
    """

    entry_group: Ints
    entry_family: Ints
    chain: ChainArrays
    outlines: OutlineArrays
    family_pose: Floats
    family_plane: Ints
    plane_offset: Floats
    family_reach: Floats
    family_length: Floats
    plane_outline: Ints


class Work(NamedTuple):
    """The scratch space of one item, so that closing allocates nothing.

    Args:
        place: joints at the start of the segment, rows (x, z, turn, its cosine and sine), (J, 5). moved, turns: joints
            at a later place, (J, 5), and their turns, (J,).
        vertex, side: the moving outlines' features about their turning centre, as in `OutlineArrays`; the third column
            of `vertex` is the distance from that centre. stadium: likewise; see `put_stadium`, (O, 6).
        chain: rows (Ω, e_x, e_z), (J + 1, 3). terms: sums of `coupled`, (N, 3). ellipse: one, relative, (8,).
        rates, before, locked: of the joints, (J,). pose: two poses, (2, 3, 4).
        best: the winner: kind, outline, feature, object feature, which end or orientation, 0 segment, 1 disk
            or 2 ellipse; whether sharp pairs touch at the start; the last of these in the same six columns, (13,).
    """

    place: Floats
    moved: Floats
    turns: Floats
    vertex: Floats
    side: Floats
    stadium: Floats
    chain: Floats
    terms: Floats
    ellipse: Floats
    rates: Floats
    before: Floats
    locked: Ints
    pose: Floats
    best: Ints


#: Segments in one circle: those next to each other in the tree lie near each other.
RUN = 8


class SectionArrays(NamedTuple):
    """The object's sections with P planes, one row each; a fixed arena with a count per plane.

    Args:
        segments: rows (a_x, a_z, b_x, b_z, n_x, n_z) [m], (P, capacity, 6), outward unit normals.
        sources: triangle of the tree, or -1 - index of a round primitive, (P, capacity).
        disks: rows (x, z, radius) [m], (P, D, 3). disk_sources: (P, D).
        ellipses: rows (x, z, u_x, u_z, a, b, low, high) [m], (P, E, 8): centre, direction of the major semi-axis,
            semi-axes a >= b, and the band of coordinates along u that belongs to the section.
        ellipse_sources: (P, E).
        counts: segments, disks and ellipses in use, (P, 3); negative where the arena was too small.
        circles: rows (x, z, radius) [m] around the circles about every `RUN` segments that follow each other,
            (P, capacity / RUN + 1, 3).
    """

    segments: Floats
    sources: Ints
    disks: Floats
    disk_sources: Ints
    ellipses: Floats
    ellipse_sources: Ints
    counts: Ints
    circles: Floats


class RoundArrays(NamedTuple):
    """An object's round primitives; R primitives.

    Args:
        kind: 0 sphere, 1 capsule, 2 cylinder, 3 ellipsoid, (R,). size: as `ShapeKind` says [m], (R, 3).
        pose: `T_object_shape`, (R, 3, 4).
    """

    kind: Ints
    size: Floats
    pose: Floats


def no_rounds() -> RoundArrays:
    """Return the round primitives of an object that has none."""
    return RoundArrays(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3, 4)))


class ItemArrays(NamedTuple):
    """List the items of work: an entry's one plane, or all of its planes (the full width).

    Args:
        entry: (I,). low, high: range of planes, counted from the first plane of each family of the entry, (I,).
        until: place in the motion from which each joint is held from outside, infinite without one, (I, J).
    """

    entry: Ints
    low: Ints
    high: Ints
    until: Floats


class ClosingArrays(NamedTuple):
    """The answers of all items; I items, S contacts at most.

    Args:
        travel: of every group [rad], (I, G). turn: of every joint [rad], (I, J); only the entry's own are set.
        contacts: how many there are, (I,). hit: integers of each contact, (I, S, 9), see below.
        point: numbers of each contact in its family's plane, (I, S, 7), see below.
        pose: `T_palm_family` of every family of the entry at the end, (I, F, 3, 4).
        overflow: capacity wanted where the arena was too small for a later family's section, else 0, (I,).
        overlap: link that overlaps the object at the start over its width, (I,); then nothing moves. Or `SUNK` - link
            where earlier families would bring it there on the item's one plane; nothing moves either. Else -1.
        skipped: pairs of the hand's own links that were left alone, as they overlapped already, (I,).
    """

    travel: Floats
    turn: Floats
    contacts: Ints
    hit: Ints
    point: Floats
    pose: Floats
    overflow: Ints
    overlap: Ints
    skipped: Ints


#: See `ClosingArrays.overlap`.
SUNK = -2
#: Columns of `ClosingArrays.hit`.
HIT_PLANE, HIT_OUTLINE, HIT_KIND, HIT_SOURCE, HIT_GROUP, HIT_FAMILY, HIT_FEATURE, HIT_WHICH = 0, 1, 2, 3, 4, 5, 6, 7
#: The last joint that the contact stops.
HIT_JOINT = 8
HIT_INTEGERS = 9
#: For an exact contact the plane is -1, and the columns mean: link, kind, element of the other body, group, family,
#: element of the link, and the other body (a link, or the number of links for the object). Columns of
#: `ClosingArrays.point`: contact, outward normal of the object there, normal of its curve, and the gap at the item's
#: final posture; for an exact contact point and normal in the palm frame, and the gap.
HIT_X, HIT_Z, HIT_NX, HIT_NZ, HIT_CURVE_X, HIT_CURVE_Z, HIT_GAP = 0, 1, 2, 3, 4, 5, 6
HIT_FLOATS = 7

#: Kinds of touching features: of an outline; of a link's mesh (corner, edge, face, as `closest` numbers them).
KIND_SIDE, KIND_TIP, KIND_EDGE, KIND_VERTEX, KIND_LINE, KIND_FACE = 0, 1, 2, 3, 4, 5
