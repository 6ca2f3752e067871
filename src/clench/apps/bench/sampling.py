"""Sample grasps of an object and grade them by our own criteria, without any simulation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import clench
from clench.grasp.mechanics.steadiness import epsilon, epsilon_bound
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.hand.opposition import opposing_preshapes
from clench.models.objects.grasp_object import GraspObject
from clench.solve.holding import hold
from clench.solve.solution import GraspSolution, SolutionStatus

#: Preshapes of the thumb that share the poses; the first is the open hand.
PRESHAPES = 10
#: Of every grasp that is wanted so many are solved over the whole width, the most promising first.
SOLVED = 3
#: The score is computed at this share of the test's friction, so that it leaves a margin [-].
FRICTION_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class GradedGrasp:
    """Hold a solution with its score: epsilon, for L1, 8 edges, at half of the test's friction [N per N]."""

    solution: GraspSolution
    score: float


@dataclass(frozen=True, eq=False)
class Sampled:
    """Hold what came of sampling: grasps, the best first, and how often what stood in the way."""

    grasps: tuple[GradedGrasp, ...]
    kinds: Counter[str]


def sample_grasps(
    hand: Hand, obj: GraspObject, poses: int, wanted: int, seed: int, friction: float, tick: Callable[[], None]
) -> Sampled:
    """Solve approach poses quickly, on one plane, then the best of them over the whole width, and grade these.

    Args:
        hand, obj: what grasps what. poses: how many approaches. wanted: how many grasps are needed in the end.
        seed: of poses and preshapes. friction: of the test [-]. tick: called after every solve.
    """
    kinds: Counter[str] = Counter()
    quick: list[tuple[float, GraspCommand]] = []
    preshapes = opposing_preshapes(hand, min(PRESHAPES, poses), seed)
    for number, preshape in enumerate(preshapes):
        count = len(range(number, poses, len(preshapes)))
        for pose in clench.approach_poses(hand, obj, count, seed + number, preshape=preshape):
            command = GraspCommand(hand_pose=pose, preshape=preshape, planes=1, full_width=False, measure=False)
            solution = clench.solve(hand, obj, command)
            tick()
            kinds[f"sampled_{solution.status.value}"] += 1
            if solution.status is SolutionStatus.GRASP:
                held = hold(solution, hand, obj, friction=FRICTION_SHARE * friction).held
                quick.append((epsilon_bound(held), GraspCommand(hand_pose=pose, preshape=preshape)))
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
    """Return the score of a solution [N per N]: epsilon at a share of the test's friction [-]."""
    return epsilon(hold(solution, hand, obj, friction=FRICTION_SHARE * friction).held).radius


def _spread(quick: list[tuple[float, GraspCommand]], wanted: int) -> list[tuple[float, GraspCommand]]:
    """Return the best, and as many from the rest, evenly spaced, so that the score can be judged on both."""
    best, rest = quick[: SOLVED * wanted], quick[SOLVED * wanted :]
    step = max(1, len(rest) // wanted) if rest else 1
    return [*best, *rest[::step][:wanted]]
