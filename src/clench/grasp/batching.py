"""Pack a problem, so that kernels solve it at many poses (docs/method.md sections 4 to 6)."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray
from clench.models.hand.hand import Finger, Hand
from clench.models.shapes import CollisionSource

from .blocking import link_masks
from .calibration import Calibration
from .closing import HandPlan, items_around, nothing_to_close, object_for_closing
from .containment import link_within_link
from .criterion_registry import ALWAYS
from .depths import link_mesh_arrays, mesh_mask, object_mesh
from .exact import HandBodies
from .scene import PackedObject
from .surface import object_surface

if TYPE_CHECKING:
    from clench.kernels.batch_layout import ObjectArrays, Wanted
    from clench.kernels.batch_solving import Asked, Room
    from clench.kernels.exact import ExactArrays
    from clench.kernels.frames import FrameArrays
    from clench.kernels.layout import ClosingArrays, HandArrays, ItemArrays
    from clench.kernels.link_meshes import LinkMeshArrays, ObjectMesh
    from clench.kernels.touches import SurfaceArrays

#: Sums of more numbers are added up in another order by NumPy.
_MOST_JOINTS: Final = 7

#: Scratch space that no thread uses, by what its arrays' shapes depend on, the latest used last.
_ROOMS: Final[OrderedDict[tuple[int, ...], list[Room]]] = OrderedDict()
_KEPT_ROOMS: Final = 16
_LENDING: Final = Lock()


@dataclass(frozen=True, eq=False)
class PackedProblem:
    """Hold everything that the kernels of a batch read, but for the poses.

    Args:
        hand, exact, items, frames, meshes, wanted: see `clench.kernels.batch_solving` and `batch_judging`.
        target: the object; mesh, surface: how it is measured and read.
        bodies: see `hand_bodies`. alone: the hand has one finger only.
    """

    hand: HandArrays
    exact: ExactArrays
    items: ItemArrays
    frames: FrameArrays
    meshes: LinkMeshArrays
    wanted: Wanted
    target: ObjectArrays
    mesh: ObjectMesh
    surface: SurfaceArrays
    bodies: HandBodies
    alone: bool

    @cached_property
    def asked(self) -> Asked:
        """What does not change from pose to pose, as the kernel of a batch takes it."""
        from clench.kernels.batch_solving import Asked
        from clench.kernels.handing import kept

        parts = (self.hand, self.exact, self.items, self.target, nothing_to_close(), self.frames, self.surface)
        return kept(Asked(*parts, self.mesh, self.meshes, self.bodies.across, self.apart))

    @contextmanager
    def room(self, capacity: int) -> Iterator[Room]:
        """Lend scratch space for the kernel of a batch, with so many segments per plane; threads get each their own."""
        shape = (*self._room_shape, capacity)
        with _LENDING:
            free = _ROOMS.get(shape)
            room = free.pop() if free else None
        if room is None:
            room = self._make_room(capacity)
        yield room
        with _LENDING:
            _ROOMS.setdefault(shape, []).append(room)
            _ROOMS.move_to_end(shape)
            while sum(map(len, _ROOMS.values())) > _KEPT_ROOMS:
                oldest = next(iter(_ROOMS))
                if _ROOMS[oldest]:
                    _ROOMS[oldest].pop()
                else:
                    del _ROOMS[oldest]

    @cached_property
    def _room_shape(self) -> tuple[int, ...]:
        chain, items = self.hand.chain, len(self.items.entry)
        planes = (len(self.hand.plane_offset), self.most_planes, len(self.target.rounds.kind))
        groups, families = len(chain.group_length), len(self.hand.family_pose)
        return (*planes, items, self.most_contacts, groups, len(chain.rate), families)

    def _make_room(self, capacity: int) -> Room:
        from clench.kernels.batch_solving import Room
        from clench.kernels.family_section import make_sections
        from clench.kernels.handing import kept

        rounds, planes = len(self.target.rounds.kind), (len(self.hand.plane_offset), self.most_planes)
        shared, own = (make_sections(count, capacity, rounds) for count in planes)
        no_shared, no_own = (make_sections(count, 0, 0) for count in planes)
        answers = empty_answers(self, 1)
        columns: list[Any] = [column[0] for column in answers]
        return kept(Room(shared, own, no_shared, no_own, type(answers)(*columns)))

    def wanting(self, wanted: Wanted) -> PackedProblem:
        """Return the same problem, of which something else is wanted."""
        other = replace(self, wanted=wanted)
        other.__dict__.update(asked=self.asked)
        return other

    @cached_property
    def apart(self) -> NDArray[np.int64]:
        """Whether a moving link may not overlap a resting one of another finger, (L, L)."""
        return np.asarray(self.bodies.across - self.bodies.within)

    @cached_property
    def most_planes(self) -> int:
        """Return the number of planes of the largest entry."""
        firsts = self.hand.family_plane[self.hand.entry_family]
        return int(np.diff(firsts).max())

    @cached_property
    def most_contacts(self) -> int:
        """Return the number of joints of the largest entry, each of which one contact may stop."""
        return int(np.diff(self.exact.joint_first).max())


def sums_alone(calibration: Calibration) -> bool:
    """Say whether a calibration chooses by the sum of the criteria that are always scored, without limits."""
    weighs_joints = any(weight != 1.0 for weight in calibration.joints.values())
    return set(calibration.criteria) <= set(ALWAYS) and not calibration.limits and not weighs_joints


def choosing_terms(calibration: Calibration) -> tuple[tuple[int, float], ...]:
    """Return the criteria that are always scored of a calibration: which, and what one unit adds to the sum."""
    terms = [name for name in calibration.criteria if name in ALWAYS]
    return tuple((ALWAYS.index(name), calibration.worth(name, 1.0)) for name in terms)


def is_covered(hand: Hand, plan: HandPlan) -> bool:
    """Say whether the kernels of a batch close what a plan asks for: one open posture per finger, nothing unusual.

    With planes only the choice has to be theirs as well, see `sums_alone`.

    Args:
        hand: the hand. plan: of its fingers, closed one joint after another, once.
    """
    one_posture = len(set(plan.finger)) == len(plan.plans) and not plan.together
    breaks = any(c.breakaway for c in hand.couplings) or any(any(p.breaks) for p in plan.plans)
    few = all(len(p.finger.joints) <= _MOST_JOINTS for p in plan.plans)
    return one_posture and not breaks and (few or any(plan.whole))


def pack_problem(
    hand: Hand,
    plan: HandPlan,
    exact: ExactArrays,
    packed: PackedObject,
    start: FloatArray,
    source: CollisionSource,
    bodies: HandBodies,
    terms: tuple[tuple[int, float], ...],
    idle: int,
) -> PackedProblem:
    """Pack a problem; `is_covered` has to hold.

    Args:
        hand: the hand. plan, exact: of its fingers. packed: the object. start: posture before closing [rad], (J,).
        source: geometry of the hand. bodies: see `hand_bodies`. terms: see `choosing_terms`.
        idle: fingers asked for that no joint closes.
    """
    obj = object_for_closing(packed)
    items = np.flatnonzero(plan.whole) if any(plan.whole) else np.arange(len(plan.whole))
    columns: list[Any] = [np.ascontiguousarray(column[items]) for column in items_around(plan, packed)]
    return PackedProblem(
        hand=plan.arrays,
        exact=exact._replace(object=obj.bodies, wanted=np.ascontiguousarray(exact.wanted[items])),
        items=type(plan.items)(*columns),
        frames=plan.frames(hand),
        meshes=link_mesh_arrays(hand, source),
        wanted=_wanted(hand, plan, start, source, bodies, terms, idle),
        target=obj,
        mesh=object_mesh(packed),
        surface=object_surface(packed),
        bodies=bodies,
        alone=len(hand.fingers) == 1,
    )


def _wanted(
    hand: Hand,
    plan: HandPlan,
    start: FloatArray,
    source: CollisionSource,
    bodies: HandBodies,
    terms: tuple[tuple[int, float], ...],
    idle: int,
) -> Wanted:
    from clench.kernels.batch_layout import Wanted

    meshes, masks = link_mesh_arrays(hand, source), link_masks(hand, plan.plans, source)
    fingers = [p.finger for p in plan.plans]
    return Wanted(
        start=start,
        start_pose=np.ascontiguousarray(hand.link_poses(start)[:, :3]),
        fixed=mesh_mask(meshes, hand.fixed_links),
        fingers=mesh_mask(meshes, [link for finger in hand.fingers for link in finger.links]),
        own=masks.own,
        resting=masks.resting,
        joints=_own_joints(fingers),
        thumb=np.array([finger.is_thumb for finger in fingers], dtype=np.int64),
        worth=np.array([worth for _, worth in terms], dtype=np.float64),
        term=np.array([term for term, _ in terms], dtype=np.int64),
        present=np.full(len(fingers), -1, dtype=np.int64),
        margin=0.0,
        whole=any(plan.whole),
        nested=link_within_link(hand, start, source, bodies.across) is not None,
        idle=idle,
    )


def _own_joints(fingers: Sequence[Finger]) -> np.ndarray:
    joints = np.full((len(fingers), max(len(finger.joints) for finger in fingers)), -1, dtype=np.int64)
    for row, finger in zip(joints, fingers, strict=True):
        row[: len(finger.joints)] = finger.joints
    return joints


def empty_answers(problem: PackedProblem, count: int) -> ClosingArrays:
    """Return the arrays that the closing of so many poses writes."""
    from clench.kernels.layout import HIT_FLOATS, HIT_INTEGERS, ClosingArrays

    items, contacts, chain = len(problem.items.entry), problem.most_contacts, problem.hand.chain
    return ClosingArrays(
        travel=np.zeros((count, items, len(chain.group_length))),
        turn=np.zeros((count, items, len(chain.rate))),
        contacts=np.zeros((count, items), dtype=np.int64),
        hit=np.zeros((count, items, contacts, HIT_INTEGERS), dtype=np.int64),
        point=np.zeros((count, items, contacts, HIT_FLOATS)),
        pose=np.zeros((count, items, len(problem.hand.family_pose), 3, 4)),
        overflow=np.zeros((count, items), dtype=np.int64),
        overlap=np.full((count, items), -1, dtype=np.int64),
        skipped=np.zeros((count, items), dtype=np.int64),
    )
