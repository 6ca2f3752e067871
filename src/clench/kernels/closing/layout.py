"""Layout of the arrays that kernels read and write (docs/method.md sections 1 and 2).

An *axis group* is a run of consecutive joints of a finger with parallel axes. They share parallel curl planes. Its
frame has y along the planes' normal, so in-plane coordinates are (x, z) and a positive turn takes x towards z.
Everything in `FingerArrays` is in this frame, at the open posture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
#: A point of a plane, or a direction in it, (x, z).
Flat = tuple[float, float]
#: A line in a plane between two ends: unit normal, offset, and the ends along (-n_z, n_x), the lower one first.
Line = tuple[float, float, float, float, float]
#: A segment in a plane: its ends a and b, and its unit normal.
Segment = tuple[float, float, float, float, float, float]
#: How the object's features become relative to a pivot: its place, and the sign of z, -1 for clockwise turns.
Origin = tuple[float, float, float]


class ChainArrays(NamedTuple):
    """The joints; J joints, G degrees of freedom.

    Args:
        joint_axis_group: (J,), ascending. joint_dof: (J,).
        pivot: pivot of each joint relative to the pivot before it in its axis group [m], (J, 2).
        rate: turn per unit of travel of its degree of freedom [-], (J,).
        start, stop: travel of the degree of freedom between which the joint moves [rad], (J,).
        dof_length: travel of each degree of freedom up to its limit [rad], (G,).
        speed: travel of each degree of freedom per unit of the motion where all move at once [rad], (G,).
        breaks: whether the joints of a degree of freedom go on when those before them are blocked, (G,).
    """

    joint_axis_group: Ints
    joint_dof: Ints
    pivot: Floats
    rate: Floats
    start: Floats
    stop: Floats
    dof_length: Floats
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
    """The fingers of a hand, each at one or several postures, in one piece.

    E finger postures, F axis groups, P planes. Every index is global, and what belongs to one finger posture stands
    together: a candidate is a range of degrees of freedom and a range of planes.

    Args:
        first_dof: first degree of freedom of each finger posture, (E + 1,). first_axis_group: first axis group of each
            finger posture, (E + 1,).
        chain: the joints. outlines: the links, by plane.
        axis_group_pose: (F, 3, 4). A finger posture's first is in the palm frame. Each other one is in a frame on the
            last pivot of the axis group before: it is parallel to that one's, and turns with its last joint.
        axis_group_plane: first plane of each axis group, (F + 1,). plane_offset: place along y [m], (P,).
        axis_group_reach: no moved point gets farther from the axis group's origin in the plane [m], (F,).
        axis_group_length: length of the finger [m], the scale of its tolerances, (F,).
        plane_outline: first outline of each plane, (P + 1,).
    """

    first_dof: Ints
    first_axis_group: Ints
    chain: ChainArrays
    outlines: OutlineArrays
    axis_group_pose: Floats
    axis_group_plane: Ints
    plane_offset: Floats
    axis_group_reach: Floats
    axis_group_length: Floats
    plane_outline: Ints


class Work(NamedTuple):
    """The scratch space of one candidate, so that closing allocates nothing.

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


class PlaneSection(NamedTuple):
    """The object's section with one plane, as a sweep on this plane meets it; kernels hold the arena by a pointer.

    Args:
        sections, row: the arena, and the row of the plane. closed: the object's winding is known, so that only its
            outer side counts. touch: gaps up to this touch [m].
    """

    sections: SectionArrays
    row: int
    closed: bool
    touch: float


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


class CandidateArrays(NamedTuple):
    """List the candidates: one plane of a finger posture, or its full width.

    Args:
        finger_posture: (I,). low, high: range of planes, counted from the first plane of each axis group of the finger
            posture, (I,): one plane, or none for the full width.
        until: place in the motion from which each joint is held from outside, infinite without one, (I, J).
    """

    finger_posture: Ints
    low: Ints
    high: Ints
    until: Floats


class ClosingArrays(NamedTuple):
    """The answers of all candidates; I candidates, S contacts at most.

    Args:
        travel: of every degree of freedom [rad], (I, G). turn: of every joint [rad], (I, J); only the finger posture's
            own are set.
        contacts: how many there are, (I,). contact: integers of each contact, (I, S, 9), see below.
        point: numbers of each contact in its axis group's plane, (I, S, 7), see below.
        pose: `T_palm_axis_group` of every axis group of the finger posture at the end, (I, F, 3, 4).
        overflow: capacity wanted where the arena was too small for a later axis group's section, else 0, (I,).
        overlap: link that overlaps the object at the start over its width, (I,); then nothing moves. Or `SUNK` - link
            where earlier axis groups would bring it there on the candidate's one plane; nothing moves either. Else -1.
        skipped: pairs of the hand's own links that were left alone, as they overlapped already, (I,).
    """

    travel: Floats
    turn: Floats
    contacts: Ints
    contact: Ints
    point: Floats
    pose: Floats
    overflow: Ints
    overlap: Ints
    skipped: Ints


#: See `ClosingArrays.overlap`.
SUNK = -2
#: Columns of `ClosingArrays.contact`.
(
    CONTACT_PLANE,
    CONTACT_OUTLINE,
    CONTACT_KIND,
    CONTACT_SOURCE,
    CONTACT_DOF,
    CONTACT_AXIS_GROUP,
    CONTACT_FEATURE,
    CONTACT_WHICH,
) = 0, 1, 2, 3, 4, 5, 6, 7
#: The last joint that the contact stops.
CONTACT_JOINT = 8
#: For a full-width contact the elements of the link and of the other body that met; later motions may let other ones
#: touch, see `settle`.
CONTACT_MET, CONTACT_MET_SOURCE = 9, 10
CONTACT_INTEGERS = 11
#: For a full-width contact the plane is -1, and the columns mean: link, kind, element of the other body, degree of
#: freedom, axis group, element of the link, and the other body (a link, or the number of links for the object). Columns
#: of `ClosingArrays.point`: contact, outward normal of the object there, normal of its curve, and the gap at the
#: candidate's final posture; for a full-width contact point and normal in the palm frame, and the gap.
CONTACT_X, CONTACT_Z, CONTACT_NX, CONTACT_NZ, CONTACT_CURVE_X, CONTACT_CURVE_Z, CONTACT_GAP = 0, 1, 2, 3, 4, 5, 6
CONTACT_FLOATS = 7

#: Kinds of touching features: of an outline; of a link's mesh (corner, edge, face, as `closest` numbers them).
KIND_SIDE, KIND_TIP, KIND_EDGE, KIND_VERTEX, KIND_LINE, KIND_FACE = 0, 1, 2, 3, 4, 5
