"""All ways of closing one hand around one object that the benchmark of peers compares, and checks of their ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final, NamedTuple

import numpy as np

import clench
from clench.closing.collision.packed_object import PackedObject, pack_object
from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.grasp_batch import GraspBatch
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .driving import Driven, Rested
from .fcl_engine import Engine
from .stepper import RULES, Closing, Rule, Stepper

#: How far a certified touch may be off [m]: polyhedra of round shapes, and what a later joint may open.
EXACT: Final = 5e-6
#: Nearer than that is touching where the program itself does not say [m].
NEAR: Final = 1e-3
#: Steps that are fine enough to judge our own first joints by [rad].
_FINE: Final = Rule("fine", 2, 0.005, 1e-4)
#: Every so many queries of the steppers one is asked again, and an answer may be this near to turning [m].
_EVERY: Final = 11
_ROUNDING: Final = 1e-9
_LOGGED: Final = 4000
OURS: Final = {"clench_planes": False, "clench_certified": True}
SIMULATED: Final = "mujoco"


Answer = GraspSolution | Closing | Rested
Closer = Callable[[int], Answer]


class Ended(NamedTuple):
    """The end of one closing: posture [rad], fingers that touch, and the numbers of queries and distances."""

    q: FloatArray
    touching: frozenset[str]
    queries: int
    distances: int


@dataclass(frozen=True, eq=False)
class PeerCase:
    """One hand, one object and the poses from which all ways start."""

    hand: Hand
    obj: GraspObject
    poses: Sequence[Pose]
    planes: int

    @cached_property
    def packed(self) -> PackedObject:
        """The object as the kernels read it."""
        return pack_object(self.obj)

    @cached_property
    def stepper(self) -> Stepper:
        """The stepper that closes from the open hand."""
        return Stepper(self.hand, self.obj, self.hand.open_angles(), self.hand.default_source)

    @cached_property
    def engine(self) -> Engine:
        """The independent measure."""
        return Engine(self.hand, self.obj, self.packed, self.hand.default_source)

    @cached_property
    def simulations(self) -> list[Driven]:
        """A scene for every pose."""
        return [Driven(self.hand, self.obj, pose) for pose in self.poses]

    def T_palm_object(self, k: int) -> FloatArray:
        """Return where the object is for the palm at one pose, (4, 4)."""
        found: FloatArray = np.linalg.inv(self.poses[k].matrix) @ self.obj.pose.matrix
        return found

    def command(self, k: int, full_width: bool) -> GraspCommand:
        """Return what our own solve is asked."""
        return GraspCommand(
            hand_pose=self.poses[k], preshape="open", planes=self.planes, full_width=full_width, measure=False
        )

    def closers(self) -> Mapping[str, Closer]:
        """Return every way of closing by name; called with the number of a pose it does nothing else than to close."""
        ours = {name: partial(self.solve, full) for name, full in OURS.items()}
        return {**ours, **{rule.name: partial(self.step, rule) for rule in RULES}, SIMULATED: self.simulate}

    def solve(self, full_width: bool, k: int) -> GraspSolution:
        """Return our own solve."""
        return clench.solve(self.hand, self.obj, self.command(k, full_width))

    def solve_all(self, full_width: bool) -> GraspBatch:
        """Return our own solves of all poses at once, on one thread."""
        command = replace(self.command(0, full_width), hand_pose=Pose.identity())
        return clench.solve_batch(self.hand, self.obj, self.poses, command, threads=1, progress=False)

    def step(self, rule: Rule, k: int) -> Closing:
        """Return a closing in steps."""
        return self.stepper.close(rule, self.T_palm_object(k))

    def simulate(self, k: int) -> Rested:
        """Return a simulated closing."""
        return self.simulations[k].close()

    def gaps(self, k: int, q: FloatArray) -> dict[str, float]:
        """Return the gap of every finger at a posture [m], by the independent measure."""
        T, poses = self.T_palm_object(k), self.hand.link_poses(q)
        return {f.name: self.engine.finger_gap(f, poses, T, q) for f in self.hand.fingers}

    def ended(self, k: int, answer: Answer) -> Ended:
        """Return how a closing ended."""
        if isinstance(answer, GraspSolution):
            touching = frozenset(c.finger for c in answer.contacts if not c.passed)
            return Ended(posture(answer.joint_angles, self.hand, "joint_angles"), touching, 0, 0)
        if isinstance(answer, Rested):
            near = frozenset(finger for finger, gap in self.gaps(k, answer.q).items() if gap <= NEAR)
            return Ended(answer.q, near, answer.steps, 0)
        touching = frozenset(finger.name for finger, touches in self.stepper.fingers(answer) if touches)
        return Ended(answer.q, touching, int(answer.tally[0]), int(answer.tally[1]))


def wrong_ends(case: PeerCase) -> Iterator[str]:
    """Yield a sentence for every error in the ends of closings, or in the answers that the steppers got on the way."""
    for k in range(len(case.poses)):
        for sentence in (*_wrong_queries(case, k), *_wrong_steps(case, k), *_wrong_solve(case, k)):
            yield f"{case.obj.name}, pose {k}: {sentence}"


def _wrong_queries(case: PeerCase, k: int) -> Iterator[str]:
    """Compare some of the queries of every stepper with the independent engine."""
    T = case.T_palm_object(k)
    for rule in RULES:
        log = case.stepper.log(_LOGGED)
        case.stepper.close(rule, T, log)
        asked = np.flatnonzero(log.queries[:, 0] >= 0)[::_EVERY]
        for (link, kind, hit), q in zip(log.queries[asked], log.postures[asked], strict=True):
            gap = case.engine.link_gap(int(link), case.hand.link_poses(q)[link], T, q)
            # A recorded distance says whether it is below a bound: that of the rule, or twice that.
            right = gap < 2.0 * rule.fine or not hit if kind == 1 else (gap < 0.0) == bool(hit)
            if not right and abs(gap) > _ROUNDING:
                name = case.hand.links[link].name
                yield f"{rule.name} was told {bool(hit)} about {name} at a gap of {gap:.3g} m."
                return


def _wrong_steps(case: PeerCase, k: int) -> Iterator[str]:
    """Check the ends of the steppers against their rules."""
    for rule in RULES[:2]:
        ended = case.ended(k, case.step(rule, k))
        gaps = case.gaps(k, ended.q)
        if min(gaps.values()) < -EXACT:
            yield f"{rule.name} ends in collision, {min(gaps.values()):.3g} m."
        if rule.fine > 0.0 and any(gaps[finger] > 2.0 * rule.fine + EXACT for finger in ended.touching):
            yield f"{rule.name} ends with a larger gap than its rule allows."


def _wrong_solve(case: PeerCase, k: int) -> Iterator[str]:
    """Check certified answers against the engine and against fine steps, which end at the first collision or later."""
    solution = case.solve(True, k)
    if not solution.certified:
        return
    ended = case.ended(k, solution)
    gaps = case.gaps(k, ended.q)
    for finger, gap in gaps.items():
        if gap < -EXACT or (finger in ended.touching and gap > EXACT):
            yield f"our certified {finger} ends at a gap of {gap:.3g} m."
    arrays = case.stepper.arrays
    stepped = case.step(_FINE, k).q
    seen: set[int] = set()
    for joint, finger_number, rate in zip(arrays.free, arrays.finger, arrays.rate, strict=True):
        if finger_number not in seen and (ended.q[joint] - stepped[joint]) * rate > EXACT:
            yield f"our {case.hand.joint_names[joint]} goes on where a stepping hand collides."
        seen.add(int(finger_number))
