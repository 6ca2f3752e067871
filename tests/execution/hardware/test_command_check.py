"""What may be sent to a controller, and what a state may say: limits, speeds, times, numbers, age."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clench.execution.hardware.command_check import CommandCheck, CommandLimits, slowed_down
from clench.execution.hardware.driver import HandState, JointPath, RefusedCommandError

LIMITS = {"a": CommandLimits(-1.0, 1.0, 2.0, 1.0, "rad"), "b": CommandLimits(0.0, 90.0, 60.0, 57.3, "deg")}
CHECK = CommandCheck(LIMITS, max_age=0.5, max_deviation=0.2)


def path(times: list[float], positions: list[list[float]], joints: tuple[str, ...] = ("a", "b")) -> JointPath:
    return JointPath(joints, np.array(times), np.array(positions), 0.05)


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        (path([0.1], [[0.0, 0.0]], ("a", "c")), "Joint 'c' is none of the controller's joints: a, b"),
        (path([0.1], [[0.0, np.inf]]), "not finite"),
        (path([np.nan], [[0.0, 0.0]]), "not finite"),
        (path([0.2, 0.1], [[0.0, 0.0]] * 2), "times of a command do not rise"),
        (path([0.0], [[0.0, 0.0]]), "times of a command do not rise"),
        (path([0.1], [[0.0]]), "shape"),
        (path([], []), "shape"),
        (path([1.0], [[1.01, 0.0]]), r"'a' would be told 1.01 rad, outside its limits \[-1, 1\] rad"),
        (path([0.1], [[0.3, 0.0]]), r"'a' would be told to move at 3 rad/s; its limit is 2 rad/s"),
        (path([1.0, 1.1], [[0.0, 20.0], [0.0, 27.0]]), r"'b' would be told to move at 70 deg/s; its limit is 60 deg/s"),
    ],
)
def test_wrong_commands_are_refused(sent: JointPath, message: str) -> None:
    with pytest.raises(RefusedCommandError, match=message):
        CHECK.command(sent, {"a": 0.0, "b": 0.0})


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(-3, 3), st.floats(-100, 200)), min_size=1, max_size=6),
    st.floats(-1, 1),
    st.floats(0, 90),
)
def test_what_passes_keeps_every_limit(steps: list[tuple[float, float, float]], a: float, b: float) -> None:
    times = np.cumsum([s[0] for s in steps])
    positions = np.array([s[1:] for s in steps])
    sent = JointPath(("a", "b"), times, positions, 0.05)
    rates = np.abs(np.diff(np.vstack([[a, b], positions]), axis=0)) / np.diff(times, prepend=0.0)[:, None]
    inside = (np.abs(positions[:, 0]) <= 1).all() and (positions[:, 1] >= 0).all() and (positions[:, 1] <= 90).all()
    good = bool(inside and (rates <= [2.0, 60.0]).all())
    near = bool(
        (np.abs(positions[:, 0]) <= 1 + 1e-5).all()
        and (np.abs(positions[:, 1] - 45) <= 45.001).all()
        and (rates <= np.array([2.0, 60.0]) * (1 + 1e-5) + 1e-5).all()
    )
    try:
        CHECK.command(sent, {"a": a, "b": b})
        assert near
    except RefusedCommandError:
        assert not good


def test_states_are_checked() -> None:
    CHECK.state(HandState({"a": 0.0, "b": 1.0, "other": np.nan}, {"other": 9.0}), {"a": 0.1, "b": 0.0})
    with pytest.raises(RefusedCommandError, match="stale"):
        CHECK.state(HandState({"a": 0.0, "b": 0.0}, {"b": np.nan}))
    with pytest.raises(RefusedCommandError, match="'b' does not follow: it is at 20 deg and was told to be at 0 deg"):
        CHECK.state(HandState({"a": 0.0, "b": 20.0}), {"a": 0.0, "b": 0.0})


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.floats(-2, 2), min_size=2, max_size=8), st.floats(0.1, 5))
def test_slowing_down_keeps_the_path_and_the_limit(angles: list[float], speed: float) -> None:
    times = np.arange(len(angles)) * 0.1
    positions = np.array(angles)[:, None]
    slower = slowed_down(times, positions, np.array([speed]))
    assert (slower >= times).all()
    assert (np.abs(np.diff(positions[:, 0])) / np.diff(slower) <= speed * (1 + 1e-9)).all()
    ratio = slower[1:] / times[1:]
    np.testing.assert_allclose(ratio, ratio[0])
