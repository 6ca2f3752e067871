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
from .link_bodies import HandBodies, hand_bodies, pack_exact
from .linkage import plan_frames
from .plan_packing import PackedPlans

if TYPE_CHECKING:
    from clench.kernels.closing.layout import HandArrays, ItemArrays
    from clench.kernels.geometry.link_frames import FrameArrays
    from clench.kernels.toi.full_width import ExactArrays


@dataclass(frozen=True, eq=False)
class HandPlan:
    """The plans of a hand's fingers, packed for the kernels; E entries (a finger at one posture), I items.

    Args:
        hand: the hand. start: posture before closing, shape (J,) [rad]. source: geometry of its links.
        plans: one per entry. finger: index into the fingers that close, of each entry. posture: index of the posture
            alternative of each entry. idle: fingers asked for that no joint closes.
        packing: the plans packed. exact: the links packed, and which items sweep them; the object is left out.
        items: of each entry its planes, one by one, then the full width, if wanted. An entry that does not lie in
            planes has the full width alone, without planes.
        whole: whether each item is the full width.
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
    exact: ExactArrays
    items: ItemArrays
    whole: tuple[bool, ...]
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
    def item_finger(self) -> list[int]:
        """Finger of each item, as `finger` counts them."""
        return [self.finger[entry] for entry in self.items.entry.tolist()]

    @property
    def several(self) -> bool:
        """Whether a finger has entries of several postures."""
        return len(set(self.finger)) < len(self.plans)

    @cached_property
    def full_width(self) -> HandPlan | None:
        """The full width of every finger alone; None where a finger has several of them, or none."""
        items = np.flatnonzero(self.whole)
        fingers = {self.item_finger[i] for i in items}
        return self.only(items.tolist()) if len(items) == len(fingers) == len(self.plans) else None

    @cached_property
    def planes(self) -> HandPlan:
        """The single planes of every finger alone."""
        return self.only(np.flatnonzero(~np.array(self.whole)).tolist())

    @cached_property
    def plane_counts(self) -> list[int]:
        """Number of items on single planes, per entry."""
        single = self.items.entry[~np.array(self.whole)]
        return [int((single == entry).sum()) for entry in range(len(self.plans))]

    def only(self, items: Sequence[int]) -> HandPlan:
        """Return the plan with some of its items alone."""
        columns: list[Any] = [np.ascontiguousarray(column[items]) for column in self.items]
        exact = self.exact._replace(wanted=np.ascontiguousarray(self.exact.wanted[items]))
        whole = tuple(self.whole[i] for i in items)
        return replace(self, items=type(self.items)(*columns), exact=exact, whole=whole)


def make_hand_plan(
    hand: Hand,
    start: FloatArray,
    source: CollisionSource,
    entries: Sequence[tuple[FingerPlan, int, int]],
    *,
    idle: Sequence[Finger] = (),
    full_width: bool = True,
    together: bool = False,
    times: int = 1,
) -> HandPlan:
    """Pack the plans of fingers and list the items.

    Args:
        hand, start, source, idle, together, times: see `HandPlan`. full_width: close the full width, too.
        entries: plan, index of the finger, and index of the posture, finger by finger.
    """
    from clench.kernels.closing.layout import ItemArrays

    plans, rows = tuple(plan for plan, _, _ in entries), []
    for e, plan in enumerate(plans):
        count = len(plan.families[0].offsets)
        planar = plan.lies_in_planes(together or times != 1)
        rows += [(e, k, k + 1, 0) for k in range(count) if planar]
        if full_width:
            rows.append((e, 0, count if planar else 0, 1))
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    whole, packing = tuple(map(bool, table[:, 3])), PackedPlans(plans)
    entry, low, high = (np.ascontiguousarray(table[:, k]) for k in range(3))
    items = ItemArrays(entry, low, high, until=np.full((len(table), sum(len(plan.joints) for plan in plans)), np.inf))
    bodies = hand_bodies(hand, source, start)
    exact = pack_exact(hand, plans, whole, bodies)
    if together:
        exact = exact._replace(checked=_with_resting(hand, plans, bodies))
    return HandPlan(
        hand=hand,
        start=start,
        source=source,
        plans=plans,
        finger=tuple(finger for _, finger, _ in entries),
        posture=tuple(posture for _, _, posture in entries),
        idle=tuple(idle),
        packing=packing,
        exact=exact,
        items=items,
        whole=whole,
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
