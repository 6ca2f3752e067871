"""Close every candidate of every finger in one call of the kernels (docs/method.md sections 2-5)."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from clench.base.keeping import kept_while_alive
from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .linkage import plan_frames
from .packing import pack_plans
from .plan import FingerPlan
from .scene import PackedObject
from .surface import round_arrays

if TYPE_CHECKING:
    from clench.kernels.batch_layout import ObjectArrays
    from clench.kernels.exact import ExactArrays
    from clench.kernels.frames import FrameArrays
    from clench.kernels.layout import ClosingArrays, HandArrays, ItemArrays, SectionArrays
    from clench.kernels.tree import MeshTree

Part = TypeVar("Part")

#: Segments per plane that an arena holds before it has to grow.
CAPACITY = 512
#: Around objects of fewer triangles, waking threads takes longer than the work.
THREADED = 1000


@dataclass(eq=False)
class HandPlan:
    """Hold the packed plans of a hand at its postures.

    Args:
        plans: one per finger and posture, in entry order. finger: index into the command's fingers of each entry.
        posture: index of the posture alternative of each entry.
        arrays: the plans packed. items: one per entry and plane, then the full width, if wanted; of a finger that does
            not lie in planes, the full width alone, without planes.
        whole: whether each item is the full width. together: all joints of a finger move at once.
    """

    plans: tuple[FingerPlan, ...]
    finger: tuple[int, ...]
    posture: tuple[int, ...]
    arrays: HandArrays
    items: ItemArrays
    whole: tuple[bool, ...]
    together: bool
    _frames: FrameArrays | None = None

    def frames(self, hand: Hand) -> FrameArrays:
        """Return the kinematics of the hand that was planned, packed once."""
        if self._frames is None:
            self._frames = plan_frames(hand, self.plans)
        return self._frames

    def joints_of(self, entry: int) -> slice:
        """Return the range of an entry's joints in the packed arrays."""
        first = sum(len(plan.joints) for plan in self.plans[:entry])
        return slice(first, first + len(self.plans[entry].joints))

    @property
    def most_planes(self) -> int:
        """Return the number of planes of the largest entry."""
        return max(sum(len(f.offsets) for f in plan.families) for plan in self.plans)


@dataclass(frozen=True, eq=False)
class ClosedHand:
    """Hold what the kernels computed.

    Args:
        answer: per item, see `ClosingArrays`. overlaps: per entry, an outline that overlaps at the start, or -1.
        sections: of every entry's first family. T_palm_object: where the object is, shape (4, 4).
    """

    answer: ClosingArrays
    overlaps: np.ndarray
    sections: SectionArrays
    T_palm_object: FloatArray


def make_hand_plan(
    plans: Sequence[FingerPlan],
    finger: Sequence[int],
    posture: Sequence[int],
    full_width: bool,
    together: bool,
    again: bool = False,
) -> HandPlan:
    """Pack plans and list their items of work.

    Args:
        plans, finger, posture, together: see `HandPlan`. full_width: wanted. again: joints move in several rounds.
    """
    from clench.kernels.layout import ItemArrays

    rows = []
    for entry, plan in enumerate(plans):
        count = len(plan.families[0].offsets)
        planar = plan.lies_in_planes(together or again)
        rows += [(entry, k, k + 1, 0) for k in range(count) if planar]
        if full_width:
            rows.append((entry, 0, count if planar else 0, 1))
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    entries, low, high = (np.ascontiguousarray(table[:, k]) for k in range(3))
    arrays = pack_plans(plans)
    items = ItemArrays(entries, low, high, until=np.full((len(table), len(arrays.chain.rate)), np.inf))
    whole = tuple(map(bool, table[:, 3]))
    return HandPlan(tuple(plans), tuple(finger), tuple(posture), arrays, items, whole, together)


def items_around(plan: HandPlan, packed: PackedObject | None) -> ItemArrays:
    """Return the items of a plan as they close around an object, or around none.

    The full width needs no planes around what is swept exactly: the sweep alone is sooner done. Around cylinders
    and ellipsoids, which are swept as polyhedra, it stops where a plane shows the true shape to be touched before.
    """
    if packed is not None and packed.is_curved:
        return plan.items
    return plan.items._replace(high=np.where(plan.whole, plan.items.low, plan.items.high))


def planes_tell(items: ItemArrays, whole: Sequence[bool]) -> bool:
    """Say whether planes tell, too, which fingers overlap the object at the start; of the full width the links do.

    Args:
        items: see `items_around`. whole: see `HandPlan`.
    """
    planar = items.low < items.high
    return bool(planar[np.array(whole, dtype=bool)].any() if any(whole) else planar.any())


def close_hand(
    plan: HandPlan, exact: ExactArrays, packed: PackedObject, T_palm_object: FloatArray, rounds: int
) -> ClosedHand:
    """Cut the object, look for overlaps at the start where planes tell of them, and close every item.

    Args:
        plan: of the hand. exact: for the items that are swept exactly; the object is put in. packed: the object.
        T_palm_object: where it is, shape (4, 4).
        rounds: how often all degrees of freedom are gone through.
    """
    from clench.kernels.family_section import cut_first_families, make_sections
    from clench.kernels.overlap import find_overlaps
    from clench.kernels.warming import announce

    announce(in_full=True)

    T = np.ascontiguousarray(T_palm_object[:3])
    obj = object_for_closing(packed)
    items, arena = items_around(plan, packed), arena_of(obj.tree)
    planar = bool((items.low < items.high).any())
    shared = make_sections(len(plan.arrays.plane_offset), arena.capacity, len(obj.rounds.kind))
    scratch = np.empty((2, 3, 4))
    while planar and (wanted := cut_first_families(plan.arrays, obj.tree, obj.rounds, T, shared, scratch)):
        arena.grow(wanted)
        shared = make_sections(len(plan.arrays.plane_offset), arena.capacity, len(obj.rounds.kind))
    overlaps = np.full(len(plan.plans), -1, dtype=np.int64)
    if planes_tell(items, plan.whole):
        find_overlaps(plan.arrays, obj.tree, obj.rounds, obj.closed, T, shared, overlaps)
    answer = _close_plan(replace(plan, items=items), exact, obj, T, shared, rounds)
    return ClosedHand(answer, overlaps, shared, T_palm_object)


@dataclass(eq=False)
class Arena:
    """Hold how many segments per plane have been enough for an object so far."""

    capacity: int

    def grow(self, wanted: int) -> None:
        """Make room for twice of what was wanted, so that the next pose hardly needs more."""
        self.capacity = max(self.capacity, 2 * wanted)


def arena_of(tree: MeshTree) -> Arena:
    """Return the arena's size for the triangles of an object; no answer depends on it."""
    return _arena(tree.triangles)


@kept_while_alive
def _arena(triangles: NDArray[np.int32]) -> Arena:
    return Arena(CAPACITY)


def object_for_closing(packed: PackedObject) -> ObjectArrays:
    """Return an object as the closing kernels take it."""
    from clench.kernels.batch_layout import ObjectArrays

    return ObjectArrays(packed.tree, round_arrays(packed), packed.closed, packed.bodies)


@lru_cache(maxsize=1)
def nothing_to_close() -> ObjectArrays:
    """Return an object that is nowhere."""
    from clench.kernels.batch_layout import ObjectArrays
    from clench.kernels.bodies import no_body
    from clench.kernels.layout import no_rounds
    from clench.kernels.tree import build_tree

    return ObjectArrays(build_tree(np.empty((0, 3)), np.empty((0, 3))), no_rounds(), True, no_body())


def _close_plan(
    plan: HandPlan,
    exact: ExactArrays,
    obj: ObjectArrays,
    T: FloatArray,
    shared: SectionArrays,
    rounds: int,
) -> ClosingArrays:
    """Close the items of a plan, with arenas for later families that grow until they are large enough."""
    arena = arena_of(obj.tree)
    # Items know nothing of each other, and kernels hold no lock: the answer is the same for any ranges and threads.
    alone = len(obj.tree.triangles) < THREADED
    ranges = [(0, len(plan.items.entry))] if alone else _entry_ranges(plan)
    exact = exact._replace(object=obj.bodies)
    while True:
        answer = empty_answer(plan)
        close = partial(_close_range, plan, exact, obj, T, shared, arena.capacity, rounds, answer)
        share_out(close, ranges, core_count())
        wanted = int(answer.overflow.max(initial=0))
        if not wanted:
            return answer
        arena.grow(wanted)


@lru_cache(maxsize=1)
def core_count() -> int:
    """Return how many cores there are; asking the system takes a tenth of a millisecond."""
    return os.cpu_count() or 1


@lru_cache(maxsize=4)
def kernel_threads(count: int) -> ThreadPoolExecutor:
    """Return so many threads for kernels to run in."""
    return ThreadPoolExecutor(count, thread_name_prefix="clench")


def share_out(work: Callable[[Part], None], parts: Iterable[Part], threads: int) -> None:
    """Do parts of a work in this thread and others; whichever is free takes the next part.

    Others that have not begun when nothing is left, as on a busy machine, are not waited for.
    """
    waiting = deque(parts)

    def take_parts() -> None:
        while waiting:
            try:
                part = waiting.popleft()
            except IndexError:  # another thread took the last one in the meantime
                return
            work(part)

    others = min(threads, len(waiting)) - 1
    helpers = [kernel_threads(others).submit(take_parts) for _ in range(others)]
    try:
        take_parts()
    finally:
        waiting.clear()
        for helper in helpers:
            if not helper.cancel():
                helper.result()


# A forked process has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=kernel_threads.cache_clear)


def _entry_ranges(plan: HandPlan) -> list[tuple[int, int]]:
    """Return the range of items of every entry."""
    firsts = [0, *(np.flatnonzero(np.diff(plan.items.entry)) + 1).tolist(), len(plan.items.entry)]
    return list(pairwise(firsts))


def _close_range(
    plan: HandPlan,
    exact: ExactArrays,
    obj: ObjectArrays,
    T: FloatArray,
    shared: SectionArrays,
    capacity: int,
    rounds: int,
    answer: ClosingArrays,
    span: tuple[int, int],
) -> None:
    """Close the items of a range, and write their part of the answer."""
    from clench.kernels.closing import close_items
    from clench.kernels.family_section import make_sections
    from clench.kernels.layout import ClosingArrays

    own = make_sections(plan.most_planes, capacity, len(obj.rounds.kind))
    part = slice(*span)
    columns: list[Any] = [array[part] for array in answer]
    close_items(
        plan.arrays,
        exact._replace(wanted=exact.wanted[part]),
        obj.tree,
        obj.rounds,
        obj.closed,
        T,
        shared,
        own,
        _only(plan.items, part),
        rounds,
        plan.together,
        ClosingArrays(*columns),
    )


def only_items(plan: HandPlan, items: Sequence[int]) -> HandPlan:
    """Return a plan with some of its items alone."""
    return replace(plan, items=_only(plan.items, items), whole=tuple(plan.whole[i] for i in items))


def close_items_again(
    plan: HandPlan,
    exact: ExactArrays,
    packed: PackedObject | None,
    closed: ClosedHand,
    items: Sequence[int],
    rounds: int,
) -> ClosedHand:
    """Close items again, with other links in their way than before.

    Args:
        plan: of the hand. exact: for these items alone. packed: the object, or None to leave it out.
        closed: as the whole hand was closed before. items: their numbers. rounds: as for `close_hand`.
    """
    from clench.kernels.family_section import make_sections

    T = np.ascontiguousarray(closed.T_palm_object[:3])
    obj, shared = nothing_to_close(), closed.sections
    if packed is None:
        shared = make_sections(len(plan.arrays.plane_offset), 0, 0)
    else:
        obj = object_for_closing(packed)
    some = only_items(plan, items)
    some = replace(some, items=items_around(some, packed))
    answer = _close_plan(some, exact, obj, T, shared, rounds)
    return ClosedHand(answer, closed.overlaps, shared, closed.T_palm_object)


def empty_answer(plan: HandPlan) -> ClosingArrays:
    """Return the arrays that the kernels write, with room for one contact per joint."""
    from clench.kernels.layout import HIT_FLOATS, HIT_INTEGERS, ClosingArrays

    items = len(plan.items.entry)
    contacts = max(len(p.joints) for p in plan.plans)
    return ClosingArrays(
        travel=np.zeros((items, len(plan.arrays.chain.group_length))),
        turn=np.zeros((items, len(plan.arrays.chain.rate))),
        contacts=np.zeros(items, dtype=np.int64),
        hit=np.zeros((items, contacts, HIT_INTEGERS), dtype=np.int64),
        point=np.zeros((items, contacts, HIT_FLOATS)),
        pose=np.zeros((items, len(plan.arrays.family_pose), 3, 4)),
        overflow=np.zeros(items, dtype=np.int64),
        overlap=np.full(items, -1, dtype=np.int64),
        skipped=np.zeros(items, dtype=np.int64),
    )


def _only(items: ItemArrays, part: slice | Sequence[int]) -> ItemArrays:
    return items._replace(entry=items.entry[part], low=items.low[part], high=items.high[part], until=items.until[part])
