"""Coupled joints that are not quite parallel: how far links get from where they are swept is bounded, and said."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x
from clench.base.pose import Pose, rotation_about
from clench.grasp.exact import tilt_deviation
from clench.grasp.plan import plan_finger

LENGTHS = (0.05, 0.04)


def coupled(tilt: float):
    """Return a finger whose second joint is turned away from the first one by an angle [rad], about z."""
    axes = [np.array([0.0, -1.0, 0.0]), np.array([np.sin(tilt), -np.cos(tilt), 0.0])]
    shapes = [along_x(0.006, length) for length in LENGTHS]
    builder = HandBuilder().finger("index", shapes, LENGTHS, axes=axes, upper=1.5)
    return builder.couple("index_0", "index_1", 1.0).hand()


@pytest.mark.parametrize("tilt", [1e-5, 1e-4, 1e-2])
def test_the_bound_holds_and_is_not_far_off(tilt: float) -> None:
    hand = coupled(tilt)
    plan = plan_finger(hand, hand.fingers[0], hand.open_angles(), 3, hand.default_source)
    bound = tilt_deviation(hand, plan)
    worst = 0.0
    for angle in np.linspace(0.0, 1.5, 31):
        true = hand.link_poses(np.array([angle, angle]))[2]
        # As swept: both joints turn about the axis of the first.
        first, both = (rotation_about(np.array([0.0, -1.0, 0.0]), turn) for turn in (angle, 2.0 * angle))
        swept = first @ np.array([LENGTHS[0], 0, 0])
        for x in (0.0, LENGTHS[1]):
            for y in (-0.006, 0.006):
                point = np.array([x, y, 0.0])
                worst = max(worst, float(np.linalg.norm(true[:3, :3] @ point + true[:3, 3] - swept - both @ point)))
    assert 0.0 < worst <= bound
    assert bound < 12.0 * worst


def test_the_certificate_names_it() -> None:
    ball = clench.GraspObject.load("sphere:r=0.01", pose=Pose([0.05, 0.0, 0.04]))
    straight, tilted = (
        clench.solve(coupled(tilt), ball, clench.GraspCommand(hand_pose=Pose.identity())) for tilt in (0.0, 2e-6)
    )
    assert straight.certified
    assert straight.certificate["deviation"] == 0.0
    assert "coupled joints are not quite parallel" in tilted.certificate["text"]
    assert 0.0 < tilted.certificate["deviation"] < 2e-6
