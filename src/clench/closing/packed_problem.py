"""Pack a plan, an object and the command's options into the arrays of the kernels (docs/method.md sections 4-6)."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from clench.closing.collision.containment import link_within_link
from clench.closing.collision.depths import link_mesh_arrays, mesh_mask, object_mesh
from clench.closing.collision.object_surface import object_surface, round_arrays
from clench.closing.collision.packed_object import PackedObject
from clench.models.hand.hand import Finger

from .finger_links import pack_finger_links
from .hand_plan import HandPlan
from .start_blocking import link_masks

if TYPE_CHECKING:
    from clench.kernels.closing.solve_layout import Arena, CommandArrays, ObjectArrays, ProblemArrays

#: Segments per plane that an arena holds before it has to grow.
CAPACITY: Final = 512
#: Packed problems that an object keeps, the latest made.
KEPT_PROBLEMS: Final = 64
#: Arenas that no thread uses, by the sizes of their arrays, latest used last.
_ARENAS: Final[OrderedDict[tuple[int, ...], list[Arena]]] = OrderedDict()
_KEPT_ARENAS: Final = 16
_LENDING: Final = Lock()
#: One thread at a time finds what the fingers of a plan meet first.
_FINDING: Final = Lock()

#: Criteria in a sum: their codes, and what one unit of each adds.
Terms = tuple[tuple[int, float], ...]


@dataclass(frozen=True, eq=False)
class PackedProblem:
    """A plan and an object, packed for the kernels at any poses.

    Args:
        plan: of the hand. arrays: input of the kernels. capacity: see `Capacity`, the same for all plans of an object.
    """

    plan: HandPlan
    arrays: ProblemArrays
    capacity: Capacity

    @cached_property
    def kept(self) -> ProblemArrays:
        """The arrays where kernels find them by one pointer."""
        from clench.kernels.closing.first_meetings import find_first_meetings
        from clench.kernels.runtime.by_reference import kept

        arrays = kept(self.arrays)
        swept = self.arrays.full_width
        with _FINDING:
            if swept.requested.any() and not (swept.first.known[:, 1] >= 0.0).any():
                find_first_meetings(arrays)
        return arrays

    def staying(self, present: NDArray[np.int64], margin: float) -> PackedProblem:
        """Return the problem with other candidates that go before others; see `CommandArrays`."""
        command = self.arrays.command._replace(present=present, margin=margin)
        return replace(self, arrays=self.arrays._replace(command=command))

    @property
    def most_planes(self) -> int:
        """Number of planes of the largest finger posture."""
        hand = self.arrays.hand
        return int(np.diff(hand.axis_group_plane[hand.first_axis_group]).max())

    @property
    def most_contacts(self) -> int:
        """Number of joints of the largest finger posture, each of which one contact may stop."""
        return int(np.diff(self.arrays.full_width.joint_first).max())

    @contextmanager
    def arena(self) -> Iterator[Arena]:
        """Lend arenas as large as the object needed so far; threads get each their own."""
        shape = (*self._arena_shape, self.capacity.segments)
        with _LENDING:
            free = _ARENAS.get(shape)
            arena = free.pop() if free else None
        if arena is None:
            arena = _make_arena(shape)
        yield arena
        with _LENDING:
            _ARENAS.setdefault(shape, []).append(arena)
            _ARENAS.move_to_end(shape)
            while sum(map(len, _ARENAS.values())) > _KEPT_ARENAS:
                oldest = next(iter(_ARENAS))
                if _ARENAS[oldest]:
                    _ARENAS[oldest].pop()
                else:
                    del _ARENAS[oldest]

    @cached_property
    def _arena_shape(self) -> tuple[int, int, int]:
        return len(self.arrays.hand.plane_offset), self.most_planes, len(self.arrays.target.rounds.kind)


def _make_arena(shape: tuple[int, ...]) -> Arena:
    from clench.kernels.closing.solve_layout import Arena
    from clench.kernels.runtime.by_reference import kept
    from clench.kernels.sections.plane_sections import make_sections

    first, later, rounds, capacity = shape
    sections = [make_sections(count, capacity, rounds) for count in (first, later)]
    return kept(Arena(*sections, *(make_sections(count, 0, 0) for count in (first, later))))


@dataclass(eq=False)
class Capacity:
    """The largest number of segments per plane so far for an object; no answer depends on it."""

    segments: int = CAPACITY

    def grow(self, wanted: int) -> None:
        """Make room for twice the wanted number, so that the next pose rarely needs more."""
        self.segments = max(self.segments, 2 * wanted)


def capacity_of(packed: PackedObject) -> Capacity:
    """Return how large the arenas for an object are."""
    return packed.kept(("capacity",), Capacity)


def pack_problem(plan: HandPlan, packed: PackedObject, terms: Terms, tip_only: bool) -> PackedProblem:
    """Return a plan and an object packed for the kernels; packed once.

    Args:
        plan: of the hand. packed: the object. terms: of the sum that chooses among planes; empty if there is no choice
            or the caller chooses. tip_only: only fingertips may touch.
    """
    problems = packed.kept(("problems",), OrderedDict[tuple[int, Terms, bool], PackedProblem])
    key = (id(plan), terms, tip_only)
    entry = problems.get(key)
    if entry is None:
        entry = problems[key] = PackedProblem(plan, _pack(plan, packed, terms, tip_only), capacity_of(packed))
        while len(problems) > KEPT_PROBLEMS:
            problems.popitem(last=False)
    return entry


def _pack(plan: HandPlan, packed: PackedObject, terms: Terms, tip_only: bool) -> ProblemArrays:
    from clench.kernels.closing.solve_layout import ProblemArrays

    target, bodies, candidates = object_arrays(packed), plan.bodies, plan.candidates
    return ProblemArrays(
        hand=plan.arrays(planar=bool((candidates.low < candidates.high).any())),
        full_width=plan.full_width_arrays._replace(object=target.bodies, alone=True),
        candidates=candidates,
        target=target,
        nothing=nothing_to_close(),
        frames=plan.frames,
        surface=object_surface(packed),
        mesh=object_mesh(packed),
        meshes=link_mesh_arrays(plan.hand, plan.source),
        across=bodies.across,
        apart=np.asarray(bodies.across - bodies.within),
        command=_pack_command(plan, terms, tip_only),
        fingers=pack_finger_links(plan),
    )


def _pack_command(plan: HandPlan, terms: Terms, tip_only: bool) -> CommandArrays:
    from clench.kernels.closing.solve_layout import CommandArrays

    hand, source, start = plan.hand, plan.source, plan.start
    meshes, masks = link_mesh_arrays(hand, source), link_masks(hand, plan.plans, source)
    fingers = plan.fingers
    return CommandArrays(
        start=start,
        start_pose=np.ascontiguousarray(hand.link_poses(start)[:, :3]),
        fixed=mesh_mask(meshes, hand.fixed_links),
        fingers=mesh_mask(meshes, [link for finger in hand.fingers for link in finger.links]),
        own=masks.own,
        resting=masks.resting,
        joints=_own_joints([p.finger for p in plan.plans]),
        finger=np.array(plan.finger, dtype=np.int64),
        thumb=np.array([finger.is_thumb for finger in fingers], dtype=np.int64),
        tip=np.array([finger.tip_link if tip_only else -1 for finger in fingers], dtype=np.int64),
        worth=np.array([worth for _, worth in terms], dtype=np.float64),
        term=np.array([term for term, _ in terms], dtype=np.int64),
        present=np.full(len(fingers), -1, dtype=np.int64),
        margin=0.0,
        times=plan.times,
        together=plan.together,
        full_width=plan.full,
        chosen=plan.candidate_finger == list(range(len(fingers))),
        several=plan.several,
        nested=link_within_link(hand, start, source, plan.bodies.across) is not None,
        idle=len(plan.idle),
        alone=len(hand.fingers) == 1,
    )


def _own_joints(fingers: Sequence[Finger]) -> np.ndarray:
    joints = np.full((len(fingers), max(len(finger.joints) for finger in fingers)), -1, dtype=np.int64)
    for row, finger in zip(joints, fingers, strict=True):
        row[: len(finger.joints)] = finger.joints
    return joints


def object_arrays(packed: PackedObject) -> ObjectArrays:
    """Return an object as the closing kernels take it."""
    from clench.kernels.closing.solve_layout import ObjectArrays

    return ObjectArrays(packed.tree, round_arrays(packed), packed.closed, packed.bodies)


@lru_cache(maxsize=1)
def nothing_to_close() -> ObjectArrays:
    """Return an object that is nowhere."""
    from clench.kernels.closing.layout import no_rounds
    from clench.kernels.closing.solve_layout import ObjectArrays
    from clench.kernels.geometry.bodies import no_body
    from clench.kernels.trees.bvh import build_tree

    return ObjectArrays(build_tree(np.empty((0, 3)), np.empty((0, 3))), no_rounds(), True, no_body())
