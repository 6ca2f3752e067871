"""Bounds of epsilon of a batch: never above epsilon of its solutions, and 0 for what is no grasp."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from clench.mechanics.epsilon.epsilon_quality import epsilon, epsilon_bound
from clench.solver.analysis.holding import hold
from clench.solver.batch.batch_epsilon import BatchEpsilon

HAND, MUG = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
POSES = [clench.Pose([0.0, 0.0, 9.0]), *clench.approach_poses(HAND, MUG, 24, 0)]


def batch(obj: clench.GraspObject) -> clench.GraspBatch:
    return clench.solve_batch(HAND, obj, POSES, clench.GraspCommand(POSES[0], preshape="open", measure=False))


@pytest.mark.parametrize("friction", [None, 0.4])
def test_bounds_are_below_epsilon_of_single_solutions(friction: float | None) -> None:
    answers = batch(MUG)
    bounds = BatchEpsilon(HAND, MUG, friction).bounds(answers)
    assert bounds[0] == 0.0
    assert (bounds > 0.0).sum() >= 3
    for n in range(1, len(POSES)):
        solution = answers.solution(n)
        held = hold(solution, HAND, MUG, friction=friction).held
        if solution.status not in ("grasp", "partial"):
            assert bounds[n] == 0.0
            continue
        # With many edges, the friction polyhedra are nearly cones, which hold those of the bound.
        assert bounds[n] <= 1.002 * epsilon(held, edges=48).radius + 1e-9
        assert (bounds[n] > 0.0) == (epsilon_bound(held) > 0.0)


def test_less_friction_and_moved_objects() -> None:
    """Friction of hand or object counts, a share of it too; where object and hand stand together changes nothing."""
    answers = batch(MUG)
    full = BatchEpsilon(HAND, MUG).bounds(answers)
    slippery = MUG.with_friction(0.3)
    assert BatchEpsilon(HAND, slippery).bounds(answers) == pytest.approx(BatchEpsilon(HAND, MUG).bounds(answers, 0.5))
    assert (BatchEpsilon(HAND, MUG).bounds(answers, 0.5) <= full + 1e-9).all()
    shift = clench.Pose([0.3, -0.2, 0.5], rpy=[0.4, -0.3, 1.1])
    moved = clench.solve_batch(
        HAND,
        MUG,
        [shift @ pose for pose in POSES],
        clench.GraspCommand(POSES[0], preshape="open", measure=False),
        object_poses=[shift @ MUG.pose] * len(POSES),
    )
    assert BatchEpsilon(HAND, MUG).bounds(moved) == pytest.approx(full, abs=1e-6)


def test_contacts_with_an_obstacle_hold_nothing() -> None:
    """A wall between the palm and the mug is touched; its contacts do not count."""
    wall = clench.obstacle("box:x=0.3,y=0.3,z=0.002", clench.Pose([0.0, 0.0, 0.05]))
    both = MUG.with_body(wall)
    answers, measured = batch(both), BatchEpsilon(HAND, both)
    _, counts = measured.counted(answers)
    touched = answers.contacts.body[~answers.contacts.passed] == 1
    assert touched.any()
    assert not counts[answers.contacts.body == 1].any()
    assert np.isfinite(measured.bounds(answers)).all()
