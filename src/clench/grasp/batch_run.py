"""Solve a packed problem at many poses of the object: kernels over ranges of poses, in threads."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray

from .batching import PackedProblem
from .closing import KernelObject, arena_of, nothing_to_close, share_out

if TYPE_CHECKING:
    from clench.kernels.batch_layout import Solved
    from clench.kernels.layout import ClosingArrays, SectionArrays

Whole = NDArray[np.int64]


#: Threads take turns on a device.
_ON_DEVICE: Final = Lock()


def solve_packed(problem: PackedProblem, T_palm_object: FloatArray, threads: int, on_device: bool) -> Solved:
    """Solve for every pose of the object; the answer is the same for any number of threads.

    Args:
        problem: the rest. T_palm_object: where the object is, shape (N, 3, 4). threads: how many are used.
        on_device: fingers close on a CUDA device.
    """
    solved = _empty_solved(problem, len(T_palm_object))
    # A few more parts than threads, as poses that touch nothing are quick; a device likes large ones.
    count = min(len(T_palm_object), threads if on_device else 4 * threads)
    if threads == 1 or count < 2:
        _Range(problem, T_palm_object, on_device).solve(solved)
        return solved
    ends = np.linspace(0, len(T_palm_object), count + 1).astype(int).tolist()

    def run(span: tuple[int, int]) -> None:
        columns: list[Any] = [column[slice(*span)] for column in solved]
        _Range(problem, T_palm_object[slice(*span)], on_device).solve(type(solved)(*columns))

    share_out(run, pairwise(ends), threads)
    return solved


class PoseAnswer(NamedTuple):
    """Hold what the kernels gave for one pose.

    Args:
        solved: the answer, for one pose. closed: of the items at this pose. blocked: a finger overlaps the object
            before anything moves. anew: whether an item was closed again, with other fingers in its way, (I,).
    """

    solved: Solved
    closed: ClosingArrays
    blocked: bool
    anew: NDArray[np.bool_]


def solve_pose(problem: PackedProblem, T_palm_object: FloatArray) -> PoseAnswer:
    """Solve for one pose of the object, shape (3, 4)."""
    solved = _empty_solved(problem, 1)
    run = _Range(problem, T_palm_object[None], False)
    run.solve(solved)
    columns: list[Any] = [column[0] for column in run.answers]
    return PoseAnswer(solved, type(run.answers)(*columns), bool(run.blocked.any()), run.anew[0])


class _Range:
    """Solve a range of poses, stage after stage; then it has the `answers`, what is `blocked`, and closed `anew`."""

    def __init__(self, problem: PackedProblem, T_palm_object: FloatArray, on_device: bool) -> None:
        self._problem, self._T, self._on_device = problem, T_palm_object, on_device
        self._count, self._items = len(T_palm_object), len(problem.items.entry)
        self.blocked = np.zeros((self._count, len(problem.frames.posture)), dtype=np.int64)
        self.answers = _empty_answers(problem, self._count)
        self.anew = np.zeros((self._count, self._items), dtype=np.bool_)
        self._arenas: dict[tuple[int, int], tuple[SectionArrays, SectionArrays]] = {}

    def solve(self, solved: Solved) -> None:
        """Close the fingers, each with the earlier ones in its way, and judge the answer, which is written."""
        from clench.kernels.batch_judging import judge_poses
        from clench.kernels.batch_sequence import find_blocked

        p = self._problem
        everyone = np.arange(self._count)
        overlaps = self._close(everyone, np.ones((self._count, self._items), dtype=np.int64))
        find_blocked(
            p.exact.link_pose,
            p.meshes,
            p.items,
            p.wanted,
            p.mesh,
            self._T,
            overlaps,
            self.answers,
            self.blocked,
        )
        if p.wanted.whole and not p.alone:
            self._close_in_sequence()
        judge_poses(
            p.hand,
            p.exact._replace(checked=p.bodies.across),
            p.frames,
            p.surface,
            p.mesh,
            p.meshes,
            p.items,
            p.wanted,
            self._T,
            self.answers,
            self.blocked,
            solved,
        )

    def _close(self, poses: Whole, asked: Whole, placed: FloatArray | None = None) -> Whole:
        """Close the items that are asked for at some poses, with arenas that grow until they are large enough.

        Args:
            poses: indices of the poses. asked: (len(poses), I). placed: where the links are when they start, where
                other fingers are in the way; None leaves those out.

        Returns:
            overlaps at the start, (len(poses), E).
        """
        p = self._problem
        overlaps = np.empty((len(poses), self.blocked.shape[1]), dtype=np.int64)
        waiting, arena = np.arange(len(poses)), arena_of(p.target.tree)
        while len(waiting):
            rows = poses[waiting]
            everyone = len(rows) == self._count
            answers = self.answers if everyone else _rows(self.answers, rows)
            found = np.empty((len(rows), overlaps.shape[1]), dtype=np.int64)
            links = p.exact.link_pose[None] if placed is None else placed[waiting]
            exact = p.exact if placed is None else p.exact._replace(checked=p.bodies.across)
            length = np.repeat(p.hand.chain.group_length[None], len(links), axis=0)
            self._run(exact, p.target, rows, links, length, asked[waiting], arena.capacity, found, answers)
            for column, values in () if everyone else zip(self.answers, answers, strict=True):
                column[rows] = values
            overlaps[waiting] = found
            wanted = (answers.overflow * asked[waiting]).max(axis=1, initial=0)
            waiting = waiting[wanted > 0]
            if len(waiting):
                arena.grow(int(wanted.max()))
        return overlaps

    def _run(
        self,
        exact: Any,
        target: KernelObject,
        rows: Whole,
        links: FloatArray,
        length: FloatArray,
        asked: Whole,
        capacity: int,
        overlaps: Whole,
        answers: ClosingArrays,
    ) -> None:
        p = self._problem
        _closing(self._on_device)(
            p.hand,
            exact,
            target.tree,
            target.rounds,
            target.closed,
            np.ascontiguousarray(self._T[rows]),
            links,
            length,
            p.items,
            asked,
            *self._arenas_of(capacity, len(target.rounds.kind)),
            overlaps,
            answers,
        )

    def _arenas_of(self, capacity: int, rounds: int) -> tuple[SectionArrays, SectionArrays]:
        """Return arenas for the sections of all first families, and for those of an entry's later ones."""
        from clench.kernels.family_section import make_sections

        p, key = self._problem, (capacity, rounds)
        if key not in self._arenas:
            planes = (len(p.hand.plane_offset), p.most_planes)
            first, later = (make_sections(count, capacity, rounds) for count in planes)
            self._arenas[key] = (first, later)
        return self._arenas[key]

    def _close_in_sequence(self) -> None:
        """Close fingers anew that meet another one, each with the earlier ones where they are by then.

        Items are entries here: the full width of each. A finger's set stands once those before it do.
        """
        waiting, first = np.arange(self._count), np.zeros(self._count, dtype=np.int64)
        entry = np.arange(self._items)
        while len(waiting):
            placed, length = self._place(waiting)
            asked = ((self.blocked[waiting] == 0) & (entry >= first[:, None])).astype(np.int64)
            meets = self._meeting(waiting, placed, length, asked)
            again = meets.any(axis=1)
            waiting, placed = waiting[again], placed[again]
            chosen = meets[again].argmax(axis=1)
            self._close(waiting, (entry == chosen[:, None]).astype(np.int64), placed)
            self.anew[waiting, chosen] = True
            first = chosen + 1

    def _place(self, poses: Whole) -> tuple[FloatArray, FloatArray]:
        """Return where all links are when each finger begins, (N, E, L, 3, 4), and the travel of all groups, (N, G)."""
        from clench.kernels.batch_sequence import place_fingers

        p = self._problem
        placed = np.empty((len(poses), *p.exact.link_pose.shape))
        length = np.zeros((len(poses), len(p.hand.chain.group_length)))
        place_fingers(p.hand, p.frames, p.wanted, self.answers.travel[poses], placed, length)
        return placed, length

    def _meeting(self, poses: Whole, placed: FloatArray, length: FloatArray, asked: Whole) -> NDArray[np.bool_]:
        """Say which items meet another finger's links on the path to their sets; the object plays no part."""
        p, none = self._problem, nothing_to_close()
        exact = p.exact._replace(object=none.bodies, checked=p.bodies.across - p.bodies.within)
        answers = _empty_answers(p, len(poses))
        overlaps = np.empty((len(poses), self.blocked.shape[1]), dtype=np.int64)
        self._run(exact, none, poses, placed, length, asked, 0, overlaps, answers)
        meets: NDArray[np.bool_] = (asked != 0) & ((answers.contacts > 0) | (answers.skipped > 0))
        return meets


def _closing(on_device: bool) -> Callable[..., None]:
    """Return what closes the fingers for many poses."""
    if not on_device:
        from clench.kernels.batch_closing import close_poses

        return close_poses
    from clench.kernels.cuda_closing import close_poses_on_device

    def close(*given: Any) -> None:
        with _ON_DEVICE:
            close_poses_on_device(*given)

    return close


def _rows(answers: ClosingArrays, rows: Whole) -> ClosingArrays:
    columns: list[Any] = [column[rows] for column in answers]
    return type(answers)(*columns)


def _empty_answers(problem: PackedProblem, count: int) -> ClosingArrays:
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


def _empty_solved(problem: PackedProblem, count: int) -> Solved:
    from clench.kernels.batch_layout import Solved
    from clench.kernels.touches import TOUCH_FLOATS, TOUCH_INTEGERS

    entries, joints = problem.frames.posture.shape
    most = problem.most_contacts
    return Solved(
        angles=np.zeros((count, joints)),
        status=np.zeros(count, dtype=np.int64),
        certified=np.zeros(count, dtype=np.int64),
        fingers=np.zeros((count, entries), dtype=np.int64),
        chosen=np.zeros((count, entries), dtype=np.int64),
        contacts=np.zeros((count, entries), dtype=np.int64),
        number=np.zeros((count, entries, most, TOUCH_INTEGERS), dtype=np.int64),
        value=np.zeros((count, entries, most, TOUCH_FLOATS)),
    )
