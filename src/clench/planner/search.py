"""Search for grasps in rounds: propose, bring up, close, keep the best, finish the returned ones."""

from __future__ import annotations

import time
from bisect import insort
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from clench.closing.collision.packed_object import pack_object
from clench.closing.motion import open_posture
from clench.core.defaults import FRICTION
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.core.showing.short_repr import described
from clench.core.threads import core_count
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.preshapes import Preshape, opposition_zones

from .approach_check import Approach
from .finishing import Finisher
from .grasp_plan import GraspPlan, PlannedGrasp, RejectedProposal, UnfinishedGrasp
from .options import PlanOptions, is_reached
from .pairs import opposing_pairs
from .proposals import Arm, Proposals, Proposer
from .rejections import Fallen, Rejection
from .trials import Closer, Trial

#: Proposals of the first round, and of a round at most; every round has twice as many as the one before.
FIRST_ROUND = 64
LARGEST_ROUND = 256
#: The search ends when this many grasps in a row have no squeeze or no path: for example, the object is too heavy.
FRUITLESS = 100
#: A grasp is lost when displacements of the object leave less than this part of its score [-].
LEFT = 0.2


@dataclass(eq=False, repr=False)
class GraspSearch:
    """A search for grasps: iterate over it to get them as they are found, or ask for its `plan`.

    Args:
        hand: the hand. obj: the object, with obstacles as other bodies. asked: the options.

    Raises:
        ClenchError: see `clench.plan_grasps`.
    """

    hand: Hand
    obj: GraspObject
    asked: PlanOptions
    rejected: Fallen = field(default_factory=Fallen)
    proposed: int = 0
    closed: int = 0
    force_closed: int = 0
    times: dict[str, float] = field(default_factory=lambda: defaultdict(float))

    def __post_init__(self) -> None:
        """Find the zones of the hand and the pairs of the object, or say that there are none."""
        began = time.perf_counter()
        self.threads = self.asked.threads or core_count()
        packed = pack_object(self.obj)
        self.shapes, self.arms = _ways(self.hand, self.asked)
        self._widest = max(float(s.aperture.max(initial=0.0)) for s in self.shapes)
        friction = self.asked.lowest_friction or FRICTION
        pairs = opposing_pairs(self.obj, packed, friction, self._widest, self.asked.touch, self.asked.avoid)
        self._proposer = Proposer(self.arms, self.shapes, pairs)
        commands = (GraspCommand(Pose.identity(), preshape=shape.angles) for shape in self.shapes)
        postures = np.array([open_posture(self.hand, command) for command in commands])
        self._approach = Approach(self.hand, postures, packed)
        self._closer = Closer(self.hand, self.obj, self.asked, self.arms, self.shapes, self.threads)
        self._finisher = Finisher(self.hand, self.obj, self.asked, self._closer)
        self._waiting: list[Trial] = []
        self.found: list[PlannedGrasp] = []
        self._places: list[FloatArray] = []
        self._displaced: set[int] = set()
        self._rounds = 0
        self._fruitless = 0
        self.times["preparing"] += time.perf_counter() - began
        self._began = began

    def __iter__(self) -> Iterator[PlannedGrasp]:
        """Yield grasps as they are found, at most as many as are wanted; a search that was left goes on."""
        yield from self._finish(self._due())
        while len(self.found) < self.asked.count and not self._is_over() and not self._proposer.is_hopeless:
            rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((self.asked.seed, self._rounds))))
            size = min(FIRST_ROUND << self._rounds, LARGEST_ROUND)
            self._rounds += 1
            self._round(rng, min(size, self.asked.proposals - self.proposed))
            yield from self._finish(self._due())
        yield from self._finish(self.asked.count)

    def _due(self) -> int:
        """Return how many grasps are due: the best one of every `effort` proposals, so that it is among the best."""
        if self.proposed >= self.asked.proposals:
            return self.asked.count
        return min(-(-self.proposed // self.asked.effort), self.asked.count)

    def __repr__(self) -> str:
        progress = f"{len(self.found)} of {self.asked.count} grasps, {self.proposed} proposals"
        return described(self, hand=self.hand.name, object=self.obj.name, progress=progress)

    def tell_unfinished(self, tell: Callable[[UnfinishedGrasp], None]) -> None:
        """Call a function from now on with every grasp that lacks a squeeze or a path, which the plan leaves out."""
        self._finisher.tell = tell

    def tell_rejected(self, tell: Callable[[RejectedProposal], None]) -> None:
        """Call a function from now on with every proposal that comes to nothing before it is a grasp."""

        def describe(reason: Rejection, proposals: Proposals) -> None:
            for number, T_object_palm in zip(proposals.arm.tolist(), proposals.T_object_palm, strict=True):
                shape = self.shapes[self.arms[number].shape]
                tell(RejectedProposal(Pose.from_matrix(T_object_palm), shape.name, shape.angles, reason))

        self.rejected.tell = describe

    def plan(self) -> GraspPlan:
        """Return the grasps found so far, best first."""
        return GraspPlan(
            hand=self.hand.name,
            object=self.obj.name,
            grasps=tuple(sorted(self.found, key=lambda grasp: grasp.rank)),
            asked=self.asked,
            proposed=self.proposed,
            closed=self.closed,
            force_closed=self.force_closed,
            rejected={reason.value: self.rejected[reason] for reason in Rejection},
            waiting=len(self._waiting),
            late=self._is_late() and not self._proposer.is_hopeless,
            widest=self._widest,
            times=dict(self.times),
        )

    def _is_over(self) -> bool:
        return self._is_late() or self.proposed >= self.asked.proposals or self._fruitless >= FRUITLESS

    def _is_late(self) -> bool:
        """Say whether the time is over; one round is always gone through."""
        taken = time.perf_counter() - self._began
        return self.asked.seconds is not None and self._rounds > 0 and taken > self.asked.seconds

    def _round(self, rng: np.random.Generator, count: int) -> None:
        """Propose, bring up and close; good ones wait."""
        marks = [time.perf_counter()]
        proposals = self._allowed(self._proposer.draw(rng, count))
        first, self.proposed = self.proposed, self.proposed + count
        marks.append(time.perf_counter())
        came = self._approach.bring_up(proposals, self.arms, self.threads)
        self.rejected.fall(Rejection.STOPPED, came.stopped)
        self.rejected.fall(Rejection.OBSTACLE, came.obstacle)
        arrived = self._reached(came.proposals)
        marks.append(time.perf_counter())
        trials, scores = self._closer.close(arrived, first, self.rejected)
        marks.append(time.perf_counter())
        self.closed += len(arrived)
        self.force_closed += len(trials)
        self._proposer.learn(arrived, scores)
        self._waiting += trials
        self._waiting.sort(key=_rank)
        for key, (begin, end) in zip(("proposing", "approaching", "closing"), pairwise(marks), strict=True):
            self.times[key] += end - begin

    def _allowed(self, proposals: Proposals) -> Proposals:
        """Reject proposals from other directions than the requested ones."""
        if self.asked.approach is None:
            return proposals
        way = np.asarray(self.asked.approach, dtype=np.float64)
        along = (self.obj.pose.rotation @ proposals.T_object_palm[:, :3, :3]) @ self.hand.palm_normal
        fits = along @ way / np.linalg.norm(way) >= np.cos(self.asked.approach_angle)
        self.rejected.fall(Rejection.DIRECTION, proposals.taken(~fits))
        return proposals.taken(fits)

    def _reached(self, proposals: Proposals) -> Proposals:
        if self.asked.reachable is None or not len(proposals):
            return proposals
        reached = is_reached(self.asked.reachable, self.obj.pose.matrix @ proposals.T_object_palm)
        self.rejected.fall(Rejection.UNREACHABLE, proposals.taken(~reached))
        return proposals.taken(reached)

    def _finish(self, due: int) -> Iterator[PlannedGrasp]:
        """Yield the best waiting grasps, completed, up to a total number."""
        while len(self.found) < due and self._waiting and self._fruitless < FRUITLESS:
            if self._is_late() and self.found:
                return
            began = time.perf_counter()
            trial, grasp = self._waiting.pop(0), None
            if self.asked.sigma is not None and trial.number not in self._displaced:
                self._displace(trial, self.asked.sigma)
            elif any(_distance(trial.links, other) < self.asked.apart for other in self._places):
                self.rejected[Rejection.ALIKE] += 1
            else:
                grasp = self._finisher.finish(trial, self.rejected)
                self._fruitless = 0 if grasp is not None else self._fruitless + 1
            self.times["finishing"] += time.perf_counter() - began
            if grasp is not None:
                self.found.append(grasp)
                self._places.append(trial.links)
                yield grasp

    def _displace(self, trial: Trial, sigma: tuple[float, float]) -> None:
        """Score a trial by its remaining quality when the object is displaced, and let it wait again."""
        self._displaced.add(trial.number)
        score = self._closer.displaced_score(trial, sigma)
        if score <= LEFT * trial.score:
            self.rejected[Rejection.NOT_ROBUST] += 1
        else:
            insort(self._waiting, replace(trial, score=score), key=_rank)


def _rank(trial: Trial) -> tuple[float, int]:
    return -trial.score, trial.number


def _distance(one: FloatArray, other: FloatArray) -> float:
    """Return the root mean square over all links of how far apart they are in two grasps [m]."""
    return float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))


def _ways(hand: Hand, asked: PlanOptions) -> tuple[tuple[Preshape, ...], tuple[Arm, ...]]:
    """Return the preshapes and the ways of proposing.

    Raises:
        CommandError: no two sides of the hand ever face each other.
    """
    shapes, arms = list[Preshape](), list[Arm]()
    for fingers in asked.sets_of_fingers(hand):
        for shape in opposition_zones(hand, fingers):
            arms += [Arm(len(shapes), fingers, deep) for deep in asked.depths()]
            shapes.append(shape)
    if not any(len(shape.aperture) for shape in shapes):
        raise CommandError(
            f"hand '{hand.name}': no two of its fingers ever close towards each other; planning needs two sides that "
            f"oppose. 'clench hand' shows what was understood of it."
        )
    return tuple(shapes), tuple(arms)
