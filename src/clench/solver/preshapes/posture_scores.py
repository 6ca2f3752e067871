"""Score the closings from several postures, pose by pose, for the choice among them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.scoring.calibration import Calibration
from clench.scoring.criterion_registry import ALWAYS, find_criterion, is_of_hand
from clench.solver.batch.batch_epsilon import BatchEpsilon
from clench.solver.batch.grasp_batch import STATUSES, GraspBatch
from clench.solver.solution import GraspSolution, SolutionStatus, solve_scores

#: Statuses, best first.
BEST_FIRST: Final = (
    SolutionStatus.GRASP,
    SolutionStatus.PARTIAL,
    SolutionStatus.NO_CONTACT,
    SolutionStatus.BLOCKED,
)
_PLACE: Final = np.array([BEST_FIRST.index(status) for status in STATUSES])
#: Statuses whose scores mean something.
_TOUCHING: Final = 2


class Scores(NamedTuple):
    """The comparison of K closings at N poses, for the choice among them; P criteria that count.

    Args:
        place: of the status, 0 for a grasp, shape (N, K). certified, inside: whether the certificate holds, and whether
            all values are inside the limits, (N, K). epsilon: lower bound of the epsilon quality [N/N], (N, K).
        values: of the criteria, NaN where nothing is said, (N, K, P).
        total: weighted sum [-], (N, K).
    """

    place: NDArray[np.int64]
    certified: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    epsilon: FloatArray
    values: FloatArray
    total: FloatArray


@dataclass(frozen=True, eq=False)
class PostureScorer:
    """Score closings by a calibration.

    Args:
        hand, obj: as solved. fingers: the closing ones. opened: posture from which all motion counts, (J,) [rad].
        calibration: weights and limits.
    """

    hand: Hand
    obj: GraspObject
    fingers: tuple[Finger, ...]
    opened: FloatArray
    calibration: Calibration

    def score(self, answers: GraspBatch, count: int, solve: Callable[[int, int], GraspSolution]) -> Scores:
        """Return the scores of closings of the same poses.

        The criteria that always count are read from the arrays. Any other one takes a whole solution of every closing
        that is as good as the best by status and certificate.

        Args:
            answers: K closings of all N poses one after another, K·N in all. count: K.
            solve: returns the solution of a pose and a closing, by their numbers.
        """
        names = self.calibration.criteria
        shape = (count, len(answers) // count)
        place = _PLACE[answers.status_codes].reshape(shape).T
        certified = answers.certified.reshape(shape).T
        within = np.ones(len(answers), dtype=np.bool_)
        columns = np.full((len(answers), len(names)), np.nan)
        measured = self._measure(answers)
        for p, name in enumerate(names):
            if name in ALWAYS:
                of_fingers = measured[ALWAYS.index(name)]
                columns[:, p] = of_fingers.sum(axis=1)
                within &= self.calibration.inside(name, of_fingers).all(axis=1)
        inside, values = within.reshape(shape).T.copy(), columns.reshape(*shape, len(names)).transpose(1, 0, 2)
        others = [p for p, name in enumerate(names) if name not in ALWAYS]
        if others:
            rank = 2 * place + ~certified
            for n, k in np.argwhere((rank == rank.min(axis=1, keepdims=True)) & (place < _TOUCHING)).tolist():
                solution = solve(n, k)
                scores = solve_scores(solution)
                for p in others:
                    values[n, k, p] = scores.get(names[p], np.nan)
                    inside[n, k] &= self._inside(names[p], solution)
        total = np.zeros(place.shape)
        for p, name in enumerate(names):
            total += self.calibration.worth(name, 1.0) * np.nan_to_num(values[:, :, p])
        idle = place >= _TOUCHING
        epsilon = self._epsilon.bounds(answers).reshape(shape).T
        return Scores(place, certified, inside | idle, epsilon, values, np.where(idle, 0.0, total))

    def _measure(self, answers: GraspBatch) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return range of motion [rad], touching links and limit distance of every finger, (N, F) each, as `ALWAYS`."""
        q = answers.joint_angles
        weight, end, span = self._joints
        motion: FloatArray = (np.abs(q - self.opened)[:, None] * weight).sum(axis=2)
        left: FloatArray = (np.abs(end - q[:, None]) / span).min(axis=2, initial=1.0)
        return motion, self._touching(answers), left

    @cached_property
    def _epsilon(self) -> BatchEpsilon:
        return BatchEpsilon(self.hand, self.obj)

    @cached_property
    def _joints(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weight, limit in the closing direction [rad] and range [rad] of every finger's joints, (F, J) each.

        A joint of another finger, or without a range, has no weight and no near limit.
        """
        shape = (len(self.fingers), len(self.hand.joints))
        weight, end, span = np.zeros(shape), np.full(shape, np.inf), np.ones(shape)
        for f, finger in enumerate(self.fingers):
            for j in finger.joints:
                joint = self.hand.joints[j]
                weight[f, j] = self.calibration.joints.get(joint.name, 1.0)
                if joint.role is JointRole.CLOSING and joint.upper > joint.lower:
                    end[f, j] = joint.upper if joint.direction > 0 else joint.lower
                    span[f, j] = joint.upper - joint.lower
        return weight, end, span

    def _touching(self, answers: GraspBatch) -> FloatArray:
        """Return how many links of every finger touch the object, shape (N, F)."""
        contacts = answers.contacts
        graspable = np.array([body.role is BodyRole.GRASPABLE for body in self.obj.bodies])
        owner = np.repeat(np.arange(len(answers)), np.diff(contacts.first))
        keep = ~contacts.passed & graspable[contacts.body]
        links = len(self.hand.links)
        place = owner[keep] * len(self.fingers) + contacts.finger[keep]
        different = np.unique(place * links + contacts.link[keep]) // links
        shape = (len(answers), len(self.fingers))
        return np.bincount(different, minlength=shape[0] * shape[1]).astype(np.float64).reshape(shape)

    def _inside(self, name: str, solution: GraspSolution) -> bool:
        """Say whether all values of a criterion are inside its limit; an unknown value is not."""
        if is_of_hand(find_criterion(name, self.calibration.name)):
            values = [(solution.choice or {}).get("final_hand_scores", {}).get(name)]
        else:
            values = [f.best.scores.get(name) for f in solution.fingers.values() if f.best is not None]
        return all(self.calibration.allows(name, value) for value in values)
