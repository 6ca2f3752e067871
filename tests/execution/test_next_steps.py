"""What comes after the touch: where the steps say, under the limits, coupled; refused before anything moves."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clench.core.exceptions import CommandError, UnknownNameError
from clench.execution.next_steps import Phase, moved_joints, plan_after_touch, plan_next_steps, squeeze_offsets
from clench.execution.timing import ACCELERATION
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import DEFAULT_SPEED, Coupling, Hand
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

VELOCITY = np.array([3.0, DEFAULT_SPEED, 1.0])
PACE = VELOCITY, np.full(3, ACCELERATION)
OFFSETS = {"thumb": 0.05, "index": 0.03, "index_tip": 0.03}


def stepping(pinch: GraspSolution, *steps: dict[str, float], squeezed: bool = False) -> GraspSolution:
    plan = {"feasible": True, "text": "Holds.", "offsets": OFFSETS} if squeezed else None
    return replace(pinch, next_steps=steps, squeeze=plan)


def planned(pinch: GraspSolution, hand: Hand, *steps: dict[str, float]) -> tuple[Phase, ...]:
    return plan_next_steps(stepping(pinch, *steps), hand, posture(pinch.joint_angles, hand, "joint_angles"), PACE)


def test_a_joint_goes_there_as_fast_as_its_limits_allow(pincer: Hand, pinch: GraspSolution) -> None:
    """From rest to rest a distance d takes 2 sqrt(d / a) where the speed limit is not reached."""
    touch = posture(pinch.joint_angles, pincer, "joint_angles")
    (phase,) = planned(pinch, pincer, {"thumb": 0.0})
    assert phase.duration == pytest.approx(2.0 * np.sqrt(touch[0] / ACCELERATION))
    np.testing.assert_array_equal(phase.positions[0], touch)
    np.testing.assert_array_equal(phase.positions[-1], [0.0, *touch[1:]])
    np.testing.assert_array_equal(phase.positions[:, 1:], np.tile(touch[1:], (len(phase.times), 1)))
    half = 0.5 * phase.duration
    assert phase.at(half)[0] == pytest.approx(0.5 * touch[0], rel=1e-2)
    assert [phase.share_at(t) for t in (-1.0, 0.0, 2.0 * phase.duration)] == [0.0, 0.0, 1.0]
    assert phase.share_at(half) == pytest.approx(0.5, abs=1e-2)


def test_steps_follow_each_other_and_leave_alone_what_they_do_not_name(pincer: Hand, pinch: GraspSolution) -> None:
    touch = posture(pinch.joint_angles, pincer, "joint_angles")
    phases = planned(pinch, pincer, {"thumb": 0.1}, {"index": 0.4}, {})
    assert [phase.step for phase in phases] == [0, 1, 2]
    np.testing.assert_array_equal(phases[0].positions[-1], [0.1, *touch[1:]])
    np.testing.assert_array_equal(phases[1].positions[0], phases[0].positions[-1])
    np.testing.assert_array_equal(phases[1].positions[-1], [0.1, 0.4, 0.4])
    assert phases[2].duration == 0.0
    np.testing.assert_array_equal(phases[2].positions, [[0.1, 0.4, 0.4]])
    assert phases[2].share_at(0.0) == 1.0


def test_followers_go_with_their_leaders_and_have_no_say(pincer: Hand, pinch: GraspSolution) -> None:
    (phase,) = planned(pinch, pincer, {"index": 1.0, "index_tip": 0.1})
    np.testing.assert_allclose(phase.positions[:, 2], phase.positions[:, 1], atol=1e-12)
    assert phase.positions[-1, 2] == 1.0
    (alone,) = planned(pinch, pincer, {"index_tip": 0.1})
    assert alone.duration == 0.0
    assert moved_joints(pincer, {"index": 0.0}) == (1, 2)
    assert moved_joints(pincer, {"index_tip": 0.0, "thumb": 0.0}) == (0,)


def test_a_follower_waits_at_its_limit(pincer: Hand, pinch: GraspSolution) -> None:
    short = replace(pincer, joints=(*pincer.joints[:2], replace(pincer.joints[2], upper=0.6)))
    (phase,) = planned(pinch, short, {"index": 1.1})
    np.testing.assert_allclose(phase.positions[:, 2], np.minimum(phase.positions[:, 1], 0.6), atol=2e-3)
    np.testing.assert_array_equal(phase.positions[-1, 1:], [1.1, 0.6])


def test_a_follower_that_broke_away_is_taken_along_again(pincer: Hand, pinch: GraspSolution) -> None:
    hand = replace(pincer, couplings=(Coupling(1, 2, 1.0, 0.0, breakaway=True),))
    away = replace(pinch, joint_angles={**pinch.joint_angles, "index": 0.1, "index_tip": 0.5})
    (phase,) = planned(away, hand, {"index": 0.0})
    np.testing.assert_array_equal(phase.positions[-1, 1:], 0.0)
    assert (np.diff(phase.positions[:, 2]) <= 0.0).all()


angles = st.fixed_dictionaries({}, optional={"thumb": st.floats(0.0, 1.5), "index": st.floats(0.0, 1.2)})


@settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(angles, min_size=1, max_size=3), st.booleans())
def test_paths_are_inside_the_limits_and_no_faster_than_allowed(
    pincer: Hand, pinch: GraspSolution, steps: list[dict[str, float]], squeezed: bool
) -> None:
    phases = plan_after_touch(stepping(pinch, *steps, squeezed=squeezed), pincer, PACE)
    at = posture(pinch.joint_angles, pincer, "joint_angles")
    for phase in phases:
        np.testing.assert_array_equal(phase.positions[0], at)
        at = phase.positions[-1]
        low, high = np.minimum(phase.positions[0], at), np.maximum(phase.positions[0], at)
        assert ((phase.positions >= low - 1e-12) & (phase.positions <= high + 1e-12)).all()
        if phase.duration == 0.0:
            continue
        assert (np.diff(phase.times) > 0.0).all()
        rates = np.diff(phase.positions, axis=0) / np.diff(phase.times)[:, None]
        assert (np.abs(rates) <= VELOCITY * (1.0 + 1e-9)).all()
        between = 0.5 * (phase.times[2:] - phase.times[:-2])[:, None]
        assert (np.abs(np.diff(rates, axis=0)) <= ACCELERATION * between * (1.0 + 1e-6) + 1e-9).all()
    named = {name: angle for step in steps for name, angle in step.items()}
    for j, name in enumerate(("thumb", "index")):
        told = pinch.joint_angles[name] + (OFFSETS[name] if squeezed else 0.0)
        assert at[j] == pytest.approx(named.get(name, told), abs=3e-9)


def test_fingers_that_no_step_moves_go_on_squeezing(pincer: Hand, pinch: GraspSolution) -> None:
    squeeze, step = plan_after_touch(stepping(pinch, {"thumb": 0.0}, squeezed=True), pincer, PACE)
    touch = posture(pinch.joint_angles, pincer, "joint_angles")
    assert (squeeze.name, squeeze.step, squeeze.duration) == ("squeeze", None, pytest.approx(0.4))
    np.testing.assert_allclose(squeeze.positions[-1] - touch, [0.05, 0.03, 0.03])
    np.testing.assert_array_equal(step.positions[:, 1:], np.tile(squeeze.positions[-1, 1:], (len(step.times), 1)))
    assert step.positions[-1, 0] == 0.0


@pytest.mark.parametrize(
    "plan",
    [None, {}, {"feasible": False, "offsets": OFFSETS}, {"feasible": True, "offsets": {**OFFSETS, "thumb": 2.0}}],
)
def test_what_is_no_plan_that_can_be_told_squeezes_nothing(
    pincer: Hand, pinch: GraspSolution, plan: dict[str, object] | None
) -> None:
    assert not squeeze_offsets(replace(pinch, squeeze=plan), pincer).any()


def test_a_trajectory_ends_with_its_steps_in_the_file_too(pincer: Hand, pinch: GraspSolution, tmp_path: Path) -> None:
    solution = stepping(pinch, {"thumb": 0.2}, {"thumb": 0.0, "index": 0.0}, squeezed=True)
    trajectory = plan_trajectory(solution, pincer, speed=0.5, acceleration=5.0)
    alone = plan_trajectory(pinch, pincer, speed=0.5, acceleration=5.0)
    np.testing.assert_array_equal(trajectory.positions, alone.positions)
    assert trajectory.duration == alone.duration
    trajectory.save(tmp_path / "t.json")
    points = json.loads((tmp_path / "t.json").read_text())["points"]
    assert (np.diff([p["time"] for p in points]) > 0.0).all()
    order = list(dict.fromkeys((p["phase"], p.get("step")) for p in points))
    assert order == [
        ("open", None),
        ("closing", None),
        ("touch", None),
        ("squeeze", None),
        *(("next step", k) for k in (0, 1)),
    ]
    assert points[-1]["positions"] == [0.0, 0.0, 0.0]
    total = trajectory.duration + sum(phase.duration for phase in trajectory.after)
    assert points[-1]["time"] == pytest.approx(total)
    rates = np.diff([p["positions"] for p in points], axis=0) / np.diff([p["time"] for p in points])[:, None]
    assert (np.abs(rates) <= 0.5 * VELOCITY * (1.0 + 1e-9)).all()
    loaded = Trajectory.load(tmp_path / "t.json")
    assert (loaded.speed, loaded.acceleration) == (0.5, 5.0)
    assert len(loaded.after) == 3
    for read, phase in zip(loaded.after, trajectory.after, strict=True):
        assert (read.name, read.step) == (phase.name, phase.step)
        np.testing.assert_allclose(read.times, phase.times, atol=1e-12)
        np.testing.assert_array_equal(read.positions, phase.positions)


def test_without_next_steps_a_trajectory_ends_at_the_touch(pincer: Hand, pinch: GraspSolution) -> None:
    trajectory = plan_trajectory(stepping(pinch, squeezed=True), pincer)
    assert trajectory.after == ()
    assert trajectory.to_dict()["points"][-1]["phase"] == "touch"


def test_steps_that_a_hand_cannot_take_are_refused(pincer: Hand, pinch: GraspSolution) -> None:
    with pytest.raises(UnknownNameError, match=r"Joint 'toe' is not in hand 'pincer'"):
        plan_trajectory(stepping(pinch, {"toe": 0.1}), pincer)
    with pytest.raises(CommandError, match=r"next_steps\[1\]\.thumb: 1.6 rad is outside the joint's limits \[0, 1.5\]"):
        plan_trajectory(stepping(pinch, {}, {"thumb": 1.6}), pincer)
    with pytest.raises(CommandError, match=r"next_steps\[0\]\.thumb: expected a number in rad that is finite, got nan"):
        plan_trajectory(stepping(pinch, {"thumb": np.nan}), pincer)
