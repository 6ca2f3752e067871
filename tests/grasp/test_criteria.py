"""Criteria give numbers with a unit and a direction; weights are checked; users add their own."""

from typing import ClassVar

import numpy as np
import pytest
from candidate_cases import HAND, candidate, touch

from clench.base.errors import CommandError, UnknownNameError
from clench.grasp import criteria
from clench.grasp.criteria import Setting, check_weights, criterion_names, register, score_all, weigh

SETTING = Setting(HAND, np.array([0.1, 0.0]))


def test_range_of_motion_sums_over_the_fingers_joints():
    assert score_all(candidate((0.3, 0.4)), SETTING)["range_of_motion"] == pytest.approx(0.2 + 0.4)


def test_touching_links_counts_links_that_still_touch_the_object():
    touches = (touch(), touch(joint=1), touch(link=2, gap=2e-6), touch(link=2, graspable=False))
    assert score_all(candidate(touches=touches), SETTING)["touching_links"] == 1.0
    assert score_all(candidate(touches=(touch(), touch(link=2))), SETTING)["touching_links"] == 2.0
    assert score_all(candidate(touches=()), SETTING)["touching_links"] == 0.0


def test_limit_distance_is_the_nearest_as_a_fraction_of_the_range():
    """Limits are -0.5 and 1.5 rad; the second joint has 0.3 rad left of 2."""
    assert score_all(candidate((0.3, 1.2)), SETTING)["limit_distance"] == pytest.approx(0.15)


def test_weights_follow_direction_and_scale():
    scores = {"range_of_motion": 2.0, "touching_links": 3.0, "limit_distance": 0.25}
    assert weigh(scores, {"range_of_motion": 1.0, "touching_links": 2.0}) == pytest.approx(-2.0 + 6.0)
    assert weigh(scores, {"limit_distance": 1.0}) == pytest.approx(0.5)
    assert weigh(scores, {}) == 0.0


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf")])
def test_bad_weights_are_refused_with_their_place(weight):
    with pytest.raises(CommandError, match=r"criteria\.touching_links.*at least 0"):
        check_weights({"touching_links": weight}, "criteria")


def test_unknown_criteria_are_refused_with_those_that_exist():
    with pytest.raises(UnknownNameError, match="touching_links"):
        check_weights({"touching_link": 1.0}, "criteria")


def test_a_users_criterion_is_scored_and_weighed(monkeypatch):
    class Gentle:
        name: ClassVar[str] = "gentle"
        unit: ClassVar[str] = "rad"
        scale: ClassVar[float] = 2.0
        larger_is_better: ClassVar[bool] = False

        def score(self, candidate, setting):
            return float(candidate.travel.max())

    monkeypatch.setattr(criteria, "_REGISTRY", dict(criteria._REGISTRY))
    register(Gentle())
    assert "gentle" in criterion_names()
    scores = score_all(candidate((0.3, 0.4)), SETTING)
    assert scores["gentle"] == 0.4
    assert weigh(scores, {"gentle": 1.0}) == pytest.approx(-0.2)
