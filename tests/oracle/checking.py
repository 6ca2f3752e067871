"""Judge an answer by its gaps: true stops, nothing earlier, and free travel to every limit that it claims."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .compiled import Floats
from .planar import StageAnswer, gap_at, overlaps_at_start, walk_stage
from .scene import PlanarCurve, PlanarFinger

BEYOND = 1e-3
#: From turns that move nothing by more than rounding: a touch near the end of a segment dips before it opens.
PROBES = np.geomspace(1e-12, BEYOND, 46)


@dataclass(frozen=True)
class StageVerdict:
    """What was found about one stage.

    ``failures``: sentences, empty when the stage is right. ``grazing``: it stopped where going on would not have gone
    deeper than the tolerance: neither right nor wrong. ``unresolved``: the walk gave up before it proved the path.
    """

    dof: int
    failures: tuple[str, ...]
    grazing: bool
    unresolved: bool
    end_gap: float
    least_gap: float
    looks: int


@dataclass(frozen=True)
class Verdict:
    """What was found about an answer. ``overlaps_at_start``: nothing else was judged."""

    stages: tuple[StageVerdict, ...]
    overlaps_at_start: bool

    @property
    def ok(self) -> bool:
        """Tell whether nothing is wrong (a case that overlaps at the start has nothing that could be)."""
        return not self.failures

    @property
    def failures(self) -> tuple[str, ...]:
        """Return all sentences."""
        return tuple(f"stage {s.dof}: {f}" for s in self.stages for f in s.failures)

    @property
    def grazing(self) -> int:
        """Return the number of stages that stopped at a grazing touch."""
        return sum(s.grazing for s in self.stages)

    @property
    def unresolved(self) -> int:
        """Return the number of stages whose path was not proven."""
        return sum(s.unresolved for s in self.stages)


def check_answer(finger: PlanarFinger, curve: PlanarCurve, stages: Sequence[StageAnswer]) -> Verdict:
    """Judge an answer, one entry per degree of freedom in order; see ``StageVerdict``."""
    if overlaps_at_start(finger, curve):
        return Verdict((), True)
    if [stage.dof for stage in stages] != list(range(finger.dofs)):
        return Verdict((_refused(0, "the answer has not exactly one stage per group, in order"),), False)
    parameters = np.zeros(finger.dofs)
    verdicts = []
    for stage in stages:
        verdicts.append(_check_stage(finger, curve, parameters, stage))
        parameters[stage.dof] = stage.parameter
    return Verdict(tuple(verdicts), False)


def _refused(dof: int, sentence: str) -> StageVerdict:
    return StageVerdict(dof, (sentence,), False, False, np.nan, np.nan, 0)


def _check_stage(finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, stage: StageAnswer) -> StageVerdict:
    travel = finger.travel(stage.dof)
    if not -1e-12 <= stage.parameter <= travel * (1 + 1e-12):
        return _refused(stage.dof, f"parameter {stage.parameter} is outside 0 .. {travel}")
    tolerance = finger.tolerance
    walk = walk_stage(finger, curve, parameters, stage.dof, 0.0, stage.parameter)
    end = parameters.copy()
    end[stage.dof] = stage.parameter
    gap = gap_at(finger, curve, end, finger.leader(stage.dof))
    failures = []
    unresolved = walk.violation is not None and not walk.violation.proven
    if walk.violation is not None and walk.violation.proven:
        where = walk.violation
        failures.append(
            f"outline {where.outline} goes deeper than {tolerance:.1e} m at {where.parameter!r}, before the end"
        )
    grazing = False
    if stage.ended == "limit":
        if stage.parameter < travel * (1 - 1e-12):
            failures.append(f"ended by limit at {stage.parameter!r}, the limit is {travel!r}")
    elif abs(gap) > tolerance * (1 + 1e-6):
        failures.append(f"ended by contact with a gap of {gap:.3e} m")
    elif not failures:
        stop = _kind_of_stop(finger, curve, parameters, stage)
        grazing = stop == "grazing"
        if stop == "free":
            failures.append("ended by contact at 0, but going on only opens the gap")
    return StageVerdict(stage.dof, tuple(failures), grazing, unresolved, gap, walk.least_gap, walk.looks)


def _kind_of_stop(finger: PlanarFinger, curve: PlanarCurve, parameters: Floats, stage: StageAnswer) -> str:
    """Tell a true ``stop`` from a ``grazing`` one and from one that was ``free`` to go on.

    True: going on by at most 1e-3 violates, or only the limit is left. Free: the stage never moved, though from its
    start the gap never shrinks and soon is open. All else is a touch too shallow to judge.
    """
    far = min(stage.parameter + BEYOND / abs(finger.rates[finger.leader(stage.dof)]), finger.travel(stage.dof))
    if far <= stage.parameter * (1 + 1e-12):
        return "stop"
    if walk_stage(finger, curve, parameters, stage.dof, stage.parameter, far).violation is not None:
        return "stop"
    if stage.parameter > 0.0:
        return "grazing"
    gaps = []
    for probe in np.concatenate([[0.0], PROBES[far >= PROBES]]):
        trial = parameters.copy()
        trial[stage.dof] = probe
        gaps.append(gap_at(finger, curve, trial, finger.leader(stage.dof)))
    noise = 1e-6 * finger.tolerance
    opens = max(gaps) > gaps[0] + finger.tolerance
    return "free" if opens and min(gaps) >= gaps[0] - noise else "grazing"
