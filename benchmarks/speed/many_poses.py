"""The benchmark of many solves at once: the same answers as one by one, rates, and the memory of a stream."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

import clench
from clench.core.pose import Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.batch_progress import shown
from clench.solver.batch.grasp_batch import GraspBatch
from clench.solver.solution import GraspSolution

from ..bench_options import Case, Runs
from ..bench_report import BenchReport, describe_place, timed

#: Poses of a stream that are solved at a time.
CHUNK = 64
#: How much a stream may grow in its second half [MB]: what allocators keep, not what answers take.
GROWTH = 16.0
_MB = 1e6


def bench_batch(case: Case, runs: Runs, planes: int, stream: int, seed: int) -> BenchReport:
    """Check the answers for many poses against single solves, then time them.

    Args:
        case: the loaded models. runs: how many poses, and how often. planes: per finger.
        stream: number of poses streamed. seed: of the poses.

    Returns:
        the report; with errors, and without times, when an answer is wrong.
    """
    report = BenchReport(values={"benchmark": "batch", **describe_place()})
    hand, obj = case.load()
    poses = clench.approach_poses(hand, obj, runs.poses, seed)
    cores = os.cpu_count() or 1
    report.values |= {
        "hand": hand.name,
        "fingers": len(hand.fingers),
        "object": obj.name,
        "planes": planes,
        **asdict(runs),
        "seed": seed,
    }
    kinds = {
        name: GraspCommand(hand_pose=Pose.identity(), preshape="open", planes=planes, full_width=full, measure=False)
        for name, full in (("certified", True), ("planes", False))
    }
    for name, command in kinds.items():
        batch, first = timed(lambda command=command: clench.solve_batch(hand, obj, poses, command, threads=1))  # type: ignore[misc]
        report.values[f"warmup_{name}_s"] = first
        report.errors += [f"{name}: {error}" for error in wrong_answers(batch, _one_by_one(hand, obj, command, poses))]
        report.values |= {f"{name}_status_{key}": number for key, number in batch.counts().items()}
    report.values["answers_right"] = not report.errors
    if not report.errors:
        for name, command in kinds.items():
            for threads in sorted({1, cores}):
                _time(report, f"{name}_{threads}_threads", hand, obj, poses, command, threads, runs.passes)
        stream_memory(report, hand, obj, poses, kinds["planes"], stream)
    return report


def _one_by_one(hand: Hand, obj: GraspObject, command: GraspCommand, poses: Sequence[Pose]) -> list[GraspSolution]:
    return [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses]


def wrong_answers(batch: GraspBatch, alone: Sequence[GraspSolution]) -> Iterator[str]:
    """Yield a sentence for the first pose whose answer is not that of a single solve, to the bit."""
    for i, solution in enumerate(alone):
        angles = np.array(list(solution.joint_angles.values()))
        if not np.array_equal(angles, batch.joint_angles[i]):
            off = float(np.abs(angles - batch.joint_angles[i]).max())
            yield f"pose {i}: joint angles are off by up to {off:.3g} rad."
        elif (solution.status, solution.certified) != (batch.status[i], batch.certified[i]):
            yield f"pose {i}: {batch.status[i]}, certified {batch.certified[i]}; expected {solution.status.value}."
        elif [solution.fingers[name].status for name in batch.finger_names] != batch.finger_status[i].tolist():
            yield f"pose {i}: a finger ends in another way."
        elif len(solution.contacts) != int(np.diff(batch.contacts.first)[i]):
            yield f"pose {i}: another number of contacts."
        else:
            continue
        return


def _time(
    report: BenchReport,
    key: str,
    hand: Hand,
    obj: GraspObject,
    poses: Sequence[Pose],
    command: GraspCommand,
    threads: int,
    passes: int,
) -> None:
    """Add the median rates of all passes: by the clock on the wall, and by that of the processor."""

    def run() -> None:
        clench.solve_batch(hand, obj, poses, command, threads=threads, progress=False)

    wall, processor = [], []
    for _ in range(passes):
        before = time.process_time()
        wall.append(timed(run)[1])
        processor.append(time.process_time() - before)
    report.values[f"{key}_per_s"] = len(poses) / float(np.median(wall))
    report.values[f"{key}_processor_ms"] = float(np.median(processor)) / len(poses) * 1e3


def stream_memory(
    report: BenchReport, hand: Hand, obj: GraspObject, poses: Sequence[Pose], command: GraspCommand, count: int
) -> None:
    """Add how much memory a stream takes in its first half, and how much more in its second."""
    endless = itertools.islice(itertools.cycle(poses), count)
    half = max(-(-count // CHUNK) // 2, 1)
    # Only the largest of each half is kept: a list of all would be what grows.
    most = {False: 0, True: 0}

    def run(advance: Callable[[int], None]) -> None:
        stream = clench.solve_stream(hand, obj, endless, command, chunk=CHUNK)
        for number, memory in enumerate(_memories(stream, advance)):
            most[number >= half] = max(most[number >= half], memory)

    with shown(count, None) as advance:
        _, seconds = timed(lambda: run(advance))
    report.values |= {"stream_poses": count, "stream_per_s": count / seconds}
    largest = max(most.values())
    if not largest:
        return
    growth = (largest - most[False]) / _MB
    report.values |= {"stream_memory_mb": largest / _MB, "stream_growth_mb": growth}
    if growth > GROWTH:
        report.errors.append(f"a stream of {count} poses grew by {growth:.1f} MB in its second half.")


def _memories(batches: Iterator[GraspBatch], advance: Callable[[int], None]) -> Iterator[int]:
    """Yield the memory of this process after every batch [B]; nothing where the system does not tell."""
    for batch in batches:
        advance(len(batch.status))
        now = _resident()
        if now is not None:
            yield now


def _resident() -> int | None:
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")
