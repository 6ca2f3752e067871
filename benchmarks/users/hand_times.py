"""The benchmark of hands: batches of several hands, objects and orders, beside a first hand and another version."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

import clench
from clench.models.command import ClosingOrder, GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource

from ..bench_options import Hands, Objects, Runs
from ..bench_report import BenchReport, describe_place
from ..speed.many_poses import wrong_answers
from .kept_ratios import Ratio, keep_ratios
from .timing_workers import BatchCase, Worker, differing

#: Poses of each case whose answers are compared with single solves.
CHECKED: Final = 4


@dataclass(frozen=True)
class HandBench:
    """What is timed.

    Args:
        runs: poses and passes. orders: of closing. geometry: of the hands; their default without it. other: a Python
            whose environment has another version. keep: file for a row per case. seed: of the poses.
    """

    runs: Runs
    orders: tuple[str, ...]
    geometry: str | None
    other: str | None
    keep: Path | None
    seed: int


def bench_hands(hands: Hands, objects: Objects, asked: HandBench) -> BenchReport:
    """Check the answers of every case against single solves, then time the batches in turns.

    Args:
        hands: the first one is what the others are compared with. objects, asked: see `HandBench`.
    """
    report = BenchReport(values={"benchmark": "hands", **describe_place()})
    report.values |= {"poses": asked.runs.poses, "passes": asked.runs.passes, "seed": asked.seed}
    cases, names = list[BatchCase](), list[tuple[str, str, str]]()
    for (file, hand), (model, obj) in itertools.product(
        zip(hands.hand, _load(hands, asked), strict=True), zip(objects.object, objects.load(), strict=True)
    ):
        report.values[f"{hand.name}_elements"] = swept_elements(hand, obj)
        poses = clench.approach_poses(hand, obj, asked.runs.poses, asked.seed)
        for order in asked.orders:
            report.errors += _wrong(hand, obj, order, poses[:CHECKED])
            rows = [[*map(float, pose.wxyz), *map(float, pose.position)] for pose in poses]
            cases.append(BatchCase(file, asked.geometry, model, objects.scale, order, rows))
            names.append((hand.name, obj.name, order))
    report.values["answers_right"] = not report.errors
    if not report.errors:
        _time(report, cases, names, asked)
    return report


def _load(hands: Hands, asked: HandBench) -> list[Hand]:
    source = None if asked.geometry is None else CollisionSource(asked.geometry)
    return [clench.Hand.load(model, collision_source=source) for model in hands.hand]


def swept_elements(hand: Hand, obj: GraspObject) -> int:
    """Return how many triangles, segments and points of the links are swept."""
    from clench.scoring.calibration import calibration_of
    from clench.solver.alternatives import candidates_of
    from clench.solver.problem import make_problem

    problem = make_problem(hand, obj, _command(ClosingOrder.PROXIMAL_FIRST))
    packed = candidates_of(problem, calibration_of(None)).problem
    return len(packed.arrays.full_width.links.elements)


def _command(order: ClosingOrder) -> GraspCommand:
    return GraspCommand(hand_pose=clench.Pose.identity(), preshape="open", order=order, measure=False)


def _wrong(hand: Hand, obj: GraspObject, order: str, poses: Sequence[clench.Pose]) -> Iterator[str]:
    command = _command(ClosingOrder(order))
    batch = clench.solve_batch(hand, obj, poses, command, threads=1)
    alone = [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses]
    for sentence in wrong_answers(batch, alone):
        yield f"{hand.name}, {obj.name}, {order}: {sentence}"


def _time(
    report: BenchReport, cases: Sequence[BatchCase], names: Sequence[tuple[str, str, str]], asked: HandBench
) -> None:
    """Add the times and ratios of all cases."""
    pythons = [sys.executable, *([] if asked.other is None else [asked.other])]
    with ExitStack() as stack:
        workers = [stack.enter_context(Worker(python, cases)) for python in pythons]
        spent = np.empty((asked.runs.passes, len(cases), len(workers)))
        for turn in np.ndindex(spent.shape):
            spent[turn] = workers[turn[2]].time(turn[1])
        differ = [differing(workers[0].angles(k), workers[-1].angles(k)) for k in range(len(cases))]
    milliseconds = np.median(spent, axis=0) / asked.runs.poses * 1e3
    rows = list[Ratio]()
    for k, (hand, obj, order) in enumerate(names):
        key, first = f"{hand}_{obj}_{order}", names.index((names[0][0], obj, order))
        default = names.index((hand, obj, asked.orders[0]))
        report.values[f"{key}_processor_ms"] = ours = float(milliseconds[k, 0])
        report.values[f"{key}_over_{names[0][0]}"] = float(np.median(spent[:, k, 0] / spent[:, first, 0]))
        if order != asked.orders[0]:
            report.values[f"{key}_over_{asked.orders[0]}"] = float(np.median(spent[:, k, 0] / spent[:, default, 0]))
        if asked.other is not None:
            ratio = float(np.median(spent[:, k, 0] / spent[:, k, 1]))
            report.values |= {f"{key}_over_other": ratio, f"{key}_poses_that_differ": differ[k]}
            rows.append(Ratio(hand, obj, order, asked.geometry or "default", ours, ratio))
    if asked.keep is not None:
        keep_ratios(asked.keep, str(report.values["commit"]), rows)
