"""The plan of a hand at a posture: closing joints, planes and order (docs/method.md sections 1-5).

A plan is independent of the object and the pose, so every object and every pose can share it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Finger, Hand
from clench.models.shapes import CollisionSource

from .finger_plan import FingerPlan
from .link_bodies import HandBodies, hand_bodies, pack_full_width
from .linkage import plan_frames
from .plan_packing import PackedPlans

if TYPE_CHECKING:
    from clench.kernels.closing.layout import CandidateArrays, HandArrays
    from clench.kernels.geometry.link_frames import FrameArrays
    from clench.kernels.toi.full_width import FullWidthArrays


@dataclass(frozen=True, eq=False)
class HandPlan:
    """The plans of a hand's fingers, packed for the kernels; E finger postures (a finger at one posture), I candidates.

    Args:
        hand: the hand. start: posture before closing, shape (J,) [rad]. source: geometry of its links.
        plans: one per finger posture. finger: index into the fingers that close, of each finger posture. posture: index
            of the posture alternative of each finger posture. idle: fingers asked for that no joint closes.
        packing: the plans packed. full_width_arrays: the links packed, and which candidates sweep them; the object is
            left out.
        candidates: of each finger posture its planes, one by one, then the full width, if requested, without planes. A
            finger posture that does not lie in planes has the full width alone.
        is_full_width: whether each candidate is the full width.
        full: the command asks for the full width. together: all joints of the hand move simultaneously. times: number
            of passes through the degrees of freedom.
    """

    hand: Hand
    start: FloatArray
    source: CollisionSource
    plans: tuple[FingerPlan, ...]
    finger: tuple[int, ...]
    posture: tuple[int, ...]
    idle: tuple[Finger, ...]
    packing: PackedPlans
    full_width_arrays: FullWidthArrays
    candidates: CandidateArrays
    is_full_width: tuple[bool, ...]
    full: bool
    together: bool
    times: int

    def arrays(self, planar: bool) -> HandArrays:
        """Return the plans packed.

        Args:
            planar: planes are swept, so the outlines of the links are needed.
        """
        return self.packing.with_outlines if planar else self.packing.without_outlines

    @cached_property
    def frames(self) -> FrameArrays:
        """The kinematics of the hand."""
        return plan_frames(self.hand, self.plans)

    @cached_property
    def bodies(self) -> HandBodies:
        """The links of the hand as bodies."""
        return hand_bodies(self.hand, self.source, self.start)

    @cached_property
    def fingers(self) -> tuple[Finger, ...]:
        """The fingers that close."""
        first = {f: plan.finger for f, plan in reversed(list(zip(self.finger, self.plans, strict=True)))}
        return tuple(first[f] for f in sorted(first))

    @cached_property
    def candidate_finger(self) -> list[int]:
        """Finger of each candidate, as `finger` counts them."""
        return [self.finger[finger_posture] for finger_posture in self.candidates.finger_posture.tolist()]

    @property
    def several(self) -> bool:
        """Whether a finger has several postures."""
        return len(set(self.finger)) < len(self.plans)

    @cached_property
    def full_width(self) -> HandPlan | None:
        """The full width of every finger alone; None where a finger has several of them, or none."""
        candidates = np.flatnonzero(self.is_full_width)
        fingers = {self.candidate_finger[i] for i in candidates}
        return self.only(candidates.tolist()) if len(candidates) == len(fingers) == len(self.plans) else None

    @cached_property
    def planes(self) -> HandPlan:
        """The single planes of every finger alone."""
        return self.only(np.flatnonzero(~np.array(self.is_full_width)).tolist())

    @cached_property
    def plane_counts(self) -> list[int]:
        """Number of candidates on single planes, per finger posture."""
        single = self.candidates.finger_posture[~np.array(self.is_full_width)]
        return [int((single == finger_posture).sum()) for finger_posture in range(len(self.plans))]

    def only(self, candidates: Sequence[int]) -> HandPlan:
        """Return the plan with some of its candidates alone."""
        columns: list[Any] = [np.ascontiguousarray(column[candidates]) for column in self.candidates]
        full_width_arrays = self.full_width_arrays._replace(
            requested=np.ascontiguousarray(self.full_width_arrays.requested[candidates])
        )
        is_full_width = tuple(self.is_full_width[i] for i in candidates)
        return replace(
            self,
            candidates=type(self.candidates)(*columns),
            full_width_arrays=full_width_arrays,
            is_full_width=is_full_width,
        )


def make_hand_plan(
    hand: Hand,
    start: FloatArray,
    source: CollisionSource,
    finger_postures: Sequence[tuple[FingerPlan, int, int]],
    *,
    idle: Sequence[Finger] = (),
    full_width: bool = True,
    together: bool = False,
    times: int = 1,
) -> HandPlan:
    """Pack the plans of fingers and list the candidates.

    Args:
        hand, start, source, idle, together, times: see `HandPlan`. full_width: close the full width, too.
        finger_postures: plan, index of the finger, and index of the posture, finger by finger.
    """
    from clench.kernels.closing.layout import CandidateArrays

    plans, rows = tuple(plan for plan, _, _ in finger_postures), []
    for e, plan in enumerate(plans):
        count = len(plan.axis_groups[0].offsets)
        planar = plan.lies_in_planes(together or times != 1)
        rows += [(e, k, k + 1, 0) for k in range(count) if planar]
        if full_width:
            rows.append((e, 0, 0, 1))
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    is_full_width, packing = tuple(map(bool, table[:, 3])), PackedPlans(plans)
    finger_posture, low, high = (np.ascontiguousarray(table[:, k]) for k in range(3))
    candidates = CandidateArrays(
        finger_posture, low, high, until=np.full((len(table), sum(len(plan.joints) for plan in plans)), np.inf)
    )
    bodies = hand_bodies(hand, source, start)
    full_width_arrays = pack_full_width(hand, plans, is_full_width, bodies)
    if together:
        full_width_arrays = full_width_arrays._replace(checked=_with_resting(hand, plans, bodies))
    return HandPlan(
        hand=hand,
        start=start,
        source=source,
        plans=plans,
        finger=tuple(finger for _, finger, _ in finger_postures),
        posture=tuple(posture for _, _, posture in finger_postures),
        idle=tuple(idle),
        packing=packing,
        full_width_arrays=full_width_arrays,
        candidates=candidates,
        is_full_width=is_full_width,
        full=full_width,
        together=together,
        times=times,
    )


def _with_resting(hand: Hand, plans: Sequence[FingerPlan], bodies: HandBodies) -> np.ndarray:
    """Return the pairs of links that may not overlap while all fingers close: resting fingers are in the way."""
    closing = {plan.finger.name for plan in plans}
    resting = [link for f in hand.fingers if f.name not in closing for link in f.links]
    checked = bodies.within.copy()
    checked[:, resting] = bodies.across[:, resting]
    return checked
