"""Trajectories: on the computed path, within the limits, all fingers arriving together."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.core.exceptions import CommandError, FileError
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import DEFAULT_SPEED, Coupling, Hand, Joint, JointRole
from clench.solver.solution import GraspSolution


def speeds(trajectory: Trajectory) -> np.ndarray:
    return np.abs(np.diff(trajectory.positions, axis=0)) / np.diff(trajectory.times)[:, None]


def moving(trajectory: Trajectory, joint: int) -> np.ndarray:
    """Times at which a joint starts and stops moving."""
    steps = np.flatnonzero(np.abs(np.diff(trajectory.positions[:, joint])) > 0)
    return np.array([trajectory.times[steps[0]], trajectory.times[steps[-1] + 1]])


def independent(hand: Hand) -> Hand:
    return replace(hand, couplings=())


def test_it_starts_open_and_ends_at_the_touch(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(pinch, pincer)
    assert trajectory.joints == ("thumb", "index", "index_tip")
    assert trajectory.times[0] == 0.0
    assert (np.diff(trajectory.times) > 0).all()
    np.testing.assert_array_equal(trajectory.positions[0], 0.0)
    np.testing.assert_array_equal(trajectory.positions[-1], list(pinch.joint_angles.values()))
    np.testing.assert_array_equal(trajectory.at(-1.0), trajectory.positions[0])
    np.testing.assert_array_equal(trajectory.at(1e9), trajectory.positions[-1])


def accelerations(trajectory: Trajectory) -> np.ndarray:
    """Twice the second divided differences: for a smooth path, accelerations somewhere between three way-points."""
    rates = np.diff(trajectory.positions, axis=0) / np.diff(trajectory.times)[:, None]
    return np.abs(np.diff(rates, axis=0)) / (0.5 * (trajectory.times[2:] - trajectory.times[:-2]))[:, None]


@pytest.mark.parametrize("acceleration", [10.0, 1e5])
@pytest.mark.parametrize("speed", [1.0, 0.25])
def test_limits_hold_and_one_of_them_is_reached(
    pincer: Hand, pinch: GraspSolution, speed: float, acceleration: float
) -> None:
    trajectory = plan_trajectory(pinch, pincer, speed=speed, acceleration=acceleration)
    np.testing.assert_array_equal(trajectory.velocity_limits, [3.0, DEFAULT_SPEED, 1.0])
    share = speeds(trajectory).max(axis=0) / trajectory.velocity_limits
    used = accelerations(trajectory).max() / acceleration
    assert share.max() <= speed * (1.0 + 1e-9)
    assert used <= 1.0 + 1e-6
    assert share.max() == pytest.approx(speed, rel=1e-6) or used == pytest.approx(1.0, rel=1e-3)


def test_all_fingers_arrive_together_and_slowly(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(pinch, pincer)
    ends = [moving(trajectory, j)[1] for j in range(3)]
    assert ends == [trajectory.duration] * 3
    assert (speeds(trajectory)[-1] < 0.4 * speeds(trajectory).max(axis=0)).all()


def test_coupled_joints_obey_their_ratio_all_the_way(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(pinch, pincer)
    np.testing.assert_allclose(trajectory.positions[:, 2], trajectory.positions[:, 1], atol=1e-12)


def test_independent_joints_close_one_after_another(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(pinch, independent(pincer))
    assert moving(trajectory, 1)[1] <= moving(trajectory, 2)[0] + 1e-12
    assert moving(trajectory, 2)[1] == trajectory.duration


def test_another_order_is_a_straight_line(pincer: Hand, pinch: GraspSolution) -> None:
    index = pinch.fingers["index"]
    together = replace(index, candidates=(replace(index.candidates[0], order="together"),))
    solution = replace(pinch, fingers={**pinch.fingers, "index": together})
    positions = plan_trajectory(solution, independent(pincer)).positions
    np.testing.assert_allclose(positions[:, 2] * pinch.joint_angles["index"], positions[:, 1] * positions[-1, 2])
    assert ((positions[1:-1, 1] > 0) & (positions[1:-1, 2] > 0)).any()


def test_a_follower_stays_at_its_limit_while_the_leader_goes_on(pincer: Hand, pinch: GraspSolution) -> None:
    joints = (*pincer.joints[:2], replace(pincer.joints[2], upper=0.1))
    hand = replace(pincer, joints=joints)
    angles = {**pinch.joint_angles, "index_tip": 0.1}
    positions = plan_trajectory(replace(pinch, joint_angles=angles), hand).positions
    np.testing.assert_allclose(positions[:, 2], np.minimum(positions[:, 1], 0.1), atol=0.01)


def test_a_follower_that_broke_away_goes_on_alone(pincer: Hand, pinch: GraspSolution) -> None:
    hand = replace(pincer, couplings=(Coupling(1, 2, 1.0, 0.0, breakaway=True),))
    angles = {**pinch.joint_angles, "index": 0.1, "index_tip": 0.5}
    trajectory = plan_trajectory(replace(pinch, joint_angles=angles), hand)
    stopped = np.flatnonzero(trajectory.positions[:, 1] >= 0.1)[0]
    assert trajectory.positions[stopped, 2] == pytest.approx(0.1)
    assert trajectory.positions[-1, 2] == 0.5


def test_posture_joints_move_before_the_fingers_close(pincer: Hand, pinch: GraspSolution) -> None:
    yaw = Joint("yaw", np.array([0.0, 0.0, 1.0]), np.zeros(3), -1.0, 1.0, role=JointRole.POSTURE)
    hand = replace(pincer, joints=(*pincer.joints, yaw))
    solution = replace(
        pinch,
        joint_angles={**pinch.joint_angles, "yaw": 0.3},
        open_angles={**pinch.open_angles, "yaw": 0.0},
    )
    trajectory = plan_trajectory(solution, hand)
    turned = moving(trajectory, 3)[1]
    assert trajectory.positions[-1, 3] == 0.3
    assert all(moving(trajectory, j)[0] >= turned for j in range(3))
    assert (np.diff(trajectory.times) > 0).all()


def test_a_hand_that_need_not_move(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(replace(pinch, joint_angles=pinch.open_angles), pincer)
    assert trajectory.duration == 0.0
    assert trajectory.to_dict()["points"] == [{"time": 0.0, "phase": "touch", "positions": [0.0, 0.0, 0.0]}]


@pytest.mark.parametrize("key", ["acceleration", "clearance"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_bad_acceleration_and_clearance(pincer: Hand, pinch: GraspSolution, key: str, value: float) -> None:
    with pytest.raises(CommandError, match=f"{key}: expected a finite number above 0"):
        plan_trajectory(pinch, pincer, **{key: value})


@pytest.mark.parametrize("speed", [0.0, -1.0, 1.5, np.nan, 5e-324])
def test_bad_speed(pincer: Hand, pinch: GraspSolution, speed: float) -> None:
    with pytest.raises(CommandError, match="speed: expected a fraction above 0 and up to 1"):
        plan_trajectory(pinch, pincer, speed=speed)


def test_a_solution_of_another_hand(pincer: Hand, pinch: GraspSolution) -> None:
    with pytest.raises(CommandError, match=r"joint_angles: .* hand 'pincer': joint 'thumb' is missing"):
        plan_trajectory(replace(pinch, joint_angles={"index": 0.1, "index_tip": 0.1}), pincer)
    with pytest.raises(CommandError, match=r"open_angles: .* hand 'pincer': 'toe' is no joint of it"):
        plan_trajectory(replace(pinch, open_angles={**pinch.open_angles, "toe": 0.0}), pincer)


def test_file_round_trip(pincer: Hand, pinch: GraspSolution, tmp_path: Path) -> None:
    trajectory = plan_trajectory(pinch, pincer)
    trajectory.save(tmp_path / "t.json")
    loaded = Trajectory.load(tmp_path / "t.json")
    assert loaded.to_dict() == trajectory.to_dict()
    document = json.loads((tmp_path / "t.json").read_text())
    assert document["schema"] == "clench.trajectory/1"
    assert document["pregrasp"] is None
    phases = [p["phase"] for p in document["points"]]
    assert phases[0] == "open"
    assert phases[-1] == "touch"
    assert set(phases[1:-1]) == {"closing"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "x"}, r"schema: expected 'clench.trajectory/1'"),
        ({"points": []}, r"points: expected at least one"),
        ({"joints": ["a"]}, r"velocity_limits: expected 1 numbers, got 3"),
        ({"points": [{"time": 0, "phase": "touch", "positions": [0, 0]}]}, r"points\[0\]\.positions: expected 3 ang"),
        ({"points": [{"time": 0, "phase": "open", "positions": [0, 0, 0]}] * 2}, r"points\[1\]\.time: expected more"),
        ({"hand": 3}, r"hand: expected str, got int"),
    ],
)
def test_malformed_files(
    pincer: Hand, pinch: GraspSolution, tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    (tmp_path / "t.json").write_text(json.dumps({**plan_trajectory(pinch, pincer).to_dict(), **change}))
    with pytest.raises(FileError, match=r"t\.json: " + message):
        Trajectory.load(tmp_path / "t.json")
