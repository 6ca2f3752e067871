"""Close the fingers for many poses on a CUDA device, by the functions that do it on the CPU (docs/method.md section 4).

One thread cuts the object by the planes of one pose, one thread closes one item. Everything is double precision, as on
the CPU; only the last bits may differ, as the device's sine, cosine and fused products do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba.cuda
import numpy as np

from .advance import make_work
from .batch_closing import among, answer_at, with_lengths
from .closing import close_item
from .exact import ExactArrays
from .family_section import cut_first_families, needs_planes
from .layout import (
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    ItemArrays,
    RoundArrays,
    SectionArrays,
    Work,
)
from .overlap import look_for_overlaps
from .sweeping import SweepWork, make_sweep_work
from .tree import MeshTree

# Neither has types.
cuda: Any = numba.cuda
config: Any = numba.config
#: Threads of one block: closing needs many registers.
BLOCK = 64


class Job(NamedTuple):
    """Hold what the device reads and writes: see `close_poses_on_device`.

    Args:
        shared, work: of every pose. own, item_work, sweep: of every pose and item, pose after pose.
    """

    hand: HandArrays
    exact: ExactArrays
    tree: MeshTree
    rounds: RoundArrays
    closed: bool
    T_palm_object: Floats
    link_pose: Floats
    length: Floats
    items: ItemArrays
    asked: Ints
    shared: SectionArrays
    work: Work
    own: SectionArrays
    item_work: Work
    sweep: SweepWork
    overlaps: Ints
    answers: ClosingArrays


def why_no_device() -> str | None:
    """Return why no CUDA device can be used, or None."""
    if cuda.is_available():
        return None
    return " ".join((cuda.cuda_error() or "no device was found.").split())


def close_poses_on_device(
    hand: HandArrays,
    exact: ExactArrays,
    tree: MeshTree,
    rounds: RoundArrays,
    closed: bool,
    T_palm_object: Floats,
    link_pose: Floats,
    length: Floats,
    items: ItemArrays,
    asked: Ints,
    shared: SectionArrays,
    own: SectionArrays,
    overlaps: Ints,
    answers: ClosingArrays,
) -> None:
    """Cut the object, look for overlaps at the start, and close items once, joint after joint, for every pose.

    Args:
        hand, exact, tree, rounds, closed, items: see `close_items`. T_palm_object: where the object is, (N, 3, 4).
        link_pose, length: that of `exact` and of the chain for every pose, (N, ...), or for all of them, (1, ...).
        asked: whether an item is to be closed at a pose, (N, I); answers of others are left as they are.
        shared, own: say how large an arena is. overlaps: see `look_for_overlaps`, (N, E); such entries are not closed.
        answers: see `ClosingArrays`, with the poses first; `overflow` is written for all items of a pose.
    """
    poses, count = asked.shape
    joints = hand.chain.rate.shape[0]
    work = _plain(make_work)(joints, hand.outlines)
    sweep = _plain(make_sweep_work)(joints, exact.checked.shape[0])
    given = _each(
        _device().put,
        Job(
            *(hand, exact, tree, rounds, bool(closed), T_palm_object, link_pose, length, items, asked),
            *(shared, work, own, work, sweep, overlaps, answers),
        ),
    )
    many = given._replace(
        shared=_rows(shared, poses),
        work=_rows(work, poses),
        own=_rows(own, poses * count),
        item_work=_rows(work, poses * count),
        sweep=_rows(sweep, poses * count),
    )
    _cut[-(-poses // BLOCK), BLOCK](many)
    _close[-(-poses * count // BLOCK), BLOCK](many)
    overlaps[:] = _device().get(many.overlaps)
    for column, values in zip(answers, many.answers, strict=True):
        column[:] = _device().get(values)


class _Device(NamedTuple):
    """Hold how arrays get to the device and back, and how they are made there."""

    put: Callable[[Any], Any]
    get: Callable[[Any], Any]
    make: Callable[..., Any]


@cache
def _device() -> _Device:
    if config.ENABLE_CUDASIM:
        # The simulator calls compiled functions, which know the arrays of the CPU alone.
        return _Device(np.copy, np.asarray, np.zeros)
    return _Device(cuda.to_device, lambda array: array.copy_to_host(), cuda.device_array)


def _each(change: Callable[[Any], Any], value: Any) -> Any:
    """Return nested arrays, each changed."""
    if isinstance(value, tuple):
        fields: list[Any] = [_each(change, part) for part in value]
        return type(value)(*fields)
    return change(value) if isinstance(value, np.ndarray) else value


def _rows(arrays: Any, count: int) -> Any:
    """Return arrays of the same shapes on the device, so many of each; what is in them is not known."""
    return _each(lambda array: _device().make((count, *array.shape), array.dtype), arrays)


def _plain(function: Any) -> Any:
    """Return a kernel as the Python function that it was made of."""
    return getattr(function, "py_func", function)


def _inlined(function: Any) -> Any:
    """Return a function that hands out rows of arrays, for the device: it has to become part of its caller."""
    return cuda.jit(device=True, inline="always")(_plain(function))


_among, _answer_at, _with_lengths = _inlined(among), _inlined(answer_at), _inlined(with_lengths)


@_inlined
def _sections_at(s: SectionArrays, n: int) -> SectionArrays:
    return SectionArrays(
        s.segments[n],
        s.sources[n],
        s.disks[n],
        s.disk_sources[n],
        s.ellipses[n],
        s.ellipse_sources[n],
        s.counts[n],
        s.circles[n],
    )


@_inlined
def _work_at(w: Work, n: int) -> Work:
    return Work(
        w.place[n],
        w.moved[n],
        w.turns[n],
        w.vertex[n],
        w.side[n],
        w.stadium[n],
        w.chain[n],
        w.terms[n],
        w.ellipse[n],
        w.rates[n],
        w.before[n],
        w.locked[n],
        w.pose[n],
        w.best[n],
    )


@_inlined
def _sweep_at(s: SweepWork, n: int) -> SweepWork:
    return SweepWork(
        s.core[n],
        s.fixed[n],
        s.placed[n],
        s.axis[n],
        s.anchor[n],
        s.spatial[n],
        s.moving[n],
        s.resting[n],
        s.poses[n],
        s.lane[n],
        s.after[n],
        s.stack[n],
        s.keys[n],
        s.since[n],
        s.box[n],
        s.plane[n],
        s.pair[n],
        s.winner[n],
        s.skipped[n],
    )


@cuda.jit
def _cut(job: Job) -> None:
    """Cut the object at one pose, and look for overlaps at the start."""
    n = cuda.grid(1)
    if n >= job.T_palm_object.shape[0]:
        return
    shared, work, T = _sections_at(job.shared, n), _work_at(job.work, n), job.T_palm_object[n]
    wanted, planar = 0, needs_planes(job.items)
    if planar:
        wanted = cut_first_families(job.hand, job.tree, job.rounds, T, shared, work.pose)
    for entry in range(job.overlaps.shape[1]):
        job.overlaps[n, entry] = -1
    for i in range(job.asked.shape[1]):
        job.answers.overflow[n, i] = wanted
    if planar and wanted == 0:
        look_for_overlaps(job.hand, job.tree, job.rounds, job.closed, T, shared, job.overlaps[n], work)


@cuda.jit
def _close(job: Job) -> None:
    """Close one item at one pose."""
    index = cuda.grid(1)
    items = job.asked.shape[1]
    if index >= job.T_palm_object.shape[0] * items:
        return
    n, i = index // items, index % items
    if job.answers.overflow[n, i] > 0 or job.asked[n, i] == 0:
        return
    answer, one = _answer_at(job.answers, n), min(n, job.link_pose.shape[0] - 1)
    for k in range(answer.travel.shape[1]):
        answer.travel[i, k] = 0.0
    for k in range(answer.turn.shape[1]):
        answer.turn[i, k] = 0.0
    answer.contacts[i], answer.skipped[i], answer.overlap[i] = 0, 0, -1
    if job.overlaps[n, job.items.entry[i]] >= 0:
        return
    shared, own = _sections_at(job.shared, n), _sections_at(job.own, index)
    work = _work_at(job.item_work, index)
    sweep = _sweep_at(job.sweep, index)
    hand, T = _with_lengths(job.hand, job.length[one]), job.T_palm_object[n]
    exact = _among(job.exact, job.exact.object, job.link_pose[one], job.exact.checked)
    close_item(
        hand,
        exact,
        job.tree,
        job.rounds,
        job.closed,
        T,
        shared,
        own,
        job.items,
        i,
        1,
        False,
        work,
        sweep,
        answer,
    )
