"""The benchmark of the choice: five fingers with several alternatives each, without and with epsilon."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence

import numpy as np

import clench
from clench.closing.candidates import FingerCandidate
from clench.models.command import GraspCommand
from clench.scoring.calibration import Calibration
from clench.scoring.choice import HandChoice, choose
from clench.scoring.criterion_types import ScoringContext
from clench.solver.alternatives import finger_candidates
from clench.solver.problem import make_context, make_problem

from ..bench_options import Case, Runs
from ..bench_report import BenchReport, describe_place

#: Offset between two open values that are alternatives of each other [rad].
STEP = 0.08
#: Sets per finger where everything is tried, to check the search.
CHECKED_SETS = 3
#: Poses that are checked so.
CHECKED_POSES = 5

ADDITIVE = Calibration("additive", {"range_of_motion": 1.0, "touching_links": 1.0, "limit_distance": 0.2})
STEADY = Calibration("steady", {"range_of_motion": 0.2, "epsilon": 1.0})

Groups = Sequence[Sequence[FingerCandidate]]


def bench_choice(case: Case, runs: Runs, alternatives: int, seed: int) -> BenchReport:
    """Check choices against trying everything, then time them.

    Args:
        case: the loaded models. runs: how many poses, and how often. seed: of the poses.
        alternatives: sets per finger, each from an open value of its own.
    """
    hand, obj = case.load()
    variants = tuple(STEP * k for k in range(alternatives))
    problems = [
        make_problem(hand, obj, GraspCommand(hand_pose=pose, preshape="open", planes=1, open_variants=variants))
        for pose in clench.approach_poses(hand, obj, runs.poses, seed)
    ]
    cases = [([[c for c in g if c.plane is None] for g in finger_candidates(p)], p) for p in problems]
    report = BenchReport(values={"benchmark": "choose", **describe_place()})
    report.values |= {
        "hand": hand.name,
        "fingers": len(hand.fingers),
        "object": obj.name,
        "alternatives": alternatives,
        "poses": len(cases),
        "passes": runs.passes,
        "seed": seed,
    }
    for i, (groups, problem) in enumerate(cases[:CHECKED_POSES]):
        few = [group[:CHECKED_SETS] for group in groups]
        report.errors += [f"pose {i}: {e}" for e in _wrong(few, make_context(problem, STEADY))]
    report.values["answers_right"] = not report.errors
    if not report.errors:
        for calibration in (ADDITIVE, STEADY):
            made = [(groups, make_context(p, calibration)) for groups, p in cases]
            _time(report, made, calibration, runs.passes)
    return report


def _wrong(groups: Groups, context: ScoringContext) -> list[str]:
    """Return a sentence for every calibration whose choice is not the best of all combinations."""
    found = []
    for calibration in (ADDITIVE, STEADY):
        choice = choose(groups, calibration, context)
        totals = []
        for sets in itertools.product(*(finger.equals for finger in choice.fingers)):
            one = [[group[i]] for group, i in zip(groups, sets, strict=True)]
            totals.append(choose(one, calibration, context).total)
        if max(totals) > choice.total + 1e-9:
            found.append(f"{calibration.name}: chose {choice.total:.9g}, the best is {max(totals):.9g}.")
    return found


def _time(
    report: BenchReport, made: Sequence[tuple[Groups, ScoringContext]], calibration: Calibration, passes: int
) -> None:
    seconds, tried, proved = [], [], []
    for groups, context in [case for _ in range(passes) for case in made]:
        context.kept.clear()
        start = time.perf_counter()
        choice: HandChoice = choose(groups, calibration, context)
        seconds.append(time.perf_counter() - start)
        tried.append(choice.tried)
        proved.append(choice.proved)
    report.distribution(f"choose_{calibration.name}", seconds)
    report.values[f"combinations_tried_{calibration.name}_median"] = float(np.median(tried))
    report.values[f"proved_{calibration.name}"] = float(np.mean(proved))
    report.values[f"combinations_{calibration.name}_median"] = float(
        np.median([np.prod([len(f.equals) for f in choose(g, calibration, s).fingers]) for g, s in made])
    )
