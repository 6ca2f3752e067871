"""Criteria of a finger's set give numbers with a unit, a direction and a source."""

from dataclasses import replace

import numpy as np
import pytest
from candidate_cases import HAND, candidate, touch

from clench.models.hand.hand import DEFAULT_SPEED
from clench.scoring.criterion_registry import criterion_names, find_criterion
from clench.scoring.criterion_types import ScoringContext

START = np.array([0.1, 0.0])


def score(name, c, **changes):
    return find_criterion(name, "test").score(c, ScoringContext(HAND, START, **changes))


def test_every_criterion_says_what_it_is():
    for name in criterion_names():
        criterion = find_criterion(name, "test")
        assert criterion.name == name
        assert criterion.unit
        assert criterion.source
        assert criterion.scale > 0.0
        assert isinstance(criterion.larger_is_better, bool)


def test_range_of_motion_sums_over_the_fingers_joints():
    assert score("range_of_motion", candidate((0.3, 0.4))) == pytest.approx(0.2 + 0.4)


def test_range_of_motion_weighs_joints():
    weights = np.array([3.0, 0.5])
    assert score("range_of_motion", candidate((0.3, 0.4)), joint_weights=weights) == pytest.approx(0.6 + 0.2)


def test_touching_links_counts_links_that_still_touch_the_object():
    touches = (touch(), touch(joint=1), touch(link=2, gap=2e-6), touch(link=2, graspable=False))
    assert score("touching_links", candidate(touches=touches)) == 1.0
    assert score("touching_links", candidate(touches=(touch(), touch(link=2)))) == 2.0
    assert score("touching_links", candidate(touches=())) == 0.0


def test_limit_distance_is_the_nearest_as_a_fraction_of_the_range():
    """Limits are -0.5 and 1.5 rad; the second joint has 0.3 rad left of 2."""
    assert score("limit_distance", candidate((0.3, 1.2))) == pytest.approx(0.15)


def test_the_next_step_takes_the_time_of_the_slowest_joint():
    fast = replace(HAND, joints=(replace(HAND.joints[0], velocity=10.0), HAND.joints[1]))
    c = candidate((0.3, 0.4))
    context = ScoringContext(fast, START, steps=(np.array([1.3, 0.2]),))
    assert find_criterion("next_step_time", "test").score(c, context) == pytest.approx(
        max(1.0 / 10.0, 0.2 / DEFAULT_SPEED)
    )
    assert find_criterion("next_step_distance", "test").score(c, context) == pytest.approx(1.2)


def test_steps_follow_each_other_and_leave_joints_alone_that_they_do_not_name():
    steps = (np.array([1.3, np.nan]), np.array([np.nan, 0.1]))
    c = candidate((0.3, 0.4))
    assert score("next_step_distance", c, steps=steps) == pytest.approx(1.0 + 0.3)
    assert score("next_step_time", c, steps=steps) == pytest.approx((1.0 + 0.3) / DEFAULT_SPEED)


def test_criteria_say_nothing_where_nothing_is_known():
    for name in ("next_step_time", "next_step_distance", "pad_indentation"):
        assert score(name, candidate()) is None


def test_pad_indentation_is_the_measured_depth():
    assert score("pad_indentation", candidate(penetration=4e-4)) == 4e-4
