"""Solve a command from one posture, as a batch of one: numbers immediately, reasons when first read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from clench.closing.candidates import FingerCandidate, held_touches, read_candidates
from clench.closing.kernel_run import Answers, row_of, solve_packed
from clench.core.caching.deferring import DeferredMapping, once
from clench.models.command import GraspCommand
from clench.models.command_file import check_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.scoring.calibration import Calibration, calibration_of
from clench.scoring.criterion_registry import score_candidates
from clench.solver.batch.grasp_batch import STATUSES

from .alternatives import (
    Alternatives,
    Candidates,
    Groups,
    candidates_of,
    group_by_finger,
    overlaps_of,
    read_judged,
    with_planes,
)
from .assembly import Answer, assemble, joint_limits, plain_steps
from .certificate import judge, promised
from .clock import Clock
from .orders import best_order
from .planning import plan_hand
from .problem import Problem, check_calibration, make_context, make_problem
from .solution import GraspSolution


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
    clock.lap("read")
    candidates = candidates_of(problem, calibration)
    clock.lap("plan")
    solver = PoseSolver(problem, calibration, candidates)
    answers = solver.solve()
    clock.lap("close")
    return solver.solution(answers, clock.stages())


class PoseSolver:
    """A solver for one problem at its pose.

    Args:
        problem: the three inputs. calibration: basis of the choice. candidates: the candidates to close.
    """

    def __init__(self, problem: Problem, calibration: Calibration, candidates: Candidates) -> None:
        self._problem, self._calibration, self._candidates = problem, calibration, candidates
        self._context = once(partial(make_context, problem, calibration))
        self._alternatives: Alternatives | None = None

    def solve(self) -> Answers:
        """Close, choose and judge, as a batch of one."""
        T = self._problem.T_palm_object[None, :3]
        choose = None if self._candidates.by_kernel else lambda n, answers: self.choose(answers)
        return solve_packed(self._candidates.problem, T, choose=choose)

    def choose(self, answers: Answers) -> tuple[list[int], bool]:
        """Choose among the candidates that are closed at the pose; see `Alternatives.chosen_candidates`."""
        plan = self._candidates.plan
        read = partial(read_judged, self._problem, plan, answers.closed)
        self._alternatives = self._alternatives_of(lambda: group_by_finger(plan, read()))
        return self._alternatives.chosen_candidates()

    def _alternatives_of(self, close: Callable[[], list[list[FingerCandidate]]]) -> Alternatives:
        return Alternatives(self._problem, self._calibration, self._context(), close)

    def solution(self, answers: Answers, stages: Mapping[str, float]) -> GraspSolution:
        """Return the solution of answers for this pose alone; contacts, reasons and scores are made when read."""
        problem, solved = self._problem, answers.solved
        names = problem.hand.joint_names
        return GraspSolution.deferred(
            once(lambda: assemble(self._answer(answers), problem, stages)),
            status=STATUSES[int(solved.status[0])],
            joint_angles=dict(zip(names, solved.angles[0].tolist(), strict=True)),
            certified=bool(solved.certified[0]),
            hand_pose=problem.T_world_palm,
            object_pose=problem.T_world_object,
            joint_limits=joint_limits(problem.hand),
            timing=stages,
            quality=None,
            squeeze=None,
            pregrasp=None,
            speeds=dict(problem.command.speeds),
            rounds=problem.command.rounds,
            next_steps=plain_steps(problem.command),
        )

    def _answer(self, answers: Answers) -> Answer:
        """Read the answer: candidates, contacts, scores, overlaps, and the reasons for these candidates."""
        problem, plan = self._problem, self._candidates.plan
        alternatives, free = self._alternatives, None
        if alternatives is None:
            free = read_judged(problem, plan, answers.closed)
            alternatives = self._alternatives_of(self._late_candidates(answers, free))
        candidates = answers.solved.chosen[0].tolist()
        if free is None:
            chosen, names = alternatives.choice.chosen, alternatives.choice.used
            best = [alternatives.of_finger(k)[i] for k, i in enumerate(chosen)]
        else:
            names, best = tuple(self._calibration.criteria), [free[i] for i in candidates]
            chosen = (
                plan_hand(problem).plane_counts if any(plan.is_full_width) else plan.candidates.low[candidates].tolist()
            )
            score_candidates(best, names, self._context())
        changed = self._closed_again(answers, best)
        score_candidates([best[k] for k in changed], names, self._context())
        final = answers.solved.angles[0]
        certificate = promised(problem) if answers.solved.certified[0] else None
        at_start, at_end, certificate = judge(problem, best, final, plan.full_width_arrays, certificate)
        explained = DeferredMapping(partial(alternatives.explained, best, changed))
        return Answer(alternatives.of_finger, chosen, best, final, at_start, at_end, certificate, explained)

    def _late_candidates(self, answers: Answers, free: list[FingerCandidate]) -> Callable[[], Groups]:
        """Return a function that gives all candidates of every finger, from which the kernels chose."""
        problem, plan = self._problem, self._candidates.plan
        if any(plan.is_full_width):
            return lambda: with_planes(problem, overlaps_of(problem, plan, answers.closed), free)
        return lambda: group_by_finger(plan, free)

    def _closed_again(self, answers: Answers, best: list[FingerCandidate]) -> list[int]:
        """Put the candidates that the other fingers changed in the place of the chosen ones; return their fingers."""
        problem, closed = self._problem, answers.closed
        picked = self._candidates.plan.only(answers.solved.chosen[0].tolist())
        anew, overlapping = closed.anew[0] != 0, closed.overlapping[0] != 0
        if anew.any():
            nowhere = [None] * len(picked.plans)
            final = row_of(closed.final, 0)
            candidates = read_candidates(picked, problem.packed, final, problem.T_palm_object, nowhere)
            for k in anew.nonzero()[0].tolist():
                best[k] = replace(candidates[k], index=best[k].index, clear=best[k].clear)
        held = held_touches(picked, row_of(closed.met, 0))
        for k in sorted({*held, *overlapping.nonzero()[0].tolist()}):
            touches = (*best[k].touches, *held.get(k, ()))
            best[k] = replace(best[k], swept=best[k].swept and not overlapping[k], touches=touches)
            anew[k] = True
        return [int(k) for k in anew.nonzero()[0]]
