"""Solve a packed problem at many poses of the object: a kernel over ranges of poses, in threads."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray

from .batching import PackedProblem, empty_answers
from .closing import arena_of, share_out

if TYPE_CHECKING:
    from clench.kernels.batch_layout import Solved
    from clench.kernels.batch_solving import Closed
    from clench.kernels.layout import ClosingArrays


def solve_packed(problem: PackedProblem, T_palm_object: FloatArray, threads: int, on_device: bool) -> Solved:
    """Solve for every pose of the object; the answer is the same for any number of threads.

    Args:
        problem: the rest. T_palm_object: where the object is, shape (N, 3, 4). threads: how many are used.
        on_device: fingers close on a CUDA device.
    """
    solved = empty_solved(problem, len(T_palm_object))
    # A few more parts than threads, as poses that touch nothing are quick; a device likes large ones.
    count = max(min(len(T_palm_object), threads if on_device else 4 * threads), 1)
    ends = np.linspace(0, len(T_palm_object), (1 if threads == 1 else count) + 1).astype(int).tolist()

    def run(span: tuple[int, int]) -> None:
        columns: list[Any] = [column[slice(*span)] for column in solved]
        part, T = type(solved)(*columns), T_palm_object[slice(*span)]
        if on_device:
            from .device_run import DeviceRange

            DeviceRange(problem, T).solve(part)
        else:
            _solve_range(problem, T, part)

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
    anew: NDArray[np.int64]


def solve_pose(problem: PackedProblem, T_palm_object: FloatArray) -> PoseAnswer:
    """Solve for one pose of the object, shape (3, 4)."""
    solved = empty_solved(problem, 1)
    closed = _solve_range(problem, T_palm_object[None], solved)
    columns: list[Any] = [column[0] for column in closed.answers]
    return PoseAnswer(solved, type(closed.answers)(*columns), bool(closed.blocked.any()), closed.anew[0])


def _solve_range(problem: PackedProblem, T_palm_object: FloatArray, solved: Solved) -> Closed:
    """Solve a range of poses, with arenas that grow until they are large enough; `solved` is written."""
    from clench.kernels.batch_solving import solve_poses

    arena, closed = arena_of(problem.target.tree), _empty_closed(problem, len(T_palm_object))
    while True:
        with problem.room(arena.capacity) as room:
            solve_poses(problem.asked, problem.wanted, T_palm_object, room, closed, solved)
        wanted = int(closed.overflow.max(initial=0))
        if not wanted:
            return closed
        arena.grow(wanted)


def _empty_closed(problem: PackedProblem, count: int) -> Closed:
    from clench.kernels.batch_solving import Closed

    items = len(problem.items.entry)
    return Closed(
        empty_answers(problem, count),
        np.zeros((count, len(problem.frames.posture)), dtype=np.int64),
        np.zeros((count, items), dtype=np.int64),
        np.ones(count, dtype=np.int64),
    )


def empty_solved(problem: PackedProblem, count: int) -> Solved:
    """Return the arrays that the judging of so many poses writes."""
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
