"""One solve by the kernels of a batch, whose answer says at once what a control loop asks; the rest is made when read.

A pose, angles, status and what is promised are known when the kernels are done. Contacts, reasons and scores are made
of the kernels' numbers when one of them is first read; what was not chosen, and why, by closing it then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from clench.base.deferring import DeferredMapping, once
from clench.grasp.batch_run import PoseAnswer, solve_pose
from clench.grasp.calibration import Calibration
from clench.grasp.candidates import FingerCandidate, read_candidates
from clench.grasp.criteria import Setting
from clench.grasp.criterion_registry import is_built_in, score_sets
from clench.grasp.feasibility import judge_sets

from .alternatives import Alternatives, group_by_finger
from .assembly import Answer, assemble, joint_limits, plain_steps
from .certificate import judge, promised
from .clock import Clock
from .grasp_batch import STATUSES
from .packing import packed_problem
from .planning import Planned, planned
from .problem import Problem
from .solution import GraspSolution, SolutionStatus


def solve_directly(
    problem: Problem,
    calibration: Calibration,
    setting: Callable[[], Setting],
    in_full: Callable[[], Answer],
    clock: Clock,
) -> GraspSolution | None:
    """Return the solution where the kernels of a batch give it, and nothing overlaps before anything moves.

    Args:
        problem, calibration: what is asked. setting: returns what sets are judged in.
        in_full: solves it with all alternatives and reasons. clock: of the solve.
    """
    if not is_built_in(calibration.criteria):
        return None
    made = planned(problem)
    packed = packed_problem(problem, made, calibration)
    clock.lap("plan")
    if packed is None:
        return None
    answer = solve_pose(packed, problem.T_palm_object[:3])
    clock.lap("close")
    status = STATUSES[int(answer.solved.status[0])]
    certified = bool(answer.solved.certified[0])
    # Why something is blocked, or not promised, takes more to say than these numbers.
    if status is SolutionStatus.BLOCKED or answer.blocked or certified != packed.wanted.whole:
        return None
    command, stages = problem.command, clock.stages()
    return GraspSolution.deferred(
        once(_Direct(problem, calibration, setting, made, packed.wanted.whole, answer, in_full, stages).solution),
        status=status,
        joint_angles=dict(zip(problem.hand.joint_names, answer.solved.angles[0].tolist(), strict=True)),
        certified=certified,
        hand_pose=problem.T_world_palm,
        object_pose=problem.T_world_object,
        joint_limits=joint_limits(problem.hand),
        timing=stages,
        quality=None,
        squeeze=None,
        pregrasp=None,
        speeds=dict(command.speeds),
        rounds=command.rounds,
        next_steps=plain_steps(command),
    )


@dataclass(frozen=True, eq=False)
class _Direct:
    """A builder that makes a solution from the kernels' answer."""

    problem: Problem
    calibration: Calibration
    setting: Callable[[], Setting]
    complete: Planned
    whole: bool
    answer: PoseAnswer
    in_full: Callable[[], Answer]
    stages: Mapping[str, float]

    def solution(self) -> GraspSolution:
        """Return the whole solution, but for what is made when that is read."""
        return assemble(self._answer(), self.problem, self.stages)

    def _answer(self) -> Answer:
        problem, complete = self.problem, self.complete
        made = (complete.full_width if self.whole else None) or complete
        items, sets = self.answer.solved.chosen[0].tolist(), self._sets(made)
        best, final = [sets[i] for i in items], self.answer.solved.angles[0]
        score_sets(best, self.calibration.criteria, self.setting())
        promise = promised(problem) if self.whole else None
        at_start, at_end, certificate = judge(problem, best, final, made.exact, promise)
        if self.whole:
            full, chosen = once(self.in_full), complete.plane_counts
            found, choice = (lambda k: full().sets(k)), DeferredMapping(lambda: full().choice)
        else:
            close = partial(group_by_finger, made.plan, sets)
            alternatives = Alternatives(problem, self.calibration, self.setting(), close)
            found, choice = alternatives.of_finger, DeferredMapping(partial(alternatives.explained, best, []))
            chosen = made.plan.items.low[items].tolist()
        return Answer(found, chosen, best, final, at_start, at_end, certificate, choice)

    def _sets(self, made: Planned) -> list[FingerCandidate]:
        """Return the sets that were closed; those that the other fingers made close again were never judged alone."""
        p, nowhere = self.problem, [None] * len(made.plan.plans)
        sets = read_candidates(p.hand, made.plan, p.packed, self.answer.closed, p.T_palm_object, nowhere)
        judge_sets(p.hand, sets, p.packed, p.T_palm_object, p.source, measure=False)
        for i in np.flatnonzero(self.answer.anew):
            sets[i].feasible = sets[i].penetration = None
        return sets
