"""The choice: what may not be taken comes last, then what touches, then the weighted scores."""

import itertools
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from candidate_cases import HAND, candidate, touch
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.scoring import criterion_registry
from clench.scoring.calibration import Calibration
from clench.scoring.choice import choose
from clench.scoring.criterion_types import ScoringContext
from clench.scoring.explaining import explain_choice

CONTEXT = ScoringContext(HAND, np.zeros(2))
CALIBRATION = Calibration(weights={"range_of_motion": 1.0})


def moved(value, **changes):
    """Return a set with a range of motion."""
    return candidate((value, 0.0), **changes)


def chosen(sets, calibration=CALIBRATION):
    return choose([sets], calibration, CONTEXT).chosen[0]


def test_the_best_score_wins_and_ties_go_to_the_full_width_then_to_the_first():
    assert chosen([moved(0.5, plane=0), moved(0.2, plane=1), moved(0.4)]) == 1
    assert chosen([moved(0.2, plane=0), moved(0.2)]) == 1
    assert chosen([moved(0.2, plane=0), moved(0.2, plane=1)]) == 0


def test_a_candidate_known_to_be_infeasible_is_never_chosen_before_one_that_is_not():
    deep = moved(0.0, plane=0, feasible=False)
    assert chosen([deep, moved(1.0, touches=())]) == 1
    assert chosen([deep, moved(1.0, plane=1, feasible=None)]) == 1
    assert chosen([deep]) == 0


def test_one_that_touches_goes_before_one_that_does_not():
    assert chosen([moved(0.0, touches=()), moved(1.0)]) == 1
    gone = (touch(gap=1e-3),)
    assert chosen([moved(0.0, touches=gone), moved(1.0)]) == 1
    wall = (touch(graspable=False),)
    assert chosen([moved(0.0, touches=wall), moved(1.0)]) == 1


def test_where_only_fingertips_count_one_that_touches_with_another_link_first_comes_after_one_that_does_not():
    tip = HAND.fingers[0].tip_link
    first = candidate((0.1, 0.1), touches=(touch(link=1), touch(link=tip)))
    second = candidate((0.9, 0.9), touches=(touch(link=tip), touch(link=1)))
    assert tip != 1
    assert chosen([first, second]) == 0
    assert choose([[first, second]], CALIBRATION, replace(CONTEXT, tip_only=True)).chosen == [1]


def test_one_that_passes_through_nothing_goes_before_one_that_does():
    assert chosen([moved(0.0, plane=0), moved(1.0, clear=True)]) == 1


def test_one_outside_a_limit_comes_after_those_inside():
    limited = Calibration(weights={"limit_distance": 1.0}, limits={"range_of_motion": 0.5})
    far, near = moved(0.1), moved(0.6)
    assert chosen([near, far], Calibration(limits={"range_of_motion": 0.5})) == 1
    assert chosen([moved(0.6), moved(0.7)], limited) == 0


def test_candidates_that_a_criterion_says_nothing_about_come_after_those_it_does():
    calibration = Calibration(weights={"pad_indentation": 1.0, "range_of_motion": 1.0})
    assert chosen([moved(0.0), moved(1.0, penetration=1e-4)], calibration) == 1
    choice = choose([[moved(0.0), moved(1.0)]], calibration, CONTEXT)
    assert choice.chosen == [0]
    assert choice.used == ("range_of_motion",)
    assert choice.unused == ("pad_indentation",)


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))))
def test_the_choice_does_not_depend_on_the_order(order):
    sets = [
        moved(0.1, plane=0, feasible=False),
        moved(0.2, plane=1, touches=(), clear=True),
        moved(0.3, plane=2, clear=True),
        moved(0.4, clear=True),
    ]
    assert order[chosen([sets[i] for i in order])] == 2


angles = st.integers(0, 150).map(lambda hundredths: hundredths / 100)
travels = st.lists(st.tuples(angles, angles), min_size=1, max_size=8, unique=True)


@settings(deadline=None)
@given(travels, st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_more_weight_never_worsens_what_it_is_given_to(pairs, less, more):
    """With w larger, the chosen set has no larger range of motion: the sum is linear in the weight."""
    less, more = sorted([less, more])
    sets = [candidate(pair) for pair in pairs]

    def motion(weight):
        c = Calibration(weights={"range_of_motion": weight, "limit_distance": 1.0})
        return sets[chosen(sets, c)].scores["range_of_motion"]

    assert motion(more) <= motion(less) + 1e-9


@settings(deadline=None)
@given(st.lists(travels, min_size=1, max_size=3))
def test_additive_criteria_choose_as_exhaustive_search_does(groups):
    calibration = Calibration(weights={"range_of_motion": 0.7, "limit_distance": 2.0})
    sets = [[candidate(pair) for pair in pairs] for pairs in groups]
    choice = choose(sets, calibration, CONTEXT)

    def total(places):
        return sum(
            calibration.worth(name, group[i].scores[name])
            for group, i in zip(sets, places, strict=True)
            for name in ("range_of_motion", "limit_distance")
        )

    totals = sorted((total(p) for p in itertools.product(*(range(len(g)) for g in sets))), reverse=True)
    assert choice.total == pytest.approx(totals[0], abs=1e-12)
    assert total(choice.chosen) == pytest.approx(totals[0], abs=1e-12)
    if len(totals) > 1:
        assert choice.runner_up.total == pytest.approx(totals[1], abs=1e-12)


class Together:
    """Fingers are best when they have moved by the same."""

    name: ClassVar[str] = "together"
    unit: ClassVar[str] = "rad"
    source: ClassVar[str] = "test"
    scale: ClassVar[float] = 1.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen, context):
        moved = [c.travel[0] for c in chosen]
        return float(max(moved) - min(moved))


@pytest.fixture
def together(monkeypatch):
    monkeypatch.setattr(criterion_registry, "_registry", {**criterion_registry._registry, "together": Together()})


def test_a_criterion_of_the_hand_outweighs_the_fingers_own(together):
    sets = [[moved(0.1), moved(0.5)], [moved(0.5), moved(0.6)]]
    weights = {"range_of_motion": 1.0, "together": 0.5}
    alone = choose(sets, Calibration(weights=weights), CONTEXT)
    assert alone.chosen == [0, 0]
    choice = choose(sets, Calibration(weights={**weights, "together": 2.0}), CONTEXT)
    assert choice.chosen == [1, 0]
    assert choice.hand_scores == {"together": 0.0}
    assert choice.used == ("range_of_motion", "together")
    assert choice.tried == 4


def test_a_limit_on_a_criterion_of_the_hand_holds(together):
    sets = [[moved(0.1), moved(0.5)], [moved(0.5), moved(0.6)]]
    limited = Calibration(weights={"range_of_motion": 1.0}, limits={"together": 0.15})
    assert choose(sets, limited, CONTEXT).chosen == [1, 0]


def test_a_search_that_ends_without_a_proof_says_so(together):
    """Nothing bounds this criterion, and 8³ combinations are more than are all tried."""
    weights = Calibration(weights={"range_of_motion": 1.0, "together": 0.5})
    sets = [[moved(0.1 * k + 0.01 * n) for k in range(8)] for n in range(3)]
    many, few = choose(sets, weights, CONTEXT), choose([group[:3] for group in sets], weights, CONTEXT)
    assert (many.proved, few.proved) == (False, True)
    assert few.tried == 27
    assert explain_choice(many, sets)["text"].endswith(
        f" The search tried {many.tried} of 512 combinations: one that is better may exist."
    )
