"""The object's sections with the curl planes of a family: triangles and round primitives (METHOD.md section 2)."""

from __future__ import annotations

import numpy as np

from .compiling import inner_kernel, kernel
from .family_pose import compose, compose_inverse
from .layout import Floats, HandArrays, RoundArrays, SectionArrays
from .round_section import CAPSULE, CYLINDER, ELLIPSOID, cut_capsule, cut_cylinder, cut_ellipsoid, cut_sphere
from .section import cut
from .tree import MeshTree


def make_sections(planes: int, capacity: int, rounds: int) -> SectionArrays:
    """Allocate an arena; a round primitive gives at most four segments, three disks and one ellipse."""
    return SectionArrays(
        np.empty((planes, capacity + 4 * rounds, 6)),
        np.empty((planes, capacity + 4 * rounds), dtype=np.int64),
        np.empty((planes, 3 * rounds, 3)),
        np.empty((planes, 3 * rounds), dtype=np.int64),
        np.empty((planes, rounds, 8)),
        np.empty((planes, rounds), dtype=np.int64),
        np.zeros((planes, 3), dtype=np.int64),
    )


@kernel
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


@inner_kernel
def cut_planes(
    hand: HandArrays,
    family: int,
    low: int,
    high: int,
    tree: MeshTree,
    rounds: RoundArrays,
    T: Floats,
    sections: SectionArrays,
    base: int,
    pose: Floats,
) -> int:
    """Cut the object by the planes `low` to `high` of a family; row `plane - base` of the arena is written.

    Args:
        T: `T_family_object`, shape (3, 4). pose: scratch space, (3, 4).

    Returns:
        0, or the capacity that the arena should have had.
    """
    capacity = sections.segments.shape[1] - 4 * rounds.kind.shape[0]
    wanted = cut(
        tree,
        T,
        hand.plane_offset,
        low,
        high,
        hand.family_reach[family],
        sections.segments,
        sections.sources,
        sections.counts,
        base,
        capacity,
    )
    for plane in range(low, high):
        sections.counts[plane - base, 1], sections.counts[plane - base, 2] = 0, 0
        cut_rounds(rounds, T, hand.plane_offset[plane], plane - base, sections, pose)
    return int(wanted)


@kernel
def cut_first_families(
    hand: HandArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    T_palm_object: Floats,
    sections: SectionArrays,
    two: Floats,
) -> int:
    """Cut the object by the planes of every entry's first family, which no turn moves; row = global plane.

    Args:
        two: poses, overwritten, (2, 3, 4). The others as for `close_items`.

    Returns:
        0, or the capacity that the arena should have had.
    """
    wanted, T = 0, two[0]
    for entry in range(hand.entry_family.shape[0] - 1):
        family = hand.entry_family[entry]
        compose_inverse(hand.family_pose[family], T_palm_object, T)
        low, high = hand.family_plane[family], hand.family_plane[family + 1]
        wanted = max(wanted, cut_planes(hand, family, low, high, tree, rounds, T, sections, 0, two[1]))
    return wanted
