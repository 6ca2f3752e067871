"""Timing under limits: closed forms of a trapezoid, stops at corners, stretching."""

from __future__ import annotations

import numpy as np
import pytest

from clench.core.exceptions import CommandError
from clench.execution.timing import Profile, time_path


def timed(points: list[list[float]], velocity: float = 1.0, acceleration: float = 10.0):
    count = len(points[0])
    return time_path([np.array(points)], np.full(count, velocity), np.full(count, acceleration))


def test_a_short_line_is_a_triangle_and_a_long_one_a_trapezoid() -> None:
    """From rest to rest: 2 sqrt(d / a) where the speed limit is not reached, else d / v + v / a."""
    assert timed([[0.0], [0.05]]).duration == pytest.approx(2.0 * np.sqrt(0.05 / 10.0))
    assert timed([[0.0], [2.0]]).duration == pytest.approx(2.0 / 1.0 + 1.0 / 10.0)


def test_the_joint_nearest_to_its_limit_sets_the_time() -> None:
    path = time_path([np.array([[0.0, 0.0], [1.0, 3.0]])], np.array([1.0, 2.0]), np.array([1e6, 1e6]))
    assert path.duration == pytest.approx(1.5, rel=1e-3)


def test_points_on_a_line_are_no_corners_and_repeated_ones_nothing() -> None:
    assert timed([[0.0, 0.0], [0.3, 0.6], [0.3, 0.6], [1.0, 2.0]]).duration == timed([[0.0, 0.0], [1.0, 2.0]]).duration
    assert timed([[0.4], [0.4]]).duration == 0.0
    np.testing.assert_array_equal(timed([[0.4], [0.4]]).at(1.0), [0.4])


def test_it_stands_still_at_a_corner_and_turns_back() -> None:
    path = timed([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.5]])
    assert len(path.times) == 4
    step = 1e-5
    for k, t in enumerate(path.times):
        np.testing.assert_allclose(path.at(t), path.corners[k], atol=1e-12)
        assert np.abs(path.at(t + step) - path.at(t - step)).max() / (2 * step) < 2e-4


@pytest.mark.parametrize("far", [1e7, 1e300, np.inf, np.nan])
def test_absurd_angles_are_refused(far: float) -> None:
    with pytest.raises(CommandError, match=r"joint angle of .* expected up to 1e\+06"):
        timed([[0.0, 0.0], [1.0, far]])


@pytest.mark.parametrize(("velocity", "acceleration"), [(1e-4, 10.0), (1e-30, 10.0), (1.0, 1e-9), (1e-320, 1e-320)])
def test_motions_without_end_are_refused(velocity: float, acceleration: float) -> None:
    with pytest.raises(CommandError, match=r"The motion would take .* s, more than 3600 s; expected"):
        timed([[0.0], [1.0]], velocity, acceleration)


def test_stretching_is_even() -> None:
    path = timed([[0.0], [1.0]])
    shares = np.array([0.0, 0.3, 1.0])
    np.testing.assert_allclose(path.stretched_at(shares * 7.0, 7.0), path.at(shares * path.duration), atol=1e-12)
    assert {0.0, 7.0} <= set(path.samples(7.0).tolist())


#: Largest speeds and accelerations of a motion of length 1: ramps that just meet, almost none, and almost no cruise.
LIMITS = [(1.0, 10.0), (1.0, 1.0), (1.0, 0.999999), (1.0, 1.000001), (100.0, 3.0), (1e-3, 1e3), (2.0, 4.0), (1e4, 1e-3)]


@pytest.mark.parametrize(("velocity", "acceleration"), LIMITS)
def test_a_profile_is_the_fastest_motion_inside_its_limits(velocity: float, acceleration: float) -> None:
    profile = Profile.fastest(velocity, acceleration)
    # The least time from rest to rest over a way of 1, by the area under the speed.
    triangle = velocity**2 >= acceleration
    least = 2.0 / np.sqrt(acceleration) if triangle else 1.0 / velocity + velocity / acceleration
    assert profile.duration == pytest.approx(least, rel=1e-14)
    times = np.linspace(0.0, profile.duration, 4001)
    places = profile.at(times)
    speeds = np.diff(places) / np.diff(times)
    changes = np.diff(speeds) / np.diff(times)[1:]
    assert (places[0], places[-1]) == (0.0, 1.0)
    assert speeds.min() >= 0.0
    assert speeds.max() <= velocity * (1.0 + 1e-9)
    assert np.abs(changes).max() <= acceleration * (1.0 + 1e-6) + 1e-9 * speeds.max() / np.diff(times)[0]
    # One of the two limits binds nearly always.
    binds = (np.abs(changes) > 0.999 * acceleration) | (speeds[1:] > 0.999 * velocity)
    assert binds.mean() > 0.999
    # The motion is the same backwards.
    np.testing.assert_allclose(places, 1.0 - places[::-1], atol=1e-12)


def test_a_profile_stands_still_before_and_after() -> None:
    profile = Profile.fastest(1.0, 10.0)
    assert profile.at([-1.0, 0.0, profile.duration, 99.0]).tolist() == [0.0, 0.0, 1.0, 1.0]
    assert profile.at(0.5 * profile.duration) == pytest.approx(0.5, rel=1e-15)
