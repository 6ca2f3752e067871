"""Sample grasps of an object and grade them by our own criteria, without any simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import clench
from clench.grasp.mechanics.held import HeldObject
from clench.grasp.mechanics.steadiness import epsilon, epsilon_bound
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.hand.opposition import opposing_preshapes
from clench.models.objects.grasp_object import GraspObject
from clench.solver.holding import hold
from clench.solver.solution import GraspSolution, SolutionStatus

#: Preshapes of the thumb that share the poses; the first is the open hand.
PRESHAPES = 10
#: Of every grasp that is wanted of the best so many are solved over the whole width, the most promising first.
SOLVED = 3
#: The score is a mean over these shares of the test's friction, so that a margin in it counts [-].
FRICTION_SHARES = (0.5, 1.0)


@dataclass(frozen=True, eq=False)
class GradedGrasp:
    """Hold a solution with its score: mean of epsilon (L1, 8 edges) at the test's friction and at half of it [N/N]."""

    solution: GraspSolution
    score: float


@dataclass(frozen=True, eq=False)
class Sampled:
    """Hold what came of sampling: grasps, the best first, and how often what stood in the way."""

    grasps: tuple[GradedGrasp, ...]
    kinds: Counter[str]


def sample_grasps(
    hand: Hand,
    obj: GraspObject,
    poses: int,
    wanted: tuple[int, int],
    seed: int,
    friction: float,
    tick: Callable[[], None],
) -> Sampled:
    """Solve approach poses quickly, on one plane, then the best of them over the whole width, and grade these.

    Args:
        hand, obj: what grasps what. poses: how many approaches. wanted: how many grasps are needed in the
            end, of the best and of all others.
        seed: of poses and preshapes. friction: of the test [-]. tick: called after every solve.
    """
    kinds: Counter[str] = Counter()
    quick: list[tuple[float, GraspCommand]] = []
    preshapes = opposing_preshapes(hand, min(PRESHAPES, poses), seed)
    for number, preshape in enumerate(preshapes):
        count = len(range(number, poses, len(preshapes)))
        for pose in clench.approach_poses(hand, obj, count, seed + number, preshape=preshape):
            shaped = preshape or "open"
            command = GraspCommand(hand_pose=pose, preshape=shaped, planes=1, full_width=False, measure=False)
            solution = clench.solve(hand, obj, command)
            tick()
            kinds[f"sampled_{solution.status.value}"] += 1
            if solution.status is SolutionStatus.GRASP:
                promise = _mean(epsilon_bound, solution, hand, obj, friction)
                quick.append((promise, GraspCommand(hand_pose=pose, preshape=shaped)))
    quick.sort(key=lambda found: -found[0])
    grasps: list[GradedGrasp] = []
    for _, command in _spread(quick, wanted):
        solution = clench.solve(hand, obj, command)
        tick()
        if solution.status is not SolutionStatus.GRASP:
            kinds["solved_less_than_grasp"] += 1
        elif not solution.is_valid():
            kinds["solved_not_valid"] += 1
        else:
            grasps.append(GradedGrasp(solution, score_of(solution, hand, obj, friction)))
    grasps.sort(key=lambda graded: -graded.score)
    return Sampled(tuple(grasps), kinds)


def score_of(solution: GraspSolution, hand: Hand, obj: GraspObject, friction: float) -> float:
    """Return the score of a solution [N/N], see `GradedGrasp`, for the friction of the test [-]."""
    return _mean(lambda held: epsilon(held).radius, solution, hand, obj, friction)


def _mean(
    measure: Callable[[HeldObject], float], solution: GraspSolution, hand: Hand, obj: GraspObject, friction: float
) -> float:
    held = (hold(solution, hand, obj, friction=share * friction).held for share in FRICTION_SHARES)
    return sum(map(measure, held)) / len(FRICTION_SHARES)


def _spread(quick: list[tuple[float, GraspCommand]], wanted: tuple[int, int]) -> list[tuple[float, GraspCommand]]:
    """Return the best, and some of the rest, evenly spaced, so that the score can be judged on both."""
    best, rest = (SOLVED * wanted[0], 2 * wanted[1])
    return [*quick[:best], *quick[best :: max(1, (len(quick) - best) // max(rest, 1))][:rest]]
