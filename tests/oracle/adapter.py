"""Connect the kernel to the oracle: pack a planar finger and curve, close them, return the stages."""

import numpy as np
import numpy.typing as npt

from clench.closing.outlines import RoundedOutline
from clench.closing.plan_packing import enclosing
from clench.kernels.closing.layout import (
    CONTACT_INTEGERS,
    CandidateArrays,
    ChainArrays,
    ClosingArrays,
    HandArrays,
    OutlineArrays,
    SectionArrays,
    no_rounds,
)
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.geometry.bodies import no_body
from clench.kernels.sections import plane_sections
from clench.kernels.sections.plane_sections import make_sections
from clench.kernels.toi.full_width import planes_only
from clench.kernels.trees.bvh import build_tree
from kernels.kernel_entries import entry
from kernels.plain_closing import close_candidates

from .compiled import Floats, Ints
from .planar import StageAnswer
from .scene import PlanarCurve, PlanarFinger, PlanarOutline

put_circles = entry(plane_sections.put_circles)
EMPTY_TREE = build_tree(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))


def _ints(values: npt.ArrayLike) -> Ints:
    return np.asarray(values, dtype=np.int64)


def side_rows(outline: PlanarOutline) -> Floats:
    """Return the sides of an outline as the kernel's rows (n_x, n_z, g, t_a, t_b)."""
    rows = []
    for i, j in outline.sides:
        a, b = outline.vertices[i], outline.vertices[j]
        run = b - a
        length = np.linalg.norm(run)
        if length == 0.0:
            continue
        nx, nz = run[1] / length, -run[0] / length
        ends = sorted([-nz * a[0] + nx * a[1], -nz * b[0] + nx * b[1]])
        rows.append([nx, nz, nx * a[0] + nz * a[1], *ends])
    return np.array(rows).reshape(-1, 5)


def pack_finger(finger: PlanarFinger) -> HandArrays:
    """Return the kernel's arrays for one finger with one plane."""
    joints = len(finger.rates)
    dofs = finger.dofs
    stop = np.array([finger.limits[j] / abs(finger.rates[j]) for j in range(joints)])
    length = np.array([finger.travel(g) for g in range(dofs)])
    for g in range(dofs):
        stop[finger.leader(g)] = length[g]
    sides = [side_rows(o) for o in finger.outlines]
    stadiums = [enclosing(RoundedOutline(o.vertices, s, o.radius)) for o, s in zip(finger.outlines, sides, strict=True)]
    chain = ChainArrays(
        joint_axis_group=_ints(np.zeros(joints)),
        joint_dof=_ints(finger.dof),
        pivot=np.ascontiguousarray(finger.pivots, dtype=np.float64),
        rate=np.ascontiguousarray(finger.rates, dtype=np.float64),
        start=np.zeros(joints),
        stop=stop,
        dof_length=length,
        speed=np.ones(dofs),
        breaks=_ints(np.zeros(dofs)),
    )
    outlines = OutlineArrays(
        joint=_ints([o.joint for o in finger.outlines]),
        link=_ints(range(len(finger.outlines))),
        radius=np.array([o.radius for o in finger.outlines], dtype=np.float64),
        both=_ints(np.zeros(len(finger.outlines))),
        stadium=np.array(stadiums).reshape(-1, 5),
        vertex_first=_ints(np.cumsum([0, *(len(o.vertices) for o in finger.outlines)])),
        vertex=np.ascontiguousarray(np.vstack([o.vertices for o in finger.outlines]), dtype=np.float64),
        side_first=_ints(np.cumsum([0, *(len(s) for s in sides)])),
        side=np.ascontiguousarray(np.vstack(sides)),
    )
    return HandArrays(
        first_dof=_ints([0, dofs]),
        first_axis_group=_ints([0, 1]),
        chain=chain,
        outlines=outlines,
        axis_group_pose=np.eye(4)[None, :3].copy(),
        axis_group_plane=_ints([0, 1]),
        plane_offset=np.zeros(1),
        axis_group_reach=np.array([10 * finger.length]),
        axis_group_length=np.array([finger.length]),
        plane_outline=_ints([0, len(finger.outlines)]),
    )


def pack_curve(curve: PlanarCurve) -> SectionArrays:
    """Return the kernel's arena with one plane that holds the curve."""
    rows = np.concatenate([curve.segments.reshape(-1, 4), curve.normals], axis=1)
    rows = rows[np.linalg.norm(rows[:, 4:], axis=1) > 0.5]  # sections have no segment without a normal
    segments = len(rows)
    sections = make_sections(1, segments, len(curve.disks))
    sections.segments[0, :segments] = rows
    sections.sources[0] = np.arange(sections.sources.shape[1])
    sections.disks[0, : len(curve.disks)] = curve.disks
    sections.disk_sources[0] = -1
    sections.counts[0] = segments, len(curve.disks), 0
    put_circles(sections, 0)
    return sections


def empty_answer(hand: HandArrays, candidates: int, contacts: int) -> ClosingArrays:
    """Return an answer to be written."""
    dofs, joints, axis_groups = len(hand.chain.dof_length), len(hand.chain.rate), len(hand.axis_group_pose)
    return ClosingArrays(
        np.zeros((candidates, dofs)),
        np.zeros((candidates, joints)),
        np.zeros(candidates, np.int64),
        np.zeros((candidates, contacts, CONTACT_INTEGERS), np.int64),
        np.zeros((candidates, contacts, 7)),
        np.zeros((candidates, axis_groups, 3, 4)),
        np.zeros(candidates, np.int64),
        np.full(candidates, -1, np.int64),
        np.zeros(candidates, np.int64),
    )


def solve_planar(
    finger: PlanarFinger,
    curve: PlanarCurve,
    hand: HandArrays | None = None,
    sections: SectionArrays | None = None,
    *,
    together: bool = False,
) -> tuple[tuple[StageAnswer, ...], ClosingArrays]:
    """Close a planar finger with the kernel; return its stages and the raw answer.

    Args:
        finger, curve: the case. hand, sections: the same, packed in a way of their own.
        together: all degrees of freedom move at once.
    """
    hand = pack_finger(finger) if hand is None else hand
    sections = pack_curve(curve) if sections is None else sections
    candidates = CandidateArrays(_ints([0]), _ints([0]), _ints([1]), np.full((1, len(finger.rates)), np.inf))
    answer = empty_answer(hand, 1, finger.dofs)
    obj = ObjectArrays(EMPTY_TREE, no_rounds(), not curve.two_sided, no_body())
    T = np.eye(4)[:3].copy()
    own = make_sections(1, 1, 0)  # for later axis groups, of which there are none
    close_candidates(hand, planes_only(1, 1), obj, T, (sections, own), candidates, answer, together=together)
    stopped = {int(h[4]) for h in answer.contact[0, : answer.contacts[0]]}
    stages = tuple(
        StageAnswer(g, float(answer.travel[0, g]), "contact" if g in stopped else "limit") for g in range(finger.dofs)
    )
    return stages, answer
