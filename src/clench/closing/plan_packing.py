"""Pack the plans of several fingers into the arrays that the kernels read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray, invert

from .finger_plan import FingerPlan
from .outlines import RoundedOutline

if TYPE_CHECKING:
    from clench.kernels.closing.layout import ChainArrays, HandArrays, OutlineArrays


@dataclass(frozen=True, eq=False)
class PackedPlans:
    """Pack plans, one finger posture each, with every index global; see `HandArrays`.

    Args:
        plans: of the fingers.
    """

    plans: tuple[FingerPlan, ...]

    @cached_property
    def without_outlines(self) -> HandArrays:
        """What closings that sweep no plane read; it saves cutting the links."""
        from clench.kernels.closing.layout import HandArrays

        axis_groups = [f for plan in self.plans for f in plan.axis_groups]
        planes = [len(f.offsets) for f in axis_groups]
        return HandArrays(
            first_dof=_firsts([len(plan.lengths) for plan in self.plans]),
            first_axis_group=_firsts([len(plan.axis_groups) for plan in self.plans]),
            chain=_chain(self.plans),
            outlines=_outlines([]),
            axis_group_pose=np.array([pose for plan in self.plans for pose in _relative_poses(plan)]).reshape(-1, 3, 4),
            axis_group_plane=_firsts(planes),
            plane_offset=np.concatenate([f.offsets for f in axis_groups]) if axis_groups else np.empty(0),
            axis_group_reach=np.zeros(len(axis_groups)),
            axis_group_length=np.array([plan.length for plan in self.plans for _ in plan.axis_groups]),
            plane_outline=np.zeros(sum(planes) + 1, dtype=np.int64),
        )

    @cached_property
    def with_outlines(self) -> HandArrays:
        """What closings on planes read."""
        axis_groups = [f for plan in self.plans for f in plan.axis_groups]
        return self.without_outlines._replace(
            outlines=_outlines(self.plans),
            axis_group_reach=np.array([f.reach for f in axis_groups]),
            plane_outline=_firsts([len(row) for f in axis_groups for row in f.outlines]),
        )


def _firsts(counts: list[int]) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _relative_poses(plan: FingerPlan) -> list[FloatArray]:
    """Return the pose of the first axis group in the palm, and of each other one on the last pivot before it."""
    poses = []
    for f, axis_group in enumerate(plan.axis_groups):
        pose = axis_group.T_palm_axis_group
        if f:
            before = plan.axis_groups[f - 1].T_palm_axis_group.copy()
            last = [p for p in plan.joints if p.axis_group == f - 1][-1]
            before[:3, 3] += before[:3, 0] * last.pivot[0] + before[:3, 2] * last.pivot[1]
            pose = invert(before) @ pose
        poses.append(pose[:3])
    return poses


def _chain(plans: Sequence[FingerPlan]) -> ChainArrays:
    from clench.kernels.closing.layout import ChainArrays

    joints, axis_group_first, dof_first = [], 0, 0
    for plan in plans:
        before = None
        for p in plan.joints:
            same = before is not None and before.axis_group == p.axis_group
            offset = p.pivot - before.pivot if same and before is not None else p.pivot
            joints.append((p.axis_group + axis_group_first, p.dof + dof_first, offset, p.rate, p.start, p.stop))
            before = p
        axis_group_first += len(plan.axis_groups)
        dof_first += len(plan.lengths)
    return ChainArrays(
        joint_axis_group=np.array([j[0] for j in joints], dtype=np.int64),
        joint_dof=np.array([j[1] for j in joints], dtype=np.int64),
        pivot=np.array([j[2] for j in joints]).reshape(-1, 2),
        rate=np.array([j[3] for j in joints], dtype=np.float64),
        start=np.array([j[4] for j in joints], dtype=np.float64),
        stop=np.array([j[5] for j in joints], dtype=np.float64),
        dof_length=np.array([length for plan in plans for length in plan.lengths], dtype=np.float64),
        speed=np.array([speed for plan in plans for speed in plan.speeds], dtype=np.float64),
        breaks=np.array([breaks for plan in plans for breaks in plan.breaks], dtype=np.int64),
    )


def _outlines(plans: Sequence[FingerPlan]) -> OutlineArrays:
    from clench.kernels.closing.layout import OutlineArrays

    joint, link, outlines = [], [], []
    joint_first = 0
    for plan in plans:
        for axis_group in plan.axis_groups:
            for item in (o for row in axis_group.outlines for o in row):
                joint.append(item.joint + joint_first)
                link.append(item.link)
                outlines.append(item.outline)
        joint_first += len(plan.joints)
    stadiums = [enclosing(o) for o in outlines]
    return OutlineArrays(
        joint=np.array(joint, dtype=np.int64),
        link=np.array(link, dtype=np.int64),
        radius=np.array([o.radius for o in outlines], dtype=np.float64),
        both=np.array([o.both for o in outlines], dtype=np.int64),
        stadium=np.array(stadiums).reshape(-1, 5),
        vertex_first=_firsts([len(o.vertices) for o in outlines]),
        vertex=np.concatenate([o.vertices for o in outlines]) if outlines else np.empty((0, 2)),
        side_first=_firsts([len(o.sides) for o in outlines]),
        side=np.concatenate([o.sides for o in outlines]) if outlines else np.empty((0, 5)),
    )


def enclosing(outline: RoundedOutline) -> FloatArray:
    """Return a stadium that an outline lies in: its two ends and its radius, (5,); the narrowest along a side."""
    vertices, radius = outline.vertices, outline.radius
    if len(vertices) == 1 or not len(outline.sides):
        middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        return np.array([*middle, *middle, _widened(np.linalg.norm(vertices - middle, axis=1).max(), radius)])
    across = outline.sides[:, :2] @ vertices.T
    narrow = np.argmin(np.ptp(across, axis=1))
    n, d = outline.sides[narrow, :2], across[narrow]
    along = np.array([-n[1], n[0]])
    t, middle = vertices @ along, 0.5 * (d.max() + d.min()) * n
    return np.array([*(middle + t.min() * along), *(middle + t.max() * along), _widened(0.5 * np.ptp(d), radius)])


def _widened(reach: float, radius: float) -> float:
    """Add an outline's radius to the reach of its vertices, and a bound on rounding errors."""
    return float(reach + radius) * (1.0 + 1e-9)
