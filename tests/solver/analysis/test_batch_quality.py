"""The bound of epsilon of every pose of a batch: never above the exact number, and above 0 for force closure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clench
from clench.core.exceptions import CommandError, UnknownNameError
from clench.mechanics.epsilon.epsilon_quality import EDGES
from clench.solver.batch.batch_epsilon import BatchEpsilon


@pytest.fixture(scope="module")
def batch() -> clench.GraspBatch:
    hand = clench.Hand.load("robonaut2")
    scene = clench.GraspObject.load("mug").with_body(clench.table(0.0))
    return clench.solve_batch(hand, scene, clench.approach_poses(hand, scene, 30, 0))


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ({}, {}),
        ({"friction": (0.4, 0.8), "torsion": 0.01}, {"friction": 0.4}),
        ({"contact_model": "soft", "torsion": 0.01}, {"torsion": 0.01}),
        ({"center_of_mass": [0.0, 0.0, 0.02]}, {"center": np.array([0.0, 0.0, 0.02])}),
    ],
)
def test_bounds_are_those_of_the_hand_and_the_object_of_the_batch(
    batch: clench.GraspBatch, asked: dict[str, Any], meant: dict[str, Any]
) -> None:
    found = clench.mechanics.batch_epsilon(batch, **asked)
    np.testing.assert_array_equal(found, BatchEpsilon(batch.question.hand, batch.question.obj, **meant).bounds(batch))
    assert found.shape == (30,)
    assert (found > 0.0).any()
    assert (found == 0.0).any()
    if asked:
        assert (found != clench.mechanics.batch_epsilon(batch)).any()


def test_bounds_are_no_more_than_epsilon(batch: clench.GraspBatch) -> None:
    found = clench.mechanics.batch_epsilon(batch)
    for i in np.flatnonzero(found)[:4].tolist():
        quality = clench.mechanics.grasp_quality(batch.solution(i), batch.question.hand, batch.question.obj)
        # Both take polyhedra inside the round cones, turned differently.
        assert 0.0 < found[i] <= quality.epsilon.radius / np.cos(np.pi / EDGES) + 1e-9
        assert quality.force_closure
    np.testing.assert_array_equal(clench.mechanics.batch_epsilon(batch[[5, 3]]), found[[5, 3]])


def test_malformed_requests(batch: clench.GraspBatch) -> None:
    wrong: dict[str, Any]
    for wrong, kind in (
        ({"friction": 0.0}, CommandError),
        ({"torsion": -1.0}, CommandError),
        ({"contact_model": "hard"}, UnknownNameError),
        ({"center_of_mass": [0, 0]}, CommandError),
    ):
        with pytest.raises(kind):
            clench.mechanics.batch_epsilon(batch, **wrong)
    with pytest.raises(CommandError, match="batch: expected"):
        clench.mechanics.batch_epsilon(batch.solution(0))
