"""The posture that clench chooses: the hand closes from its preshapes at every pose (docs/preshapes.md).

The order of precedence is: the better status, the certificate, force closure, the limits of the calibration, the
weighted sum of the criteria. Motion counts from the open hand and includes posture joints. Among equal closings, the
posture nearest to the open hand wins.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.closing.motion import open_posture
from clench.core.caching.deferring import DeferredMapping
from clench.core.pose import FloatArray
from clench.core.pose_arrays import pose_of_row
from clench.core.threads import core_count, share_out
from clench.models.command import GraspCommand
from clench.scoring.calibration import calibration_of
from clench.scoring.explaining import say_what_decided
from clench.solver.batch.batch_solver import BatchSolver
from clench.solver.batch.devices import CPU
from clench.solver.batch.grasp_batch import GraspBatch, Question, append_part
from clench.solver.pose_solver import solve_posture
from clench.solver.solution import GraspSolution

from .posture_scores import BEST_FIRST, PostureScorer, Scores
from .postures import PostureOption, distance_from_open, posture_options

if TYPE_CHECKING:
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

#: Sums that differ by less are equal [-].
_SAME: Final = 1e-9


def posture_solver(hand: Hand, obj: GraspObject, command: GraspCommand) -> BatchSolver | PostureSolver:
    """Return a solver of a command at many poses: with one posture, or with the best posture at every pose.

    Raises:
        ClenchError: see `clench.solve`.
    """
    options = posture_options(hand, command)
    return PostureSolver(hand, obj, command, options) if options else BatchSolver(hand, obj, command)


def first_choice(hand: Hand, obj: GraspObject, command: GraspCommand) -> GraspCommand:
    """Return a command with the posture that clench chooses at its pose, or the same command if it leaves no choice.

    Raises:
        ClenchError: see `clench.solve`.
    """
    options = posture_options(hand, command)
    if not options:
        return command
    chosen, _ = PostureSolver(hand, obj, command, options).choose_one()
    return replace(command, preshape=chosen.angles)


def with_posture(solution: GraspSolution, said: Mapping[str, Any], seconds: float) -> GraspSolution:
    """Return a solution whose `choice` gives the reason for the posture, and the time of its choice [s]."""
    choice, timing = solution.choice, dict(solution.timing)
    timing["total"] = timing.get("total", 0.0) + seconds
    # Several mappings: a reader of the reason for the posture does not wait for the reasons for the candidates.
    parts: list[Any] = [{"preshapes": said}]
    if choice is not None:
        parts += [DeferredMapping(lambda: {"text": f"{said['text']} {choice['text']}"}), choice]
    return solution.with_known(
        choice=ChainMap(*parts),
        timing={"posture": seconds, **timing},
    )


def with_reason(
    solution: GraspSolution, hand: Hand, obj: GraspObject, command: GraspCommand, options: tuple[PostureOption, ...]
) -> GraspSolution:
    """Return a solution of a batch whose `choice` gives the reason for the posture, found when it is first read.

    Args:
        solution: from the best of the options at its pose. hand, obj, command, options: see `PostureSolver`.
    """
    there = command.at(solution.hand_pose, solution.object_pose)

    def reason() -> Mapping[str, Any]:
        return PostureSolver(hand, obj, there, options).choose_one()[1]

    return with_posture(solution, DeferredMapping(reason), 0.0)


class PostureSolver:
    """A solver for one command at many poses, from the best of several postures at each.

    Args:
        hand, obj, command: as for `clench.solve`. options: postures, see `posture_options`.

    Raises:
        ClenchError: see `clench.solve`.
    """

    def __init__(self, hand: Hand, obj: GraspObject, command: GraspCommand, options: tuple[PostureOption, ...]) -> None:
        self._hand, self._obj, self._command, self.options = hand, obj, command, options
        self._solvers = [BatchSolver(hand, obj, replace(command, preshape=o.angles)) for o in options]
        self._calibration = calibration_of(command.criteria)
        first = self._solvers[0]
        opened = open_posture(hand, replace(command, preshape=options[0].angles))
        self._scorer = PostureScorer(hand, obj, tuple(first.moving), opened, self._calibration)
        self._away = np.array([distance_from_open(hand, option, options[0]) for option in options])

    @cached_property
    def names(self) -> dict[str, Any]:
        """The fields of a batch that are the same for all poses."""
        return {**self._solvers[0].names, "question": Question(self._hand, self._obj, self._command, {}, self.options)}

    def solve(
        self, hand_rows: FloatArray, object_rows: FloatArray | None, threads: int, device: str = CPU
    ) -> GraspBatch:
        """Return the answers, each from the posture that is best at its pose; see `BatchSolver.solve`."""
        solved = list[GraspBatch]()
        for solver in self._solvers:
            append_part(solved, solver.solve(hand_rows, object_rows, threads, device))
        answers = GraspBatch.joined(solved)
        _, order = self._compare(answers)
        best = answers[order[:, 0] * len(hand_rows) + np.arange(len(hand_rows))]
        return best.with_known(question=self.names["question"], preshape_codes=order[:, 0].astype(np.int16))

    def choose_one(self) -> tuple[PostureOption, Mapping[str, Any]]:
        """Return the best posture at the pose of the command, and the comparison as plain values."""
        row, answers = np.array([self._command.hand_pose.wxyz_xyz]), dict[int, GraspBatch]()

        def run(k: int) -> None:
            answers[k] = self._solvers[k].solve(row, None, 1)

        share_out(run, range(len(self._solvers)), core_count())
        scores, order = self._compare(GraspBatch.joined([answers[k] for k in range(len(self._solvers))]))
        ranked = order[0].tolist()
        return self.options[ranked[0]], DeferredMapping(lambda: self._explain(scores, ranked))

    def _compare(self, answers: GraspBatch) -> tuple[Scores, NDArray[np.intp]]:
        """Return the scores, and the numbers of the postures at every pose, best first, shape (N, K).

        Args:
            answers: from one posture after another, at all poses.
        """
        count = len(self.options)
        poses = len(answers) // count

        def solve(n: int, k: int) -> GraspSolution:
            row, there = answers.hand_poses[k * poses + n], answers.object_poses[k * poses + n]
            asked = replace(self._command, preshape=self.options[k].angles)
            return solve_posture(self._hand, self._obj, asked.at(pose_of_row(row), pose_of_row(there)))

        scores = self._scorer.score(answers, count, solve)
        steps = np.floor(scores.total / _SAME + 0.5)
        known = (~np.isnan(scores.values)).sum(axis=2)
        away = np.broadcast_to(self._away, steps.shape)
        open_grasps = scores.epsilon <= 0.0
        keys = (away, -steps, -known, ~scores.inside, open_grasps, ~scores.certified, scores.place)
        order = np.lexsort(keys, axis=-1)
        return scores, order

    def _explain(self, scores: Scores, ranked: list[int]) -> dict[str, Any]:
        return {
            "chosen": self.options[ranked[0]].name,
            "runner_up": self.options[ranked[1]].name,
            "text": self._text(scores, ranked[0], ranked[1]),
            "angles": dict(self.options[ranked[0]].angles),
            "compared": {option.name: self._described(scores, k) for k, option in enumerate(self.options)},
        }

    def _described(self, scores: Scores, k: int) -> dict[str, Any]:
        return {
            "status": BEST_FIRST[int(scores.place[0, k])].value,
            "certified": bool(scores.certified[0, k]),
            "epsilon_bound": float(scores.epsilon[0, k]),
            "inside": bool(scores.inside[0, k]),
            "scores": self._values(scores, k),
            "total": float(scores.total[0, k]),
            "away": float(self._away[k]),
        }

    def _values(self, scores: Scores, k: int) -> dict[str, float]:
        named = zip(self._calibration.criteria, scores.values[0, k].tolist(), strict=True)
        return {name: value for name, value in named if not np.isnan(value)}

    def _text(self, scores: Scores, best: int, second: int) -> str:
        """Return the sentence that says why a posture won."""
        ours, theirs = self.options[best].name, self.options[second].name
        statuses = [BEST_FIRST[int(scores.place[0, k])].value for k in (best, second)]
        before = f"{ours} comes before {theirs}"
        if statuses[0] != statuses[1]:
            return f"{before} because it ends as {statuses[0]}, and {theirs} as {statuses[1]}."
        rules = (
            ("is certified", scores.certified),
            ("resists every wrench", scores.epsilon > 0.0),
            ("is inside the limits", scores.inside),
        )
        for what, values in rules:
            if values[0, best] != values[0, second]:
                return f"{before} because it alone {what}."
        a, b = self._values(scores, best), self._values(scores, second)
        if len(a) != len(b):
            return f"{before} because more criteria have a value."
        lead = float(scores.total[0, best] - scores.total[0, second])
        if lead < _SAME:
            return (
                f"{ours} and {theirs} both end as {statuses[0]} and score the same; {ours} is nearer to the open hand."
            )
        gains = {n: self._calibration.worth(n, a[n]) - self._calibration.worth(n, b[n]) for n in a if n in b}
        return f"{ours} leads {theirs} by {lead:.3g}; {say_what_decided(gains, a, b)}"
