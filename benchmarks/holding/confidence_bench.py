"""The benchmark that calibrates confidence: grasps of all scores, tried in simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.files.json_files import write_json
from clench.execution.simulation.convex_pieces import in_pieces
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.pulling import hold_and_pull
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.planner.confidence import SCHEMA, ConfidenceTable

from ..bench_options import Hands, Objects
from ..bench_report import BenchReport, Value, describe_place
from .proportions import roc_auc, wilson


@dataclass(frozen=True)
class ConfidenceBench:
    """The settings of the trial.

    Args:
        proposals: per hand and object. grasps: tried of them, spread evenly over the scores. seed: of the proposals.
        hold: the test.
    """

    proposals: int
    grasps: int
    seed: int
    hold: Hold


@dataclass(frozen=True)
class Outcome:
    """The outcome of a grasp: its object, its score, and whether it held."""

    hand: str
    object: str
    score: float
    held: bool


def bench_confidence(
    hands: Hands, objects: Objects, asked: ConfidenceBench, out: Path | None, *, show: bool
) -> BenchReport:
    """Plan grasps of all scores for every hand and object, try them, and tabulate the share that held.

    Args:
        hands, objects: the loaded models. asked: settings of the trial. out: file for the table (JSON). show: a bar.
    """
    from rich.console import Console
    from rich.progress import track

    loaded_hands = hands.load()
    loaded = [in_pieces(obj, show_progress=show) for obj in objects.load()]
    cases = [(hand, obj, name) for hand in loaded_hands for obj, name in zip(loaded, objects.object, strict=True)]
    found: list[Outcome] = []
    for hand, obj, name in track(cases, "Trying", console=Console(stderr=True), transient=True, disable=not show):
        found += _outcomes(hand, obj, name, asked)
    report = BenchReport(values={"benchmark": "confidence", **describe_place()})
    report.values |= summarise(found)
    if out is not None:
        write_json(out, document(found, asked), "confidence")
    return report


def _outcomes(hand: Hand, obj: GraspObject, name: str, asked: ConfidenceBench) -> list[Outcome]:
    """Return what came of grasps of one hand and object, from the lowest score to the highest."""
    friction = asked.hold.friction
    plan = clench.plan_grasps(
        hand, obj, asked.proposals, effort=1, most=asked.proposals, friction=friction, mass=asked.hold.mass, path=False
    )
    ranked = sorted(plan, key=lambda grasp: grasp.score)
    outcomes = []
    for row in sorted({round(r) for r in np.linspace(0, len(ranked) - 1, asked.grasps).tolist()} if ranked else ()):
        grasp = ranked[row]
        way = clench.plan_trajectory(grasp.solution, hand, obj=obj, force=True)
        held = hold_and_pull(grasp.solution, hand, obj, asked.hold, way).held
        outcomes.append(Outcome(hand.name, name, grasp.score, held))
    return outcomes


def summarise(found: Sequence[Outcome]) -> dict[str, Value]:
    """Return the levels of the table with 95 % intervals, and how well it tells outcomes of objects left out."""
    scores, held = [o.score for o in found], [o.held for o in found]
    values: dict[str, Value] = {"tried": len(found), "held": sum(held)}
    if not found:
        return values
    table = ConfidenceTable.of(scores, held)
    for number, (score, tried, kept) in enumerate(zip(table.score, table.tried, table.held, strict=True)):
        low, high = wilson(round(kept), round(tried))
        values[f"level_{number}"] = (
            f"score {score:.4f}: {kept:.0f} of {tried:.0f} held ({100 * low:.0f}-{100 * high:.0f} %)"
        )
    area = roc_auc(scores, held)
    values |= {"brier": brier(found), "brier_of_the_mean": float(np.var(np.array(held, dtype=np.float64)))}
    return values if area is None else values | {"auc": area}


def brier(found: Sequence[Outcome]) -> float:
    """Return the Brier score of confidences of every object's grasps, by the table of all other objects."""
    errors = []
    for name in sorted({outcome.object for outcome in found}):
        others = [o for o in found if o.object != name]
        table = ConfidenceTable.of([o.score for o in others], [o.held for o in others]) if others else None
        for outcome in (o for o in found if o.object == name):
            said = 0.5 if table is None else table.confidence(outcome.score)
            errors.append((said - outcome.held) ** 2)
    return float(np.mean(errors))


def document(found: Sequence[Outcome], asked: ConfidenceBench) -> dict[str, Any]:
    """Return the table as a document of schema `clench.confidence/1`."""
    table = ConfidenceTable.of([o.score for o in found], [o.held for o in found])
    return {
        "schema": SCHEMA,
        "clench_version": clench.__version__,
        "hands": len({o.hand for o in found}),
        "objects": len({o.object for o in found}),
        "test": {"mass": asked.hold.mass, "friction": asked.hold.friction, "distance": asked.hold.max_distance},
        "brier": brier(found),
        **table.to_dict(),
    }
