"""Motions are checked as the mechanism makes them: couplings are obeyed, and held fingers stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from facing_fingers import crossing, facing_fingers

from chain_hands import HandBuilder, along_x, mount
from clench.closing.collision.path_check import find_path_overlap, place_object
from clench.core.exceptions import MotionError
from clench.core.pose import Pose
from clench.execution.hardware.joint_blocking import modelled_blocker
from clench.execution.step_check import told_overlap
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution
from handmade import make_contact

ENGINE = CollisionSource.ENGINE
Z = np.array([0.0, 0.0, 1.0])
ROD = along_x(0.004, 0.04)


def between(trajectory: Trajectory) -> np.ndarray:
    """Return postures at a thousand times, shape (1000, J)."""
    return np.array([trajectory.at(t) for t in np.linspace(0.0, trajectory.duration, 1000)])


@pytest.mark.parametrize("obj", [None, "box:x=0.01,y=0.01,z=0.01"])
def test_a_follower_that_waits_at_its_limit_waits_in_the_plan(obj: str | None) -> None:
    builder = HandBuilder().finger("a", [ROD, ROD], [0.04, 0.04], axes=[Z, Z], lower=0.0, upper=2.0)
    hand = builder.finger("b", [ROD], [0.04], base=mount((0.0, 0.0, 0.1)), axes=[Z], lower=-2.0).hand()
    hand = builder.couple("a_0", "a_1", 2.0, -2.0).hand()
    solution = crossing(hand, 0.0, 2.0)
    angles = dict.fromkeys(hand.joint_names, 0.0)
    solution = replace(
        solution,
        open_angles=angles,
        joint_angles=angles | {"a_0": 2.0, "a_1": 2.0},
        hand_pose=Pose.identity(),
        object_pose=Pose((0.0, 0.0, 1.0)),
    )
    thing = None if obj is None else GraspObject.load(obj)
    postures = between(plan_trajectory(solution, hand, obj=thing))
    followed = np.array([hand.coupled(q) for q in postures])
    np.testing.assert_allclose(postures, followed, atol=1e-9)
    assert np.ptp(postures[:, 1]) == pytest.approx(2.0)


def pressing(hand: Hand, offset: float) -> GraspSolution:
    """Finger 'a' rests on an object; the squeeze tells it to go on by an offset, and the step moves finger 'b'."""
    contact = make_contact(finger="a", link="a_link_0", stops_joint="a_0")
    return replace(
        crossing(hand, 0.15, 0.15),
        contacts=(contact,),
        squeeze={"feasible": True, "text": "Holds.", "offsets": {"a_0": offset}},
        next_steps=({"b_0": -0.15},),
    )


@pytest.mark.parametrize("offset", [0.0, 0.5, 1.0])
def test_a_step_past_a_finger_that_the_object_holds_is_refused(offset: float) -> None:
    hand = facing_fingers()
    with pytest.raises(MotionError, match="In next step 1, 'b_link_0' would overlap 'a_link_0'"):
        plan_trajectory(pressing(hand, offset), hand)


def test_an_exported_pregrasp_that_overlaps_is_told() -> None:
    hand = facing_fingers()
    solution = crossing(hand, 1.0, 1.2)
    assert told_overlap(solution, hand, None, {"a_0": 1.0, "b_0": 1.0}, {}) is None
    said = told_overlap(solution, hand, None, {"a_0": 0.0, "b_0": 0.0}, {})
    assert said is not None
    assert said.startswith("On the straight line from the pregrasp to the grasp, 'b_link_0' would overlap 'a_link_0'")


def test_a_link_in_an_obstacle_still_stays_out_of_the_object() -> None:
    hand = HandBuilder().finger("a", [along_x(0.006, 0.04)], [0.04], axes=[Z], lower=-2.0).hand()
    ball, table = GraspObject.load("sphere:r=0.01"), GraspObject.load("box:x=0.04,y=0.04,z=0.04")
    placed = ball.with_object(table, Pose([-0.026 + 0.005 - 0.03, -0.03, 0.0]))  # 5 mm of the link are in the table
    path = np.array([[-1.0], [0.6]])
    found = find_path_overlap(hand, path, ENGINE, place_object(placed, Pose([0.03, 0.03, 0.0]).matrix))
    assert found is not None
    assert (found.link, found.other, found.from_start) == ("a_link_0", "sphere:r=0.01", False)


def test_links_that_overlap_already_are_said_to() -> None:
    hand = facing_fingers()
    found = find_path_overlap(hand, np.array([[0.15, 0.05], [0.0, 0.0]]), ENGINE)
    assert found is not None
    assert not found.from_start
    found = find_path_overlap(hand, np.array([[0.05, 0.05], [0.0, 0.0]]), ENGINE)
    assert found is not None
    assert found.from_start
    assert "'b_link_0' overlaps 'a_link_0' where the path begins, and would go deeper" in found.sentence


def test_another_finger_is_not_said_to_block_a_joint() -> None:
    builder = HandBuilder().finger("a", [ROD], [0.04], axes=[Z], lower=-2.0)
    builder = builder.finger("b", [ROD, ROD], [0.04, 0.04], base=mount((0.0, 0.0, 0.1)), axes=[Z, Z], lower=-2.0)
    hand = builder.couple("b_0", "b_1", 1.0, breakaway=True).hand()
    box = GraspObject.load("box:x=0.02,y=0.02,z=0.02")
    solution = replace(
        crossing(facing_fingers(), 1.0, 1.0), hand_pose=Pose.identity(), object_pose=Pose((0.06, 0.035, 0.1))
    )
    said = modelled_blocker(solution, hand, box, np.array([0.0, 0.5, -0.5]), "a_0", 1.0)
    assert said == "In the model, neither another link nor the object is in the way of joint 'a_0'."


def test_a_surface_without_an_inside_is_not_proven() -> None:
    corners = np.array([[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]])
    sheet = GraspObject.from_meshes([(corners, np.array([[0, 1, 2], [0, 2, 3]]))], name="sheet")
    hand = facing_fingers()
    solution = replace(crossing(hand, 1.0, 1.2), hand_pose=Pose.identity(), object_pose=Pose((5.0, 0.0, 0.0)))
    notes = plan_trajectory(solution, hand, obj=sheet).notes
    assert "Not proven: no link passes through 'sheet[0]', which is a surface without an inside." in notes
