"""The benchmark of planning: how long a first grasp takes and ten, and how many grasps a second of search closes."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass

import clench
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.planner.grasp_plan import GraspPlan
from clench.planner.options import PlanOptions
from clench.planner.search import GraspSearch

from ..bench_options import Hands, Objects
from ..bench_report import BenchReport, describe_place

#: Stages that every proposal goes through; the others are for the grasps that are returned.
SEARCHED = ("proposing", "approaching", "closing")


@dataclass(frozen=True)
class PlanningBench:
    """How many grasps are planned, from how many proposals, and on how many threads."""

    grasps: int
    proposals: int
    threads: int | None
    seed: int


def bench_planning(hands: Hands, objects: Objects, asked: PlanningBench) -> BenchReport:
    """Plan grasps of every object with every hand, check and time them.

    A first plan of one grasp loads kernels and preshapes; it is not timed.

    Args:
        hands, objects: what is planned. asked: see `PlanningBench`.
    """
    report = BenchReport(values={"benchmark": "planning", **describe_place()})
    report.values |= {"grasps": asked.grasps, "proposals": asked.proposals, "seed": asked.seed}
    for hand, obj in itertools.product(hands.load(), objects.load()):
        clench.plan_grasps(hand, obj, 1, most=64)
        _measure(report, hand, obj, asked)
    report.values["answers_right"] = not report.errors
    return report


def _measure(report: BenchReport, hand: Hand, obj: GraspObject, asked: PlanningBench) -> None:
    options = PlanOptions(asked.grasps, most=asked.proposals, seed=asked.seed, threads=asked.threads)
    began, processor, first = time.perf_counter(), time.process_time(), 0.0
    search = GraspSearch(hand, obj, options)
    for _ in search:
        first = first or time.perf_counter() - began
    taken, spent, plan = time.perf_counter() - began, time.process_time() - processor, search.plan()
    report.errors += (f"{hand.name}, {obj.name}: {sentence}" for sentence in wrong_grasps(plan, hand, obj))
    key, searched = f"{hand.name}_{obj.name}", sum(plan.times[stage] for stage in SEARCHED)
    report.values |= {
        f"{key}_proposed": plan.proposed,
        f"{key}_closed": plan.closed,
        f"{key}_force_closed": plan.force_closed,
        f"{key}_returned": len(plan),
        f"{key}_first_s": first,
        f"{key}_all_s": taken,
        f"{key}_all_processor_s": spent,
        f"{key}_force_closed_per_s": plan.force_closed / max(searched, 1e-9),
        f"{key}_returned_per_s": len(plan) / max(taken, 1e-9),
        **{f"{key}_{stage}_s": seconds for stage, seconds in plan.times.items()},
    }


def wrong_grasps(plan: GraspPlan, hand: Hand, obj: GraspObject) -> Iterator[str]:
    """Yield a sentence for every grasp that is not what a plan promises."""
    if not len(plan):
        yield f"no grasp was found. {plan.text}"
    for number, grasp in enumerate(plan):
        quality = clench.grasp_quality(grasp.solution, hand, obj, friction=plan.asked.lowest_friction)
        if not grasp.solution.certified:
            yield f"grasp {number} is not certified."
        for violation in grasp.solution.violations():
            yield f"grasp {number}: {violation}"
        if not quality.epsilon.radius > 0.0:
            yield f"grasp {number} does not resist every wrench."
