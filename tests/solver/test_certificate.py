"""What a certificate says of sets that the kernels make no promise about."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.closing.candidates import FingerCandidate
from clench.closing.finger_plan import plan_finger
from clench.core.pose import Pose
from clench.models.hand.hand import Hand, JointRole
from clench.models.shapes import Shape, ShapeKind
from clench.solver.certificate import Certificate, certify
from clench.solver.planning import plan_hand
from clench.solver.problem import make_problem

#: A link in which a small ball lies without a face of one going through a face of the other.
THICK = Shape(ShapeKind.BOX, (0.03, 0.015, 0.015), Pose([0.05, 0, 0]))
YAW = 0.9


def bead(angle: float) -> clench.GraspObject:
    """Return a ball that is inside the thick link when the finger is turned to an angle."""
    return clench.GraspObject.load("sphere:r=0.004", pose=Pose([0.05 * np.cos(angle), 0.05 * np.sin(angle), 0.0]))


def turning_finger() -> Hand:
    """Return a finger that a posture joint turns about z, and a closing joint in the same place."""
    roles = [JointRole.POSTURE, JointRole.CLOSING]
    axes = [np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])]
    return HandBuilder().finger("index", [None, THICK], [0.0, 0.08], roles=roles, axes=axes, upper=1.5).hand()


def certificate_at(yaw: float, obj: clench.GraspObject) -> Certificate:
    """Return what is said where the hand starts at 0 rad and the chosen set of its finger at `yaw`."""
    hand = turning_finger()
    problem = make_problem(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open"))
    posture = np.array([yaw, 0.0])
    plan = plan_finger(hand, hand.fingers[0], posture, 1, problem.source)
    best = FingerCandidate(plan, 0, None, np.zeros(1), posture, (), None, swept=True)
    return certify(problem, [best], [], posture, plan_hand(problem).full_width_arrays)


@pytest.mark.parametrize(("yaw", "holds"), [(0.0, False), (YAW, True)])
def test_a_bead_inside_a_link_counts_at_the_posture_of_the_chosen_candidate(yaw: float, holds: bool) -> None:
    """The bead is inside the link where the hand starts; a set at another posture has nothing to do with it."""
    assert certificate_at(yaw, bead(0.0)).holds is holds


def test_a_bead_inside_a_link_at_the_posture_of_the_chosen_candidate_is_told() -> None:
    assert certificate_at(0.0, bead(YAW)).holds
    found = certificate_at(YAW, bead(YAW))
    assert not found.holds
    assert (found.code, found.links) == ("blocked_at_start", ("index_link_1",))
    assert found.text == "index_link_1 overlaps the object before anything moves."


def test_a_bead_inside_a_finger_that_rests_is_told() -> None:
    builder = HandBuilder().finger("index", [along_x(0.006, 0.05)], [0.05], upper=1.0, base=mount((0, 0.1, 0)))
    hand = builder.finger("resting", [THICK], [0.08]).hand()
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open", fingers=("index",))
    solution = clench.solve(hand, bead(0.0), command)
    assert not solution.certified
    assert solution.certificate["text"] == "resting_link_0 overlaps the object before anything moves."
    assert (solution.certificate["code"], solution.certificate["links"]) == ("blocked_at_start", ["resting_link_0"])
