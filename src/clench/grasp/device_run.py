"""Solve a packed problem at many poses with the closing on a CUDA device: stage after stage for all poses at once."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray

from .batching import PackedProblem, empty_answers
from .closing import arena_of, nothing_to_close

if TYPE_CHECKING:
    from clench.kernels.batch_layout import ObjectArrays, Solved
    from clench.kernels.layout import ClosingArrays, SectionArrays

Whole = NDArray[np.int64]

#: Threads take turns on a device.
_ON_DEVICE: Final = Lock()


class DeviceRange:
    """Solve a range of poses, stage after stage.

    Args:
        problem: what is asked. T_palm_object: where the object is, shape (N, 3, 4).
    """

    def __init__(self, problem: PackedProblem, T_palm_object: FloatArray) -> None:
        self._problem, self._T = problem, T_palm_object
        self._count, self._items = len(T_palm_object), len(problem.items.entry)
        self._blocked = np.zeros((self._count, len(problem.frames.posture)), dtype=np.int64)
        self._answers = empty_answers(problem, self._count)
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
            self._answers,
            self._blocked,
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
            self._answers,
            self._blocked,
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
        overlaps = np.empty((len(poses), self._blocked.shape[1]), dtype=np.int64)
        waiting, arena = np.arange(len(poses)), arena_of(p.target.tree)
        while len(waiting):
            rows = poses[waiting]
            everyone = len(rows) == self._count
            answers = self._answers if everyone else _rows(self._answers, rows)
            found = np.empty((len(rows), overlaps.shape[1]), dtype=np.int64)
            links = p.exact.link_pose[None] if placed is None else placed[waiting]
            exact = p.exact if placed is None else p.exact._replace(checked=p.bodies.across)
            length = np.repeat(p.hand.chain.group_length[None], len(links), axis=0)
            self._run(exact, p.target, rows, links, length, asked[waiting], arena.capacity, found, answers)
            for column, values in () if everyone else zip(self._answers, answers, strict=True):
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
        target: ObjectArrays,
        rows: Whole,
        links: FloatArray,
        length: FloatArray,
        asked: Whole,
        capacity: int,
        overlaps: Whole,
        answers: ClosingArrays,
    ) -> None:
        p = self._problem
        _close_on_device(
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
            asked = ((self._blocked[waiting] == 0) & (entry >= first[:, None])).astype(np.int64)
            meets = self._meeting(waiting, placed, length, asked)
            again = meets.any(axis=1)
            waiting, placed = waiting[again], placed[again]
            chosen = meets[again].argmax(axis=1)
            self._close(waiting, (entry == chosen[:, None]).astype(np.int64), placed)
            first = chosen + 1

    def _place(self, poses: Whole) -> tuple[FloatArray, FloatArray]:
        """Return where all links are when each finger begins, (N, E, L, 3, 4), and the travel of all groups, (N, G)."""
        from clench.kernels.batch_sequence import place_fingers

        p = self._problem
        placed = np.empty((len(poses), *p.exact.link_pose.shape))
        length = np.zeros((len(poses), len(p.hand.chain.group_length)))
        place_fingers(p.hand, p.frames, p.wanted, self._answers.travel[poses], placed, length)
        return placed, length

    def _meeting(self, poses: Whole, placed: FloatArray, length: FloatArray, asked: Whole) -> NDArray[np.bool_]:
        """Say which items meet another finger's links on the path to their sets; the object plays no part."""
        p, none = self._problem, nothing_to_close()
        exact = p.exact._replace(object=none.bodies, checked=p.apart)
        answers = empty_answers(p, len(poses))
        overlaps = np.empty((len(poses), self._blocked.shape[1]), dtype=np.int64)
        self._run(exact, none, poses, placed, length, asked, 0, overlaps, answers)
        meets: NDArray[np.bool_] = (asked != 0) & ((answers.contacts > 0) | (answers.skipped > 0))
        return meets


def _close_on_device(*given: Any) -> None:
    """Close fingers for many poses on the device."""
    from clench.kernels.cuda_closing import close_poses_on_device

    with _ON_DEVICE:
        close_poses_on_device(*given)


def _rows(answers: ClosingArrays, rows: Whole) -> ClosingArrays:
    columns: list[Any] = [column[rows] for column in answers]
    return type(answers)(*columns)
