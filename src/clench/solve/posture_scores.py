"""Score the closings from several postures, pose by pose, for the choice among them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray
from clench.grasp.calibration import Calibration
from clench.grasp.criterion_registry import ALWAYS, find_criterion, is_of_hand
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.objects.grasp_object import BodyRole, GraspObject

from .examples import solve_scores
from .grasp_batch import STATUSES, GraspBatch
from .solution import GraspSolution, SolutionStatus

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
    """Hold how K closings compare at N poses; P criteria that count.

    Args:
        place: of the status, 0 for a grasp, shape (N, K). certified, inside: whether the certificate holds, and whether
            all values are inside the limits, (N, K). values: of the criteria, NaN where nothing is said, (N, K, P).
        total: weighted sum [-], (N, K).
    """

    place: NDArray[np.int64]
    certified: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    values: FloatArray
    total: FloatArray


@dataclass(frozen=True, eq=False)
class PostureScorer:
    """Score closings by a calibration.

    Args:
        hand, obj: as solved. fingers: those that close. opened: posture from which all motion counts, (J,) [rad].
        calibration: what counts.
    """

    hand: Hand
    obj: GraspObject
    fingers: tuple[Finger, ...]
    opened: FloatArray
    calibration: Calibration

    def score(self, answers: list[GraspBatch], solve: Callable[[int, int], GraspSolution]) -> Scores:
        """Return the scores of closings of the same poses.

        The criteria that always count are read from the arrays. Any other one takes a whole solution of every closing
        that is as good as the best by status and certificate.

        Args:
            answers: by closing. solve: returns the solution of a pose and a closing, by their numbers.
        """
        names = self.calibration.criteria
        place = np.stack([_PLACE[answer.status_codes] for answer in answers], axis=1)
        certified = np.stack([answer.certified for answer in answers], axis=1)
        inside = np.ones(place.shape, dtype=np.bool_)
        values = np.full((*place.shape, len(names)), np.nan)
        for k, answer in enumerate(answers):
            measured = self._measure(answer)
            for p, name in enumerate(names):
                if name in ALWAYS:
                    of_fingers = measured[ALWAYS.index(name)]
                    values[:, k, p] = of_fingers.sum(axis=1)
                    inside[:, k] &= self.calibration.inside(name, of_fingers).all(axis=1)
        others = [p for p, name in enumerate(names) if name not in ALWAYS]
        if others:
            rank = 2 * place + ~certified
            for n, k in np.argwhere((rank == rank.min(axis=1, keepdims=True)) & (place < _TOUCHING)).tolist():
                solution = solve(n, k)
                scores = solve_scores(solution)
                for p in others:
                    values[n, k, p] = scores.get(names[p], np.nan)
                    inside[n, k] &= self._inside(names[p], solution)
        worth = np.array([self.calibration.worth(name, 1.0) for name in names])
        counted = np.where(np.isnan(values), 0.0, values)
        total = np.zeros(place.shape)
        for p in range(len(names)):
            total += worth[p] * counted[:, :, p]
        idle = place >= _TOUCHING
        return Scores(place, certified, inside | idle, values, np.where(idle, 0.0, total))

    def _measure(self, answer: GraspBatch) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return range of motion [rad], touching links and limit distance of every finger, (N, F) each, as `ALWAYS`."""
        count, q = (len(answer), len(self.fingers)), answer.joint_angles
        motion, left = np.zeros(count), np.ones(count)
        for f, finger in enumerate(self.fingers):
            for j in finger.joints:
                joint = self.hand.joints[j]
                motion[:, f] += self.calibration.joints.get(joint.name, 1.0) * np.abs(q[:, j] - self.opened[j])
                span = joint.upper - joint.lower
                if joint.role is JointRole.CLOSING and span > 0.0:
                    end = joint.upper if joint.direction > 0 else joint.lower
                    left[:, f] = np.minimum(left[:, f], np.abs(end - q[:, j]) / span)
        return motion, self._touching(answer), left

    def _touching(self, answer: GraspBatch) -> FloatArray:
        """Return how many links of every finger touch the object, shape (N, F)."""
        contacts = answer.contacts
        graspable = np.array([body.role is BodyRole.GRASPABLE for body in self.obj.bodies])
        owner = np.repeat(np.arange(len(answer)), np.diff(contacts.first))
        keep = ~contacts.passed & graspable[contacts.body]
        rows = np.stack([owner[keep], contacts.finger[keep], contacts.link[keep]], axis=1).reshape(-1, 3)
        different = np.unique(rows, axis=0)
        touching = np.zeros((len(answer), len(self.fingers)))
        np.add.at(touching, (different[:, 0], different[:, 1]), 1.0)
        return touching

    def _inside(self, name: str, solution: GraspSolution) -> bool:
        """Say whether all values of a criterion are inside its limit; one that is not known is not."""
        if is_of_hand(find_criterion(name, self.calibration.name)):
            values = [(solution.choice or {}).get("final_hand_scores", {}).get(name)]
        else:
            values = [f.best.scores.get(name) for f in solution.fingers.values() if f.best is not None]
        return all(self.calibration.allows(name, value) for value in values)
