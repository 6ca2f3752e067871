"""A command is checked, and later changes of what was given do not reach the checked one."""

import numpy as np
import pytest

import clench
from clench import GraspCommand, Pose
from clench.core.exceptions import ClenchError
from clench.solver.checked_command import checked

HAND = clench.Hand.load("patent15")
JOINT = next(j.name for j in HAND.joints if str(j.role) == "closing")
HERE, THERE = Pose([0.0, 0.0, 0.1]), Pose([0.1, 0.0, 0.1])


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ({"planes": 1}, {"planes": True}),
        ({"planes": 3}, {"planes": 3.0}),
        ({"seed": 0}, {"seed": False}),
        ({"measure": True}, {"measure": 1}),
        ({"preshape": {JOINT: 0.0}}, {"preshape": {JOINT: False}}),
        ({"preshape": {JOINT: 0.1}}, {"preshape": {JOINT: float("nan")}}),
        ({"yaw_grid": (0.0, 0.1)}, {"yaw_grid": "0.0"}),
        ({"fingers": (HAND.fingers[0].name,)}, {"fingers": HAND.fingers[0].name}),
    ],
)
def test_what_only_equals_something_good_is_refused_all_the_same(good, bad):
    checked(HAND, GraspCommand(HERE, **good))
    with pytest.raises(ClenchError):
        checked(HAND, GraspCommand(HERE, **bad))


def test_a_change_of_what_was_given_reaches_no_command_that_was_checked():
    preshape = {JOINT: 0.1}
    command = GraspCommand(HERE, preshape=preshape)
    before = checked(HAND, command)
    preshape[JOINT] = 0.2
    after = checked(HAND, command)
    j = HAND.joint_index(JOINT)
    assert (before.start[j], after.start[j]) == (0.1, 0.2)
    assert before.command.preshape == {JOINT: 0.1}
    preshape["nobody"] = 0.0
    with pytest.raises(ClenchError, match="nobody"):
        checked(HAND, command)


def test_a_change_deep_inside_reaches_no_command_that_was_checked():
    force = [0.0, 0.0, -2.0]
    first = checked(HAND, GraspCommand(HERE, task_wrenches=({"force": force},), preshape="open"))
    force[2] = -20.0
    assert first.command.task_wrenches == ({"force": (0.0, 0.0, -2.0)},)


@pytest.mark.parametrize("key", ["yaw_grid", "fingers", "task_wrenches", "next_steps"])
def test_a_list_that_contains_itself_is_refused(key):
    endless = []
    endless.append(endless)
    with pytest.raises(ClenchError, match=key):
        checked(HAND, GraspCommand(HERE, **{key: endless}))


def test_criteria_that_write_to_what_they_are_given_change_no_later_solve():
    from clench.scoring.calibration import calibration_of
    from clench.solver.problem import make_context, make_problem

    problem = make_problem(HAND, clench.GraspObject.load("ball"), GraspCommand(HERE, preshape="open"))
    before = problem.start.copy()
    make_context(problem, calibration_of(None)).start[:] = 7.0
    assert np.array_equal(problem.start, before)


def test_zeros_of_either_sign_are_told_apart():
    signs = [
        checked(HAND, GraspCommand(HERE, preshape={JOINT: zero})).start[HAND.joint_index(JOINT)] for zero in (0.0, -0.0)
    ]
    assert [bool(np.signbit(sign)) for sign in signs] == [False, True]


def test_a_solution_has_the_poses_of_its_own_command():
    ball, moved = clench.GraspObject.load("sphere:r=0.03"), Pose([1.0, 2.0, 3.0])
    for pose in clench.approach_poses(HAND, ball, 3, 1):
        here = clench.solve(HAND, ball, GraspCommand(pose, preshape="open"))
        there = clench.solve(HAND, ball, GraspCommand(moved @ pose, object_pose=moved, preshape="open"))
        assert np.array_equal(here.hand_pose.matrix, pose.matrix)
        assert np.array_equal(there.hand_pose.matrix, (moved @ pose).matrix)
        assert np.array_equal(there.object_pose.matrix, moved.matrix)
        assert list(there.joint_angles.values()) == pytest.approx(list(here.joint_angles.values()), abs=1e-9)
