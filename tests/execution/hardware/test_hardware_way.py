"""The whole motion of a driven hand is free, from where the hand is found; what blocks a joint is named."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from facing_fingers import crossing, facing_fingers
from fake_driver import FakeDriver

from clench.closing.collision.path_check import find_path_overlap
from clench.core.pose import Pose
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.execution.trajectory import plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution, SolutionStatus
from handmade import make_solution

ENGINE = CollisionSource.ENGINE
FREE, OTHER_SIDE = (1.0, 1.2), {"a_0": -1.0, "b_0": -1.0}


@pytest.fixture
def hand() -> Hand:
    return facing_fingers()


def run(driver: FakeDriver, hand: Hand, solution: GraspSolution, **options: object) -> ExecutionReport:
    actuator = HardwareHand(hand, driver, **options)  # type: ignore[arg-type]
    return actuator.execute(solution, plan_trajectory(solution, hand, force=True))


@pytest.mark.usefixtures("clock")
def test_fingers_wait_on_the_way_from_where_the_hand_is_found(hand: Hand) -> None:
    driver = FakeDriver(OTHER_SIDE)
    report = run(driver, hand, crossing(hand, *FREE))
    assert report.success, report.reason
    assert "fingers waited for each other: 'a', then 'b'" in report.notes[0]
    assert report.history is not None
    told = report.history.commanded
    assert find_path_overlap(hand, told, ENGINE) is None
    assert find_path_overlap(hand, np.array([told[0], told[-1]]), ENGINE) is not None


@pytest.mark.usefixtures("clock")
def test_a_hand_that_is_found_near_the_start_moves_straight(hand: Hand) -> None:
    report = run(FakeDriver({"a_0": 0.9, "b_0": 1.3}), hand, crossing(hand, *FREE))
    assert report.success, report.reason
    assert report.notes[0] == "The way began with a part to the trajectory's start, 0.3 rad at most."


@pytest.mark.usefixtures("clock")
def test_without_a_free_way_nothing_is_sent(hand: Hand) -> None:
    box = GraspObject.load("box:x=0.01,y=0.01,z=0.01")
    solution = replace(crossing(hand, *FREE), hand_pose=Pose.identity(), object_pose=Pose((0.03, 0.0, 0.0)))
    driver = FakeDriver(OTHER_SIDE)
    report = run(driver, hand, solution, obj=box)
    assert not report.success
    assert report.reason.startswith(
        "Not carried out: No free way was found from where the hand is to the trajectory's start: 'a_link_0' would "
        "overlap the object's 'box:x=0.01,y=0.01,z=0.01'"
    )
    assert not driver.commands


@pytest.mark.usefixtures("clock")
def test_a_forced_trajectory_that_is_not_free_is_not_sent(hand: Hand) -> None:
    driver = FakeDriver({"a_0": -1.0, "b_0": -1.0})
    report = execute(crossing(hand, -1.0, 0.0), HardwareHand(hand, driver), force=True)
    assert not report.success
    assert "On the way to the touch, 'b_link_0' would overlap 'a_link_0'" in report.reason
    assert not driver.commands


@pytest.mark.usefixtures("clock")
def test_a_squeeze_larger_than_planned_is_checked_again(hand: Hand) -> None:
    plan = {"feasible": True, "text": "Holds.", "offsets": {"a_0": -0.3, "b_0": -0.3}}
    solution = replace(crossing(hand, 1.0, 0.8), squeeze=plan)
    held = run(FakeDriver({"a_0": 1.0, "b_0": 1.0}), hand, solution)
    assert any("Joints were told up to 0.3 rad beyond the touch" in note for note in held.notes)
    refused = run(FakeDriver({"a_0": 1.0, "b_0": 1.0}), hand, solution, squeeze=2.6)
    assert any("There was no squeeze: In the squeeze, 'b_link_0' would overlap" in note for note in refused.notes)


@pytest.mark.usefixtures("clock")
def test_steps_from_a_squeeze_that_was_left_out_are_checked_again(hand: Hand) -> None:
    """With the squeeze, finger 'b' is out of the way of the step; without it, it is not."""
    plan = {"feasible": True, "text": "Holds.", "offsets": {"b_0": 0.8}}
    solution = replace(crossing(hand, 1.0, 0.15), squeeze=plan, next_steps=({"a_0": -0.15},))
    free, blocked = FakeDriver({"a_0": 1.0, "b_0": 1.0}), FakeDriver({"a_0": 1.0, "b_0": 1.0})
    assert run(free, hand, solution).success
    report = run(blocked, hand, solution, squeeze=0.0)
    assert "In next step 1, 'b_link_0' would overlap 'a_link_0'" in report.reason
    assert not blocked.commands


@pytest.mark.usefixtures("clock")
def test_what_blocks_a_driven_joint_is_named(hand: Hand) -> None:
    """Finger 'b' is not where the model of the trajectory has it: 'a' meets it, or meets something unknown."""
    solution = crossing(hand, -1.0, 1.0)

    def stuck(a: float, b: float) -> str:
        driver = FakeDriver({"a_0": -1.0, "b_0": -1.0}, fault=lambda _: {"positions": {"a_0": a, "b_0": b}})
        begun = FakeDriver.command

        def command(path: object) -> None:
            begun(driver, path)  # type: ignore[arg-type]

        driver.command = command  # type: ignore[method-assign,assignment]
        return run(driver, hand, solution, max_deviation=5.0).reason

    assert "In the model, 'b_link_0' meets 'a_link_0' there." in stuck(-1.0, 0.0)
    assert "In the model, no other link is in the way of joint 'a_0'." in stuck(-0.9, 1.0)


FACING = """
<mujoco model="facing">
  <compiler angle="radian"/>
  <worldbody>
    <body name="palm">
      <geom type="box" size="0.005 0.005 0.005" pos="0.045 0 -0.05"/>
      <body name="a">
        <joint name="a" axis="0 0 1" range="-2 2"/>
        <geom type="capsule" fromto="0 0 0 0.04 0 0" size="0.006"/>
      </body>
      <body name="b" pos="0.09 0 0">
        <joint name="b" axis="0 0 1" range="-2 2"/>
        <geom type="capsule" fromto="0 0 0 -0.04 0 0" size="0.006"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_what_blocks_a_simulated_joint_is_named(tmp_path: Path) -> None:
    (tmp_path / "facing.xml").write_text(FACING)
    hand = Hand.load(tmp_path / "facing.xml")
    box = GraspObject.load("box:x=0.01,y=0.01,z=0.01")
    solution = replace(
        make_solution(
            hand=hand.name,
            status=SolutionStatus.PARTIAL,
            open_angles={"a": -1.0, "b": -1.0},
            joint_angles={"a": 0.0, "b": 0.0},
            joint_limits={},
            fingers={},
            contacts=(),
        ),
        object_pose=Pose((0.0, 0.0, 0.5)),
    )
    report = SimulatedHand(hand, box).execute(solution, plan_trajectory(solution, hand, force=True))
    assert not report.success
    said = r"Not reached: joint '(a|b)' is .* tolerance 0.02 rad. '(a|b)' presses on '(a|b)' with"
    assert re.search(said, report.reason), report.reason
