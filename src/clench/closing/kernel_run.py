"""Run the kernels of a solve at many poses of the object, in threads; a single solve is a batch of one."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.core.threads import share_out

from .packed_problem import PackedProblem

if TYPE_CHECKING:
    from clench.kernels.closing.layout import ClosingArrays
    from clench.kernels.closing.solve_layout import Closed, Solved
    from clench.kernels.meetings.meeting_layout import Meetings


Arrays = TypeVar("Arrays")


class Answers(NamedTuple):
    """The kernels' results for N poses: the closings of the fingers, and the answer."""

    closed: Closed
    solved: Solved

    def at(self, part: slice) -> Answers:
        """Return the answers of some poses, as views."""
        closed, solved = (_rows(arrays, part) for arrays in self)
        return Answers(closed, solved)


#: Chooses a candidate for every finger at a closed pose. It gets the index of the pose, its answers, the candidates,
#: and whether links overlap at their start; it returns the last two.
Chooser = Callable[[int, Answers], tuple[list[int], bool]]


def solve_packed(
    problem: PackedProblem,
    T_palm_object: FloatArray,
    *,
    choose: Chooser | None = None,
    threads: int = 1,
    on_device: bool = False,
) -> Answers:
    """Solve for every pose of the object; the answer is the same for any number of threads.

    Args:
        problem: the rest. T_palm_object: where the object is, shape (N, 3, 4).
        choose: chooses the candidates; None leaves the choice to the kernels. threads: how many are used.
        on_device: fingers close on a CUDA device; the other stages run on the CPU.
    """
    from clench.kernels.closing.solve_layout import BLOCK, CHOOSE, CLOSE, FINISH

    count = len(T_palm_object)
    answers = empty_answers(problem, count)
    if on_device:
        _close_on_device(problem, T_palm_object, answers.closed)
    first = BLOCK if on_device else CLOSE | BLOCK
    # A few more parts than threads, as poses that touch nothing are quick.
    parts = 1 if threads == 1 else max(min(count, 4 * threads), 1)
    ends = [count * k // parts for k in range(parts + 1)]

    def run(span: tuple[int, int]) -> None:
        some = answers if parts == 1 else answers.at(slice(*span))
        T = T_palm_object[slice(*span)]
        if choose is None:
            run_stages(problem, T, some, first | CHOOSE | FINISH)
            return
        run_stages(problem, T, some, first)
        for n in range(span[1] - span[0]):
            candidates, nested = choose(span[0] + n, some.at(slice(n, n + 1)))
            some.solved.chosen[n], some.closed.nested[n] = candidates, nested
        run_stages(problem, T, some, FINISH)

    share_out(run, pairwise(ends), threads)
    return answers


def close_candidates(problem: PackedProblem, T_palm_object: FloatArray) -> Closed:
    """Close the candidates of a plan at one pose of the object, (3, 4), without the other fingers; choose nothing."""
    from clench.kernels.closing.solve_layout import BLOCK, CLOSE

    answers = empty_answers(problem, 1)
    run_stages(problem, T_palm_object[None], answers, CLOSE | BLOCK)
    return answers.closed


def run_stages(problem: PackedProblem, T_palm_object: FloatArray, answers: Answers, stages: int) -> None:
    """Run stages for a range of poses, with arenas that grow until they are large enough."""
    from clench.kernels.closing.solve_poses import solve_poses

    closed = answers.closed
    closed.overflow[:] = 1
    while True:
        with problem.arena() as arena:
            solve_poses(problem.kept, T_palm_object, arena, closed, answers.solved, stages)
        wanted = int(closed.overflow.max(initial=0))
        if not wanted:
            return
        problem.capacity.grow(wanted)


def _close_on_device(problem: PackedProblem, T_palm_object: FloatArray, closed: Closed) -> None:
    from clench.kernels.closing.cuda_closing import close_on_device

    kept = problem.kept
    arrays = getattr(kept, "content", kept)
    while True:
        with problem.arena() as arena:
            close_on_device(arrays, T_palm_object, getattr(arena, "content", arena), closed)
        wanted = int(closed.overflow.max(initial=0))
        if not wanted:
            return
        problem.capacity.grow(wanted)


def empty_answers(problem: PackedProblem, count: int) -> Answers:
    """Return the arrays that a solve of so many poses writes."""
    from clench.kernels.closing.contact_reading import PALM_CONTACT_FLOATS, PALM_CONTACT_INTEGERS
    from clench.kernels.closing.solve_layout import Closed, Solved

    arrays, most = problem.arrays, problem.most_contacts
    finger_postures, joints = arrays.frames.posture.shape
    fingers = len(arrays.command.thumb)
    closed = Closed(
        free=_closing_arrays(problem, (count, len(arrays.candidates.finger_posture))),
        crossed=_whole((count, finger_postures)),
        blocked=_whole((count, finger_postures)),
        nested=np.full(count, int(arrays.command.nested), dtype=np.int64),
        final=_closing_arrays(problem, (count, fingers)),
        anew=_whole((count, fingers)),
        overlapping=_whole((count, fingers)),
        met=_meetings(problem, count),
        overflow=_whole((count,)),
    )
    solved = Solved(
        angles=np.zeros((count, joints)),
        status=_whole((count,)),
        certified=_whole((count,)),
        fingers=_whole((count, fingers)),
        chosen=_whole((count, fingers)),
        contacts=_whole((count, fingers)),
        number=_whole((count, fingers, most, PALM_CONTACT_INTEGERS)),
        value=np.zeros((count, fingers, most, PALM_CONTACT_FLOATS)),
    )
    return Answers(closed, solved)


def _closing_arrays(problem: PackedProblem, shape: tuple[int, int]) -> ClosingArrays:
    from clench.kernels.closing.layout import CONTACT_FLOATS, CONTACT_INTEGERS, ClosingArrays

    hand, contacts = problem.arrays.hand, problem.most_contacts
    return ClosingArrays(
        travel=np.zeros((*shape, len(hand.chain.dof_length))),
        turn=np.zeros((*shape, len(hand.chain.rate))),
        contacts=_whole(shape),
        contact=_whole((*shape, contacts, CONTACT_INTEGERS)),
        point=np.zeros((*shape, contacts, CONTACT_FLOATS)),
        pose=np.zeros((*shape, len(hand.axis_group_pose), 3, 4)),
        overflow=_whole(shape),
        overlap=np.full(shape, -1, dtype=np.int64),
        skipped=_whole(shape),
    )


def _meetings(problem: PackedProblem, count: int) -> Meetings:
    """Return room for all meetings of links: two links meet once at most."""
    from clench.kernels.meetings.meeting_layout import Meetings

    most = len(problem.arrays.fingers.link) ** 2 // 2
    return Meetings(_whole((count, 1)), _whole((count, most, 6)), np.zeros((count, most, 8)))


def _whole(shape: tuple[int, ...]) -> NDArray[np.int64]:
    return np.zeros(shape, dtype=np.int64)


def _rows(arrays: Any, part: slice | int) -> Any:
    """Return rows of nested arrays, as views."""
    columns: list[Any] = [_rows(a, part) if isinstance(a, tuple) else a[part] for a in arrays]
    return type(arrays)(*columns)


def row_of(arrays: Arrays, n: int) -> Arrays:
    """Return the arrays of one pose, of arrays with the poses first."""
    row: Arrays = _rows(arrays, n)
    return row
