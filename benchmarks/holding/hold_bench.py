"""The benchmark of holding: the best grasps of a plan, tried in simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.files.json_files import write_atomically, write_json
from clench.execution.simulation.convex_pieces import in_pieces
from clench.execution.simulation.hold import Hold, HoldTest
from clench.execution.simulation.mujoco_scene import lowest
from clench.mechanics.grasp.contact_kinds import GraspKind
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.obstacles import table
from clench.planner.grasp_plan import GraspPlan

from ..bench_options import Hands, Objects
from ..bench_report import BenchReport, Value, describe_place
from .proportions import roc_auc, wilson
from .trying import Trial, try_grasp

#: Of the planned grasps that are not the best, one of so many is tried.
SPREAD = 2

#: Stricter limits on the object's motion: name, distance [m], angle [rad].
STRICT = (("10mm_5deg", 0.01, float(np.deg2rad(5.0))), ("5mm_5deg", 0.005, float(np.deg2rad(5.0))))
TRIALS_SCHEMA = "clench.hold-trials/2"
#: Where the file with a Markdown table has a column: heading, key.
_COLUMNS = (
    ("tried", "tried"),
    ("held", "held"),
    ("95 % of held", "held_interval"),
    ("5 mm/5°", "held_5mm_5deg"),
    ("friction 0.3", "held_friction_0.3"),
    ("0.5 kg", "held_mass_0.5"),
    ("closing [mm]", "closing_motion_median_mm"),
    ("touches [ms]", "touch_spread_median_ms"),
    ("squeeze [mm]", "squeeze_motion_median_mm"),
    ("penetration [µm]", "penetration_max_um"),
    ("links", "contact_links_mean"),
    ("AUC", "score_auc"),
)


@dataclass(frozen=True)
class HoldBench:
    """The settings of the trial.

    Args:
        proposals: of the planner per hand and object. best: grasps by score that are tried. others: tried besides,
            over all scores, to judge the score. seed: of the planner. hold: the test.
    """

    proposals: int
    best: int
    others: int
    seed: int
    hold: Hold

    @property
    def planned(self) -> int:
        """How many grasps are planned."""
        return self.best + SPREAD * self.others


@dataclass(frozen=True)
class HoldFiles:
    """Say where more is written: a Markdown table, and all trials (JSON, schema `clench.hold-trials/2`)."""

    table: Path | None = None
    trials: Path | None = None


def bench_hold(
    hands: Hands, objects: Objects, asked: HoldBench, files: HoldFiles, *, show_progress: bool
) -> BenchReport:
    """Plan and try grasps for every hand and object.

    Args:
        hands, objects: the loaded models. asked: settings of the trial. files: where it is written.
        show_progress: show a bar.
    """
    loaded_hands = hands.load()
    loaded = [in_pieces(obj, show_progress=show_progress) for obj in objects.load()]
    report = BenchReport(values={"benchmark": "hold", **describe_place()})
    settings = {key: value for key, value in asdict(asked).items() if key != "hold"}
    report.values |= settings | {f"hold_{key}": value for key, value in asdict(asked.hold).items()}
    names = [_label(model) for model in objects.object]
    cases = [(hand, obj, name) for hand in loaded_hands for obj, name in zip(loaded, names, strict=True)]
    rows, kept = [], list[dict[str, Any]]()
    with _progress(len(cases) * _work(asked), show_progress) as tick:
        for number, (hand, obj, name) in enumerate(cases):
            tick(0, f"{hand.name}, {name}")
            trials, values = _case(hand, obj, asked, lambda: tick(1, None))
            kept += [{"hand": hand.name, "object": name, **trial.to_dict()} for trial in trials]
            tick(-((number + 1) * _work(asked)), None)
            report.values |= {f"{hand.name}.{name}.{key}": value for key, value in values.items()}
            rows.append((hand.name, name, values))
    if files.table is not None:
        write_atomically(files.table, _markdown(rows).encode())
    if files.trials is not None:
        write_json(files.trials, {"schema": TRIALS_SCHEMA, "trials": kept}, "trials")
    return report


def _label(model: str) -> str:
    """Return what an object is called in the report: of a file, its folder too, since files are often named alike."""
    path = Path(model)
    return f"{path.parent.name}/{path.stem}" if path.suffix and path.parent.name else model


def _work(asked: HoldBench) -> int:
    return asked.planned + asked.best + asked.others


def _case(
    hand: Hand, obj: GraspObject, asked: HoldBench, tick: Callable[[], None]
) -> tuple[list[Trial], dict[str, Value]]:
    """Return the trials of one hand and one object, and what came of them, flat."""
    if asked.hold.test == HoldTest.LIFT:
        obj = obj.with_body(table(lowest(obj)))
    plan = _plan(hand, obj, asked, tick)
    best, rest = plan.grasps[: asked.best], plan.grasps[asked.best :]
    others = rest[::-SPREAD][: asked.others]
    trials = []
    for number, grasp in enumerate([*best, *others]):
        trials.append(try_grasp(grasp.solution, grasp.score, hand, obj, asked.hold, harder=number < len(best)))
        tick()
    values: dict[str, Value] = {"proposed": plan.proposed, "closed": plan.closed, "force_closed": plan.force_closed}
    values |= {f"rejected_{reason.replace(' ', '_')}": n for reason, n in sorted(plan.rejected.items()) if n}
    values["grasps"] = len(plan)
    return trials, values | _of_best(trials[: len(best)]) | _of_score(trials)


def _plan(hand: Hand, obj: GraspObject, asked: HoldBench, tick: Callable[[], None]) -> GraspPlan:
    """Plan for the mass and the friction of the test; the weight alone has to be held where it lifts."""
    search = clench.iter_grasps(
        hand,
        obj,
        asked.planned,
        friction=asked.hold.friction,
        mass=asked.hold.mass,
        gravity=(0.0, 0.0, -1.0) if asked.hold.test == HoldTest.LIFT else None,
        effort=max(1, asked.proposals // asked.planned),
        most=asked.proposals,
        seed=asked.seed,
        path=False,
    )
    for _ in search:
        tick()
    return search.plan()


def _of_best(trials: Sequence[Trial]) -> dict[str, Value]:
    """Return how the selected grasps did."""
    count = len(trials)
    values: dict[str, Value] = {"tried": count}
    outcomes = {"held": [t.report.held for t in trials]}
    outcomes |= {f"held_{name}": [t.report.held_within(*limits) for t in trials] for name, *limits in STRICT}
    for name in trials[0].harder if trials else ():
        outcomes[f"held_{name}"] = [t.harder[name].held for t in trials]
    for key, held in outcomes.items():
        low, high = wilson(sum(held), count)
        values[key] = sum(held)
        values[f"{key}_interval"] = f"{100 * low:.0f}-{100 * high:.0f} %"
    values |= {f"outcome_{name}": n for name, n in sorted(Counter(t.outcome for t in trials).items())}
    for kind in GraspKind:
        of_kind = [t.report.held for t in trials if t.grasp_kind is kind]
        values |= {f"{kind}_tried": len(of_kind), f"{kind}_held": sum(of_kind)} if of_kind else {}
    for name in trials[0].harder if trials else ():
        values[f"no_feasible_squeeze_{name}"] = sum(not t.harder[name].planned for t in trials)
    if not trials:
        return values
    spreads = [t.report.touch_spread for t in trials if t.report.touch_spread is not None]
    measures = [t.measures for t in trials]
    closed = [t.report.closed for t in trials if t.report.closed is not None]
    squeezed = [t.report.squeezed for t in trials if t.report.squeezed is not None]
    return values | {
        "simultaneous": sum(t.simultaneous for t in trials),
        **_numbers("closing_motion", [motion.distance * 1e3 for motion in closed], "mm"),
        **_numbers("closing_turn", [np.rad2deg(motion.angle) for motion in closed], "deg"),
        **_numbers("squeeze_motion", [motion.distance * 1e3 for motion in squeezed], "mm"),
        **_numbers("touch_spread", [spread * 1e3 for spread in spreads], "ms"),
        "penetration_max_um": max(s.penetration for s in measures) * 1e6,
        "self_penetration_max_um": max(s.self_penetration for s in measures) * 1e6,
        "contact_links_mean": float(np.mean([s.contact_links for s in measures])),
        "contact_distance_mean_mm": float(np.mean([s.contact_distance for s in measures])) * 1e3,
        "consistency_mean_mm": float(np.mean([s.consistency for s in measures])) * 1e3,
        "torque_max_nm": max(max(map(abs, t.report.torques.values()), default=0.0) for t in trials),
    }


def _numbers(key: str, found: Sequence[float], unit: str) -> dict[str, Value]:
    if not found:
        return {}
    return {f"{key}_median_{unit}": float(np.median(found)), f"{key}_max_{unit}": float(np.max(found))}


def _of_score(trials: Sequence[Trial]) -> dict[str, Value]:
    """Return how well the score tells held from dropped, over all trials."""
    held = [t.report.held for t in trials]
    area = roc_auc([t.score for t in trials], held)
    return {
        "score_trials": len(trials),
        "score_held": sum(held),
        **({} if area is None else {"score_auc": area}),
        **{f"all_{name}": n for name, n in sorted(Counter(t.outcome for t in trials).items())},
    }


def _markdown(rows: Sequence[tuple[str, str, dict[str, Value]]]) -> str:
    lines = ["| hand | object | " + " | ".join(heading for heading, _ in _COLUMNS) + " |"]
    lines.append("|" + "---|" * (len(_COLUMNS) + 2))
    for hand, obj, values in rows:
        cells = [_cell(values.get(key)) for _, key in _COLUMNS]
        lines.append(f"| {hand} | {obj} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(value: Value | None) -> str:
    if value is None:
        return "–"
    return f"{value:.2g}" if isinstance(value, float) else str(value)


@contextmanager
def _progress(total: int, show: bool) -> Iterator[Callable[[int, str | None], None]]:
    """Yield a function that counts on by a step, or up to a number given negative, and says what is done."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not show) as progress:
        task = progress.add_task("", total=total)

        def tick(step: int, text: str | None) -> None:
            if step < 0:
                progress.update(task, completed=-step)
            else:
                progress.update(task, advance=step, description=text)

        yield tick
