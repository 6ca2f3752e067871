"""One closing from one posture: the sets of every finger, the choice among them, and what is promised of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from clench.base.deferring import DeferredMapping, once
from clench.grasp.calibration import Calibration, calibration_of
from clench.grasp.candidates import FingerCandidate, combined_posture
from clench.grasp.criteria import Setting
from clench.grasp.criterion_registry import score_sets
from clench.grasp.exact import hand_bodies
from clench.grasp.sequence import close_in_sequence
from clench.grasp.simultaneous import close_together
from clench.models.command import GraspCommand
from clench.models.command_file import check_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

from .alternatives import Alternatives, close_sets, decided, group_by_finger, with_planes
from .assembly import Answer, assemble
from .certificate import judge
from .clock import Clock
from .directly import solve_directly
from .orders import best_order
from .planning import Planned, planned
from .problem import Problem, check_calibration, make_problem, make_setting
from .solution import GraspSolution

if TYPE_CHECKING:
    from clench.grasp.closing import ClosedHand


def solve_posture(hand: Hand, obj: GraspObject, command: GraspCommand) -> GraspSolution:
    """Return the answer of `clench.solve` for the posture that a command gives; without one, for the open hand."""
    if command.orders:
        check_command(hand, command)
        return best_order(command, lambda single: _solve_order(hand, obj, single))
    return _solve_order(hand, obj, command)


def _solve_order(hand: Hand, obj: GraspObject, command: GraspCommand) -> GraspSolution:
    """Solve a command in its one closing order."""
    clock = Clock()
    problem = make_problem(hand, obj, command)
    calibration = calibration_of(command.criteria)
    check_calibration(hand, calibration)
    setting = once(partial(make_setting, problem, calibration))
    clock.lap("read")
    in_full = partial(_answer, problem, calibration, setting, clock)
    solution = solve_directly(problem, calibration, setting, in_full, clock)
    return solution or assemble(in_full(), problem, clock.stages())


def _answer(problem: Problem, calibration: Calibration, setting_of: Callable[[], Setting], clock: Clock) -> Answer:
    """Close what is asked for, choose, close again what is in each other's way, and judge it."""
    setting = setting_of()
    full_width = decided(problem, calibration)
    made = full_width or planned(problem)
    clock.lap("plan")
    found = close_sets(problem, made, clock.lap)
    if full_width:
        close = partial(with_planes, problem, found.overlaps, found.sets)
        alternatives = Alternatives(problem, calibration, setting, close)
        best, names = list(found.sets), calibration.criteria
        chosen = planned(problem).plane_counts
        score_sets(best, names, setting)
    else:
        close = partial(group_by_finger, made.plan, found.sets)
        alternatives = Alternatives(problem, calibration, setting, close)
        chosen, names = alternatives.choice.chosen, alternatives.choice.used
        best = [alternatives.of_finger(k)[i] for k, i in enumerate(chosen)]
    clock.lap("choose")
    again = _with_each_other(problem, made, found.closed, best)
    changed = [k for k, (old, new) in enumerate(zip(best, again, strict=True)) if new is not old]
    for k in changed:
        best[k] = replace(again[k], clear=best[k].clear)
    score_sets([best[k] for k in changed], names, setting)
    clock.lap("sequence")
    explained = DeferredMapping(partial(alternatives.explained, best, changed))
    final = combined_posture(problem.hand, problem.start, best)
    at_start, at_end, certificate = judge(problem, best, final, made.exact)
    clock.lap("judge")
    return Answer(alternatives.of_finger, chosen, best, final, at_start, at_end, certificate, explained)


def _with_each_other(
    problem: Problem, made: Planned, closed: ClosedHand, best: Sequence[FingerCandidate]
) -> list[FingerCandidate]:
    """Return the chosen sets, closed again where fingers are in each other's way."""
    hand, packed, plan, exact = problem.hand, problem.packed, made.plan, made.exact
    bodies = hand_bodies(hand, problem.source, problem.start)
    if plan.together:
        return close_together(hand, plan, exact, closed, packed, best, bodies)
    return close_in_sequence(hand, plan, exact, closed, packed, best, problem.start, problem.rounds, bodies)
