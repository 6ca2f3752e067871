"""Solve one command at many poses, as arrays (docs/method.md sections 4 to 6)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from numbers import Integral
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from clench.closing.collision.packed_object import pack_object
from clench.closing.collision.sizes import far_away
from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.core.pose_arrays import pose_rows
from clench.core.threads import core_count
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.posture_choice import posture_solver
from clench.solver.preshapes.postures import preshape_angles
from clench.solver.solution import SolutionStatus

from .batch_parts import BatchParts
from .batch_progress import shown
from .batch_solver import related
from .devices import CPU, why_not
from .grasp_batch import STATUSES, GraspBatch, Question, append_part

#: Poses that are solved at a time: a few ten megabytes.
CHUNK: Final = 1024

Poses = Sequence[Pose] | ArrayLike


def solve_batch(
    hand: Hand,
    obj: GraspObject,
    hand_poses: Poses,
    command: GraspCommand | None = None,
    *,
    object_poses: Poses | None = None,
    preshapes: Mapping[str, ArrayLike] | None = None,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: bool | None = None,
    device: str = CPU,
    out: str | Path | None = None,
) -> GraspBatch:
    """Solve a command at many poses; every answer has the bits of `clench.solve` at that pose, for any threads.

    Args:
        hand, obj: as for `clench.solve`.
        hand_poses: rows [w, x, y, z, X, Y, Z] of shape (N, 7), or matrices (N, 4, 4). They mean `T_world_palm`, or the
            pose of the command's `root_link`.
        command: everything else that is asked for; its own `hand_pose` plays no part.
        object_poses: `T_world_object`, one per pose, in the same forms; by default the command's, or the object's own.
        preshapes: angles by joint name [rad], shape (N,) each; they override those of the command. Every different
            posture needs a new plan, which takes much longer than a solve. A few different postures are quick; many are
            slow.
        threads: how many are used; all cores by default. chunk: poses at a time, which bounds the memory besides the
            answers. progress: show a bar on standard error after a second; by default where that is a terminal.
        device: "cpu" or "cuda" closes the fingers. Without a CUDA device, clench warns and uses the CPU. Answers of a
            device differ in their last bits.
        out: NumPy file (.npz) to write, see `GraspBatch.save`. Every chunk is written when it is solved, to the folder
            `OUT.parts`. The same call continues an interrupted one, and the folder is removed when the file is
            complete.

    Raises:
        CommandError: malformed poses or numbers, an unknown device, or see `clench.solve`. FileError: `out` cannot be
            written, or its parts are those of another batch. Both are checked before the first solve.
    """
    asked = _asked(hand, obj, command)
    rows = pose_rows(hand_poses, "hand_poses")
    there = None if object_poses is None else pose_rows(object_poses, "object_poses")
    if there is not None and len(there) != len(rows):
        raise CommandError(f"object_poses: expected {len(rows)} poses, one per hand pose, got {len(there)}.")
    count, size, device = _threads(threads), _whole(chunk, "chunk"), _usable(device)
    columns = _preshapes(preshapes, len(rows))
    if columns and isinstance(asked.preshape, str):
        asked = replace(asked, preshape=preshape_angles(hand, asked.preshape))
    question = Question(hand, obj, asked, columns)
    parts = None if out is None else BatchParts(out, question, size, len(rows), (rows, there, device))
    size = size if parts is None else parts.chunk
    groups = _postures(columns, len(rows))
    solved: list[GraspBatch] = []
    with shown(len(rows), progress) as advance:
        for where in groups:
            shape = {name: float(values[where[0]]) for name, values in columns.items()} if len(where) else {}
            solver = posture_solver(hand, obj, replace(asked, preshape={**asked.angles, **shape}) if shape else asked)
            for begin in range(0, max(len(where), 1), size):
                some = where[begin : begin + size]
                solve = partial(solver.solve, rows[some], None if there is None else there[some], count, device)
                part = solve() if parts is None else parts.part(len(solved), solver.names, rows[some], solve)
                append_part(solved, part)
                advance(len(some))
    batch = GraspBatch.joined(solved)
    if len(groups) > 1:
        batch = batch[np.argsort(np.concatenate(groups), kind="stable")]
    _warn_of_distance(hand, obj, batch)
    batch = batch.with_known(question=replace(question, options=batch.question.options))
    if parts is not None:
        parts.finish(batch)
    return batch


def solve_stream(
    hand: Hand,
    obj: GraspObject,
    hand_poses: Iterable[Pose | ArrayLike],
    command: GraspCommand | None = None,
    *,
    object_poses: Iterable[Pose | ArrayLike] | None = None,
    threads: int | None = None,
    chunk: int = CHUNK,
    device: str = CPU,
) -> Iterator[GraspBatch]:
    """Solve a command at any number of poses, in constant memory: yield batches of up to `chunk` poses.

    Args:
        hand_poses: iterable of single poses, rows (7,) or matrices (4, 4). The other arguments are those of
            `solve_batch`.

    Raises:
        CommandError: malformed poses or numbers, or see `clench.solve`.
    """
    asked = _asked(hand, obj, command)
    count, size, device = _threads(threads), _whole(chunk, "chunk"), _usable(device)
    solver = posture_solver(hand, obj, asked)
    solve = partial(solver.solve, threads=count, device=device)
    return _stream(solve, iter(hand_poses), None if object_poses is None else iter(object_poses), size)


def _asked(hand: Hand, obj: GraspObject, command: GraspCommand | None) -> GraspCommand:
    """Check the types of the inputs; return the command."""
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    if command is None:
        return GraspCommand(hand_pose=Pose.identity())
    check_type(command, GraspCommand, "command")
    return command


def _stream(
    solve: Callable[[FloatArray, FloatArray | None], GraspBatch],
    hand_poses: Iterator[Pose | ArrayLike],
    object_poses: Iterator[Pose | ArrayLike] | None,
    size: int,
) -> Iterator[GraspBatch]:
    while True:
        rows = _next_rows(hand_poses, size, "hand_poses")
        there = None if object_poses is None else _next_rows(object_poses, max(len(rows), 1), "object_poses")
        if there is not None and len(there) != len(rows):
            raise CommandError("object_poses: expected as many poses as hand_poses has.")
        if not len(rows):
            return
        yield solve(rows, there)


def _next_rows(poses: Iterator[Pose | ArrayLike], size: int, key: str) -> FloatArray:
    some: list[Any] = [pose.wxyz_xyz if isinstance(pose, Pose) else pose for pose in islice(poses, size)]
    return pose_rows(some, key)


def _usable(device: str) -> str:
    """Return the device, or the CPU with a warning that says why."""
    reason = why_not(device)
    if reason is None:
        return device
    warnings.warn(f"{reason} Solving on the CPU.", stacklevel=3)
    return CPU


def _warn_of_distance(hand: Hand, obj: GraspObject, batch: GraspBatch) -> None:
    """Warn of poses without a contact whose lengths are probably in millimetres."""
    rows = np.flatnonzero(batch.status_codes == STATUSES.index(SolutionStatus.NO_CONTACT))
    far = far_away(hand, pack_object(obj), related(batch.hand_poses[rows], batch.object_poses[rows]))
    far = far[far > 0.0]
    if len(far):
        warnings.warn(
            f"{len(far)} of {len(batch)} poses place the hand {far.min():.3g} m or more away from {obj.name}: are "
            "their lengths in millimetres?",
            stacklevel=3,
        )


def _threads(threads: int | None) -> int:
    return core_count() if threads is None else _whole(threads, "threads")


def _whole(value: int, key: str) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise CommandError(f"{key}: expected a whole number of at least 1, got {value!r}.")
    return int(value)


def _preshapes(preshapes: Mapping[str, ArrayLike] | None, count: int) -> dict[str, FloatArray]:
    """Return the preshapes as arrays.

    Raises:
        CommandError: another number of angles than of poses, or not finite.
    """
    columns = {}
    for name, values in (preshapes or {}).items():
        try:
            array = np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            raise CommandError(f"preshapes.{name}: expected {count} angles in rad, one per pose.") from None
        if array.shape != (count,) or not np.isfinite(array).all():
            raise CommandError(
                f"preshapes.{name}: expected {count} finite angles in rad, one per pose, got shape {array.shape}."
            )
        columns[name] = array
    return columns


def _postures(columns: Mapping[str, FloatArray], count: int) -> list[np.ndarray]:
    """Return the indices of the poses that have one posture, posture by posture."""
    if not columns or not count:
        return [np.arange(count)]
    _, number = np.unique(np.stack(list(columns.values()), axis=1), axis=0, return_inverse=True)
    number = number.reshape(-1)
    return [np.flatnonzero(number == k) for k in range(int(number.max()) + 1)]
