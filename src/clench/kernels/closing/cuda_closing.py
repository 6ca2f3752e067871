"""Close the fingers for many poses on a CUDA device, by the functions that do it on the CPU (docs/method.md section 4).

One thread cuts the object by the planes of one pose, one thread closes one candidate. Everything is double precision,
as on the CPU; only the last bits may differ, as the device's sine, cosine and fused products do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numba.cuda
import numpy as np

from clench.kernels.sections.advance import make_work
from clench.kernels.sections.plane_sections import cut_first_axis_groups, needs_planes
from clench.kernels.sections.section_overlap import look_for_overlaps
from clench.kernels.toi.full_width import FullWidthArrays
from clench.kernels.toi.toi_work import SweepWork, make_sweep_work
from clench.kernels.trees.bvh import MeshTree

from .bundles import answer_at
from .close_candidate import close_candidate
from .layout import (
    CandidateArrays,
    ClosingArrays,
    Floats,
    HandArrays,
    Ints,
    RoundArrays,
    SectionArrays,
    Work,
)
from .solve_layout import Arena, Closed, Closing, ObjectArrays, ProblemArrays

# Neither has types.
cuda: Any = numba.cuda
config: Any = numba.config
#: Threads of one block: closing needs many registers.
BLOCK = 64


class Job(NamedTuple):
    """Bundle what the device reads and writes: see `close_on_device`.

    Args:
        shared, work: of every pose. own, candidate_work, sweep: of every pose and candidate, pose after pose.
    """

    hand: HandArrays
    full_width: FullWidthArrays
    candidates: CandidateArrays
    tree: MeshTree
    rounds: RoundArrays
    closed: bool
    only_planes: bool
    times: int
    together: bool
    T_palm_object: Floats
    shared: SectionArrays
    work: Work
    own: SectionArrays
    candidate_work: Work
    sweep: SweepWork
    crossed: Ints
    overflow: Ints
    answers: ClosingArrays


def why_no_device() -> str | None:
    """Return why no CUDA device can be used, or None."""
    if cuda.is_available():
        return None
    return " ".join((cuda.cuda_error() or "no device was found.").split())


def close_on_device(problem: ProblemArrays, T_palm_objects: Floats, arena: Arena, closed: Closed) -> None:
    """Do the stage `CLOSE` of `solve_poses` on the device for all poses; `arena` says how large arenas are."""
    poses, count = closed.free.contacts.shape
    target, command = problem.target, problem.command
    work = _plain(make_work)(problem.hand.chain.rate.shape[0], problem.hand.outlines)
    sweep = _plain(make_sweep_work)(problem.hand.chain.rate.shape[0], problem.across.shape[0])
    given = _each(
        _device().put,
        Job(
            hand=problem.hand,
            full_width=problem.full_width,
            candidates=problem.candidates,
            tree=target.tree,
            rounds=target.rounds,
            closed=bool(target.closed),
            only_planes=not command.full_width,
            times=command.times,
            together=bool(command.together),
            T_palm_object=T_palm_objects,
            shared=arena.shared,
            work=work,
            own=arena.own,
            candidate_work=work,
            sweep=sweep,
            crossed=closed.crossed,
            overflow=closed.overflow,
            answers=closed.free,
        ),
    )
    many = given._replace(
        shared=_rows(arena.shared, poses),
        work=_rows(work, poses),
        own=_rows(arena.own, poses * count),
        candidate_work=_rows(work, poses * count),
        sweep=_rows(sweep, poses * count),
    )
    _cut[-(-poses // BLOCK), BLOCK](many)
    _close[-(-poses * count // BLOCK), BLOCK](many)
    closed.crossed[:] = _device().get(many.crossed)
    for column, values in zip(closed.free, many.answers, strict=True):
        column[:] = _device().get(values)
    closed.overflow[:] = np.maximum(_device().get(many.overflow), closed.free.overflow.max(axis=1, initial=0))


class _Device(NamedTuple):
    """Functions that move arrays to the device and back, and create them there."""

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
    """Return this many arrays of the same shapes on the device, with undefined content."""
    return _each(lambda array: _device().make((count, *array.shape), array.dtype), arrays)


def _plain(function: Any) -> Any:
    """Return a kernel as the Python function that it was made of."""
    return getattr(function, "py_func", function)


def _inlined(function: Any) -> Any:
    """Return a function that hands out rows of arrays, for the device: it has to become part of its caller."""
    return cuda.jit(device=True, inline="always")(_plain(function))


_answer_at = _inlined(answer_at)


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
        s.begun[n],
        s.turned[n],
        s.level[n],
        s.hull[n],
        s.round[n],
        s.near[n],
        s.met[n],
        s.listed[n],
        s.balls[n],
        s.clear[n],
        s.order[n],
        s.lead[n],
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
    wanted, planar = 0, needs_planes(job.candidates)
    if planar:
        wanted = cut_first_axis_groups(job.hand, job.tree, job.rounds, T, shared, work.pose)
    for finger_posture in range(job.crossed.shape[1]):
        job.crossed[n, finger_posture] = -1
    job.overflow[n] = wanted
    if planar and job.only_planes and wanted == 0:
        obj = ObjectArrays(job.tree, job.rounds, job.closed, job.full_width.object)
        look_for_overlaps(job.hand, obj, T, shared, job.crossed[n], work)


@cuda.jit
def _close(job: Job) -> None:
    """Close one candidate at one pose."""
    index = cuda.grid(1)
    candidates = job.answers.contacts.shape[1]
    if index >= job.T_palm_object.shape[0] * candidates:
        return
    n, i = index // candidates, index % candidates
    answer = _answer_at(job.answers, n)
    for k in range(answer.travel.shape[1]):
        answer.travel[i, k] = 0.0
    for k in range(answer.turn.shape[1]):
        answer.turn[i, k] = 0.0
    answer.contacts[i], answer.skipped[i], answer.overlap[i], answer.overflow[i] = 0, 0, -1, 0
    if job.overflow[n] > 0 or job.crossed[n, job.candidates.finger_posture[i]] >= 0:
        return
    closing = Closing(
        job.hand,
        job.full_width,
        ObjectArrays(job.tree, job.rounds, job.closed, job.full_width.object),
        job.T_palm_object[n],
        _sections_at(job.shared, n),
        _sections_at(job.own, index),
        job.candidates,
        _work_at(job.candidate_work, index),
        _sweep_at(job.sweep, index),
        answer,
    )
    close_candidate(closing, i, job.times, job.together)
