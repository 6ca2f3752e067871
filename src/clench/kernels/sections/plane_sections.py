"""The object's sections with the curl planes of an axis group: triangles and round primitives (docs/method.md
section 2).
"""

from __future__ import annotations

import math

import numpy as np

from clench.kernels.closing.layout import RUN, CandidateArrays, Floats, HandArrays, RoundArrays, SectionArrays
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.trees.bvh import MeshTree

from .plane_pose import compose, compose_inverse
from .round_section import CAPSULE, CYLINDER, ELLIPSOID, cut_capsule, cut_cylinder, cut_ellipsoid, cut_sphere
from .section import cut

#: Factor that covers the rounding of the radius of a circle [-].
WIDER = 1.0 + 1e-12


def make_sections(planes: int, capacity: int, rounds: int) -> SectionArrays:
    """Allocate an arena; a round primitive gives at most four segments, three disks and one ellipse."""
    segments = capacity + 4 * rounds
    return SectionArrays(
        np.empty((planes, segments, 6)),
        np.empty((planes, segments), dtype=np.int64),
        np.empty((planes, 3 * rounds, 3)),
        np.empty((planes, 3 * rounds), dtype=np.int64),
        np.empty((planes, rounds, 8)),
        np.empty((planes, rounds), dtype=np.int64),
        np.zeros((planes, 3), dtype=np.int64),
        np.empty((planes, segments // RUN + 1, 3)),
    )


@kernel
def put_circles(sections: SectionArrays, row: int) -> None:
    """Write circles around those that have the segments of a row as diameters."""
    segments, count = sections.segments, sections.counts[row, 0]
    for run in range(-(-count // RUN)):
        first, last = RUN * run, min(RUN * run + RUN, count)
        x0, x1, z0, z1 = math.inf, -math.inf, math.inf, -math.inf
        for i in range(first, last):
            for end in (0, 2):
                x, z = segments[row, i, end], segments[row, i, end + 1]
                x0, x1, z0, z1 = min(x0, x), max(x1, x), min(z0, z), max(z1, z)
        x, z, radius = 0.5 * (x0 + x1), 0.5 * (z0 + z1), 0.0
        for i in range(first, last):
            ax, az, bx, bz = segments[row, i, 0], segments[row, i, 1], segments[row, i, 2], segments[row, i, 3]
            away = math.sqrt((0.5 * (ax + bx) - x) ** 2 + (0.5 * (az + bz) - z) ** 2)
            radius = max(radius, away + 0.5 * math.sqrt((bx - ax) ** 2 + (bz - az) ** 2))
        circle = sections.circles[row, run]
        circle[0], circle[1], circle[2] = x, z, WIDER * radius


@entry_kernel
def cut_rounds(rounds: RoundArrays, T: Floats, offset: float, row: int, sections: SectionArrays, pose: Floats) -> None:
    """Append the sections of all round primitives with one plane; `pose` is scratch space, (3, 4)."""
    for i in range(rounds.kind.shape[0]):
        compose(T, rounds.pose[i], pose)
        kind, size = rounds.kind[i], rounds.size[i]
        if kind == CYLINDER:
            cut_cylinder(pose, size[0], size[1], offset, True, i, row, sections)
        elif kind == CAPSULE:
            cut_capsule(pose, size[0], size[1], offset, i, row, sections)
        elif kind == ELLIPSOID:
            cut_ellipsoid(pose, size, offset, i, row, sections)
        else:
            cut_sphere(pose[0, 3], pose[1, 3], pose[2, 3], size[0], offset, i, row, sections)


@kernel
def cut_planes(
    hand: HandArrays,
    axis_group: int,
    planes: tuple[int, int],
    tree: MeshTree,
    rounds: RoundArrays,
    T: Floats,
    sections: SectionArrays,
    base: int,
    pose: Floats,
) -> int:
    """Cut the object by a range of planes of an axis group; row `plane - base` of the arena is written.

    Args:
        T: `T_axis_group_object`, shape (3, 4). pose: scratch space, (3, 4).

    Returns:
        0, or the capacity that the arena should have had.
    """
    capacity = sections.segments.shape[1] - 4 * rounds.kind.shape[0]
    wanted = cut(
        tree,
        T,
        hand.plane_offset,
        planes,
        hand.axis_group_reach[axis_group],
        sections.segments,
        sections.sources,
        sections.counts,
        base,
        capacity,
    )
    for plane in range(planes[0], planes[1]):
        sections.counts[plane - base, 1], sections.counts[plane - base, 2] = 0, 0
        cut_rounds(rounds, T, hand.plane_offset[plane], plane - base, sections, pose)
        put_circles(sections, plane - base)
    return int(wanted)


@entry_kernel
def needs_planes(candidates: CandidateArrays) -> bool:
    """Say whether any candidate has a plane; the full width has none."""
    planes = 0
    for i in range(candidates.finger_posture.shape[0]):
        planes += candidates.high[i] - candidates.low[i]
    return bool(planes > 0)


@entry_kernel
def cut_first_axis_groups(
    hand: HandArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    T_palm_object: Floats,
    sections: SectionArrays,
    two: Floats,
) -> int:
    """Cut the object by the planes of every finger posture's first axis group, which no turn moves; row = global plane.

    Args:
        two: poses, overwritten, (2, 3, 4). The others as for `close_candidates`.

    Returns:
        0, or the capacity that the arena should have had.
    """
    wanted, T = 0, two[0]
    for finger_posture in range(hand.first_axis_group.shape[0] - 1):
        axis_group = hand.first_axis_group[finger_posture]
        compose_inverse(hand.axis_group_pose[axis_group], T_palm_object, T)
        planes = (hand.axis_group_plane[axis_group], hand.axis_group_plane[axis_group + 1])
        wanted = max(wanted, cut_planes(hand, axis_group, planes, tree, rounds, T, sections, 0, two[1]))
    return wanted
