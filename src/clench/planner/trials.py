"""Close the hand at proposals, and classify the result of each (docs/method.md section 9)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray, Pose, invert, quaternions_from_rotations
from clench.core.threads import share_out
from clench.mechanics.grasp.contact_kinds import KINDS, GraspKind, contact_kinds
from clench.mechanics.grasp.contacts import ContactModel
from clench.models.command import GraspCommand
from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mass import mass_properties
from clench.solver.batch.batch_epsilon import HOLDS, BatchEpsilon
from clench.solver.batch.batch_solver import BatchSolver
from clench.solver.batch.grasp_batch import FINGER_STATUSES, STATUSES, GraspBatch
from clench.solver.preshapes.preshapes import Preshape
from clench.solver.solution import FingerStatus, SolutionStatus

from .options import PlanOptions
from .proposals import Arm, Proposals, vary
from .rejections import Fallen, Rejection

#: The score is a mean of bounds at these shares of the lowest friction, so that a margin in it counts [-].
FRICTION_SHARES = (0.5, 1.0)
#: Proposals that a thread closes at once.
AT_ONCE = 32
#: Displacements of the object for which a grasp is closed again.
DISPLACEMENTS = 16
_BLOCKED = STATUSES.index(SolutionStatus.BLOCKED)
_LIMIT = FINGER_STATUSES.index(FingerStatus.LIMIT)

#: Proposals that fall, by reason.
Falls = list[tuple[Rejection, Proposals]]


@dataclass(frozen=True, eq=False)
class Trial:
    """A closed proposal that may be a grasp.

    Args:
        number: of the proposal, from 0. arm: its arm. T_object_palm: where the palm is, shape (4, 4).
        score: mean of bounds of epsilon, see `FRICTION_SHARES`. kind: of the grasp.
        links: places of the links in the object's frame [m], shape (L, 3).
    """

    number: int
    arm: Arm
    T_object_palm: FloatArray
    score: float
    kind: GraspKind
    links: FloatArray


@dataclass(eq=False)
class Closer:
    """Close the hand at proposals; hand and object are planned once per preshape.

    Args:
        hand, obj: hand and object. asked: the options. arms, shapes: of the proposals. threads: how many are used.
    """

    hand: Hand
    obj: GraspObject
    asked: PlanOptions
    arms: tuple[Arm, ...]
    shapes: tuple[Preshape, ...]
    threads: int
    solvers: dict[int, BatchSolver] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Look up the data that every grasp needs."""
        torsion = self.asked.torsion if self.asked.model is ContactModel.SOFT else None
        self._epsilon = BatchEpsilon(self.hand, self.obj, self.asked.lowest_friction, torsion)
        self._center = mass_properties(self.obj).center
        self._solid = [*self.hand.solid_links]

    def command(self, arm: Arm) -> GraspCommand:
        """Return the command of an arm, without a particular pose."""
        names = tuple(f.name for f in self.hand.fingers)
        fingers = None if arm.fingers == names else arm.fingers
        # One plane, because the full width has the answer and no plane is closed.
        angles = self.shapes[arm.shape].angles
        return GraspCommand(hand_pose=Pose.identity(), preshape=angles, fingers=fingers, planes=1)

    def close(self, proposals: Proposals, first: int, rejected: Fallen) -> tuple[list[Trial], FloatArray]:
        """Close at proposals; return those that may be grasps, and a score of every proposal, 0 for no use, (N,).

        Args:
            proposals: the proposals. first: number of the first of them. rejected: counts of reasons, which is changed.
        """
        shapes = np.array([arm.shape for arm in self.arms])[proposals.arm]
        parts = list[NDArray[np.intp]]()
        for shape in np.unique(shapes):
            rows = np.flatnonzero(shapes == shape)
            self._prepare(self.arms[proposals.arm[rows[0]]])
            parts += np.array_split(rows, -(-len(rows) // AT_ONCE))
        found: list[tuple[list[Trial], Falls]] = [([], [])] * len(parts)

        def run(k: int) -> None:
            some = proposals.taken(parts[k])
            found[k] = self._tried(self.solve(self.arms[some.arm[0]], some.T_object_palm), some, first + parts[k])

        share_out(run, range(len(parts)), self.threads)
        trials = sorted((trial for part, _ in found for trial in part), key=lambda trial: trial.number)
        for reason, fallen in (fall for _, falls in found for fall in falls):
            rejected.fall(reason, fallen)
        scores = np.zeros(len(proposals))
        scores[[trial.number - first for trial in trials]] = [trial.score for trial in trials]
        return trials, scores

    def _prepare(self, arm: Arm) -> None:
        """Plan the hand at the preshape of an arm, once."""
        if arm.shape not in self.solvers:
            self.solvers[arm.shape] = BatchSolver(self.hand, self.obj, self.command(arm))

    def solve(self, arm: Arm, T_object_palm: FloatArray) -> GraspBatch:
        """Return the answers of one arm at places of the palm, shape (N, 4, 4), solved in the calling thread."""
        self._prepare(arm)
        T = self.obj.pose.matrix @ T_object_palm
        rows = np.concatenate([quaternions_from_rotations(T[:, :3, :3]), T[:, :3, 3]], axis=1)
        return self.solvers[arm.shape].solve(rows, None, 1)

    def displaced_score(self, trial: Trial, sigma: tuple[float, float]) -> float:
        """Return the mean score of a trial when the object is displaced at random, 0 where no grasp is left [N/N].

        The hand keeps its pose and closes until it touches. The same trial gets the same draws.

        Args:
            trial: the trial. sigma: standard deviations of the object's position [m] and of its rotation [rad].
        """
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((self.asked.seed, 1, trial.number))))
        T = np.repeat(invert(trial.T_object_palm)[None], DISPLACEMENTS, axis=0)
        center = np.repeat(self._center[None], DISPLACEMENTS, axis=0)
        moved = vary(rng, T, center, sigma[1], sigma[0])
        placed = np.array([invert(T) for T in moved])
        return float(self.bounds(self.solve(trial.arm, placed))[0].mean())

    def bounds(self, batch: GraspBatch) -> tuple[FloatArray, FloatArray]:
        """Return score and bound of every answer [N/N], shape (N,) each; 0 for anything but a grasp."""
        found = [self._epsilon.bounds(batch, share) for share in FRICTION_SHARES]
        return np.mean(found, axis=0), found[-1]

    def _tried(self, batch: GraspBatch, proposals: Proposals, numbers: NDArray[np.intp]) -> tuple[list[Trial], Falls]:
        """Return the trials of a batch, and the proposals that fall for each reason."""
        score, bound = self.bounds(batch)
        kinds = contact_kinds(self.hand, batch.contacts.first, batch.contacts.link, self._epsilon.counted(batch)[1])
        requested = [KINDS.index(GraspKind(kind)) for kind in self.asked.kinds or GraspKind]
        touching = self._touching(batch)
        thumbs = [k for k, f in enumerate(batch.finger_names) if self.hand.finger(f).is_thumb]
        at_limit = (batch.finger_codes[:, thumbs] == _LIMIT).any(axis=1)
        in_region, holds = self._in_regions(batch), np.isin(batch.status_codes, HOLDS)
        checks = (
            (batch.status_codes == _BLOCKED, Rejection.OVERLAPS),
            (~holds & at_limit, Rejection.THUMB_LIMIT),
            (~holds | (touching < self.asked.min_fingers), Rejection.NO_GRASP),
            (~batch.certified, Rejection.NOT_CERTIFIED),
            (~np.isin(kinds, requested), Rejection.OTHER_KIND),
            (~in_region, Rejection.REGION),
            (bound <= 0.0, Rejection.NO_CLOSURE),
        )
        left, fallen = np.ones(len(batch), dtype=np.bool_), list[tuple[Rejection, Proposals]]()
        for falls, reason in checks:
            fallen.append((reason, proposals.taken(left & falls)))
            left &= ~falls
        rows, T = np.flatnonzero(left), proposals.T_object_palm
        places = self._places(batch.joint_angles[rows], T[rows])
        trials = [
            Trial(int(numbers[n]), self.arms[proposals.arm[n]], T[n], float(score[n]), KINDS[kinds[n]], links)
            for n, links in zip(rows.tolist(), places, strict=True)
        ]
        return trials, fallen

    def _touching(self, batch: GraspBatch) -> NDArray[np.int64]:
        """Return how many fingers touch the object in every answer, (N,)."""
        owner, keep = self._epsilon.counted(batch)
        touched = np.zeros((len(batch), len(batch.finger_names)), dtype=np.bool_)
        touched[owner[keep], batch.contacts.finger[keep]] = True
        count: NDArray[np.int64] = touched.sum(axis=1)
        return count

    def _in_regions(self, batch: GraspBatch) -> NDArray[np.bool_]:
        inside = np.ones(len(batch), dtype=np.bool_)
        contacts = batch.contacts
        if self.asked.touch is None and self.asked.avoid is None:
            return inside
        owner = np.repeat(np.arange(len(batch)), np.diff(contacts.first))
        points = self.obj.pose.inverse().apply(contacts.position) if len(contacts) else np.empty((0, 3))
        wrong = np.zeros(len(contacts), dtype=np.bool_)
        if self.asked.touch is not None:
            wrong |= ~self.asked.touch.contains(points)
        if self.asked.avoid is not None:
            wrong |= self.asked.avoid.contains(points)
        inside[owner[wrong & self._epsilon.graspable[contacts.body]]] = False
        return inside

    def _places(self, q: FloatArray, T_object_palm: FloatArray) -> FloatArray:
        """Return the places of the links that can touch, in the object's frame [m], shape (N, L, 3)."""
        if not len(q):
            return np.empty((0, len(self._solid), 3))
        placed: FloatArray = (T_object_palm[:, None] @ poses_at(self.hand, q)[:, self._solid])[..., :3, 3]
        return placed
