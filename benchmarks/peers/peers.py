"""The benchmark against peers: the same closings by our solve, by stepping as other programs step, and by MuJoCo."""

from __future__ import annotations

import re
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Final

import numpy as np

import clench
from clench.core.files.json_files import write_atomically
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.batch_progress import shown

from ..bench_options import Objects, Pages, Runs
from ..bench_report import BenchReport, describe_place, timed
from .closers import OURS, SIMULATED, Closer, Ended, PeerCase, wrong_ends
from .peer_picture import draw_peers, peer_table
from .peer_sweep import FACTORS, Swept, blade_misses, sweep
from .stepper import RULES

_TOLD: Final = 5
_LOGGED: Final = 20000


@dataclass(frozen=True)
class PeerBench:
    """The settings: poses and passes, planes per finger, the seed of the poses, whether MuJoCo closes."""

    runs: Runs
    planes: int
    seed: int
    simulate: bool = True
    show_progress: bool = False


def bench_peers(hand_model: str, objects: Objects, asked: PeerBench, pages: Pages) -> BenchReport:
    """Check closings of every kind against an independent engine, then time them in turn.

    Args:
        hand_model, objects: the loaded models. asked: see there. pages: files for a picture and a table.

    Returns:
        the report; with errors, and without times, when an answer is wrong.
    """
    report = BenchReport(values={"benchmark": "peers", **describe_place()})
    hand = clench.Hand.load(hand_model)
    cases: dict[str, PeerCase] = {}
    runs = asked.runs
    for obj in objects.load():
        cases[_key(obj, cases)] = PeerCase(
            hand, obj, clench.approach_poses(hand, obj, runs.poses, asked.seed), asked.planes
        )
    report.values |= {
        "hand": hand.name,
        "objects": " ".join(cases),
        "planes": asked.planes,
        **asdict(runs),
        "seed": asked.seed,
    }
    work = len(cases) * (runs.passes + 3)
    with shown(work, None if asked.show_progress else False) as advance:
        wrong = []
        for case in cases.values():
            wrong += list(wrong_ends(case))
            advance(1)
        report.errors += wrong[:_TOLD]
        report.values["answers_right"] = not wrong
        if wrong:
            return report
        for key, case in cases.items():
            _compare(report, key, case, asked, advance)
        swept = sweep(list(cases.values()), simulate=asked.simulate, advance=lambda: advance(1))
    _report_sweep(report, swept)
    misses = blade_misses(hand, runs.poses, asked.seed, asked.planes)
    report.values |= {f"blade_{key}": value for key, value in misses.values.items()}
    report.errors += misses.errors
    if pages.plot is not None:
        draw_peers(swept, misses, pages.plot)
        report.values["plot"] = str(pages.plot)
    if pages.table is not None:
        write_atomically(pages.table, peer_table(report.values, list(cases)).encode())
        report.values["table"] = str(pages.table)
    return report


def _key(obj: GraspObject, taken: Mapping[str, PeerCase]) -> str:
    key = re.sub(r"\W+", "_", obj.name).strip("_") or "object"
    return key if key not in taken else f"{key}_{len(taken)}"


def _compare(report: BenchReport, key: str, case: PeerCase, asked: PeerBench, advance: Callable[[int], None]) -> None:
    """Add what one object gives: how every way of closing ends, how long it takes, and ratios."""
    closers = {name: close for name, close in case.closers().items() if asked.simulate or name != SIMULATED}
    for name, close in closers.items():
        ends = [case.ended(k, close(k)) for k in range(len(case.poses))]
        _report_ends(report, f"{key}_{name}", case, ends)
    advance(1)
    wall, processor = _time_in_turn(case, closers, asked.runs.passes, advance)
    for name, times in wall.items():
        report.values[f"{key}_{name}_median_ms"] = float(np.median(times)) * 1e3
        report.values[f"{key}_{name}_processor_ms"] = float(np.median(processor[name])) * 1e3
    for rule in RULES:
        _report_queries(report, f"{key}_{rule.name}", case, rule.number)
    _report_ratios(report, key, wall, processor)


def _report_ends(report: BenchReport, key: str, case: PeerCase, ends: Sequence[Ended]) -> None:
    """Add gaps that are left at fingers that touch, penetration, and how many queries it took."""
    gaps = [gap for k, end in enumerate(ends) for f, gap in case.gaps(k, end.q).items() if f in end.touching]
    every = [gap for k, end in enumerate(ends) for gap in case.gaps(k, end.q).values()]
    millimetres = np.abs(np.array(gaps or [0.0])) * 1e3
    report.values |= {
        f"{key}_touching": len(gaps),
        f"{key}_residual_median_mm": float(np.median(millimetres)),
        f"{key}_residual_p90_mm": float(np.percentile(millimetres, 90)),
        f"{key}_residual_max_mm": float(millimetres.max()),
        f"{key}_penetration_max_mm": max(0.0, -float(min(every, default=0.0))) * 1e3,
    }
    if ends[0].queries:
        report.values[f"{key}_queries"] = float(np.median([end.queries + end.distances for end in ends]))
        report.values[f"{key}_distances"] = float(np.median([end.distances for end in ends]))


def _time_in_turn(
    case: PeerCase, closers: Mapping[str, Closer], passes: int, advance: Callable[[int], None]
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Return, per pass, the median time of a closing and the mean time of the processor [s], every kind in turn."""
    wall: dict[str, list[float]] = defaultdict(list)
    processor: dict[str, list[float]] = defaultdict(list)
    count = len(case.poses)
    batches = [(f"{name}_batch", partial(case.solve_all, full)) for name, full in OURS.items()]
    for _, solve in batches:
        solve()
    for _ in range(passes):
        for name, close in closers.items():
            times, before = [], time.process_time()
            for k in range(count):
                times.append(timed(partial(close, k))[1])
            processor[name].append((time.process_time() - before) / count)
            wall[name].append(float(np.median(times)))
        for name, solve in batches:
            before = time.process_time()
            wall[name].append(timed(solve)[1] / count)
            processor[name].append((time.process_time() - before) / count)
        advance(1)
    return wall, processor


def _report_queries(report: BenchReport, key: str, case: PeerCase, rule: int) -> None:
    """Add what a query takes: of our own kernels with all around it, and of python-fcl for the same questions."""
    queries = report.values[f"{key}_queries"]
    seen = []
    for k in range(len(case.poses)):
        log = case.stepper.log(_LOGGED)
        tally = case.stepper.close(RULES[rule], case.T_palm_object(k), log).tally
        collision, distance, call = case.engine.time_queries(log, case.T_palm_object(k))
        bare = max(collision - call, 0.0)
        seen.append((collision, call, tally[0] * collision + tally[1] * distance, tally[0] * bare))
    collision, call, whole, bare = np.median(np.array(seen), axis=0)
    report.values |= {
        f"{key}_query_us": float(report.values[f"{key}_median_ms"]) / max(float(queries), 1.0) * 1e3,
        f"{key}_fcl_query_us": float(collision) * 1e6,
        f"{key}_fcl_call_us": float(call) * 1e6,
        f"{key}_fcl_queries_ms": float(whole) * 1e3,
        f"{key}_fcl_bare_ms": float(bare) * 1e3,
    }


def _report_ratios(
    report: BenchReport, key: str, wall: Mapping[str, list[float]], processor: Mapping[str, list[float]]
) -> None:
    """Add how many times longer peers take than we do: the median over passes, in each of which all take turns.

    A stepper counts with the smaller of two times: its own, and python-fcl's time for its collision queries alone,
    without calls, distances or anything else. Thus slow queries cannot flatter us.
    """
    for peer in [rule.name for rule in RULES] + ([SIMULATED] if SIMULATED in wall else []):
        bare = float(report.values.get(f"{key}_{peer}_fcl_bare_ms", np.inf)) * 1e-3
        for clock, times in (("", wall), ("_processor", processor)):
            least = np.minimum(times[peer], bare)
            report.values[f"{key}_{peer}_least{clock}_ms"] = float(np.median(least)) * 1e3
            for ours in (name for name in times if name.removesuffix("_batch") in OURS):
                report.values[f"{key}_{peer}_over_{ours}{clock}"] = float(np.median(least / np.array(times[ours])))


def _report_sweep(report: BenchReport, swept: Swept) -> None:
    for rule in RULES:
        for factor, seconds, gap in zip(FACTORS, swept.seconds[rule.name], swept.residual[rule.name], strict=True):
            report.values[f"sweep_{rule.name}_{factor:g}_ms"] = seconds * 1e3
            report.values[f"sweep_{rule.name}_{factor:g}_residual_mm"] = gap * 1e3
