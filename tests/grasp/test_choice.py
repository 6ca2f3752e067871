"""The choice: what may not be taken comes last, then what touches, then the weighted scores."""

import itertools

import pytest
from candidate_cases import candidate, touch

from clench.grasp.choice import choose

WEIGHTS = {"range_of_motion": 1.0}


def scored(value, **changes):
    return candidate(scores={"range_of_motion": value}, **changes)


def test_the_best_score_wins_and_ties_go_to_the_full_width_then_to_the_first():
    assert choose([scored(0.5, plane=0), scored(0.2, plane=1), scored(0.4)], WEIGHTS) == 1
    assert choose([scored(0.2, plane=0), scored(0.2)], WEIGHTS) == 1
    assert choose([scored(0.2, plane=0), scored(0.2, plane=1)], WEIGHTS) == 0


def test_a_set_known_to_be_infeasible_is_never_chosen_before_one_that_is_not():
    deep = scored(0.0, plane=0, feasible=False)
    assert choose([deep, scored(9.0, touches=())], WEIGHTS) == 1
    assert choose([deep, scored(9.0, plane=1, feasible=None)], WEIGHTS) == 1
    assert choose([deep], WEIGHTS) == 0


def test_one_that_touches_goes_before_one_that_does_not():
    assert choose([scored(0.0, touches=()), scored(9.0)], WEIGHTS) == 1
    gone = (touch(gap=1e-3),)
    assert choose([scored(0.0, touches=gone), scored(9.0)], WEIGHTS) == 1
    wall = (touch(graspable=False),)
    assert choose([scored(0.0, touches=wall), scored(9.0)], WEIGHTS) == 1


def test_one_that_passes_through_nothing_goes_before_one_that_does():
    assert choose([scored(0.0, plane=0), scored(9.0, clear=True)], WEIGHTS) == 1


@pytest.mark.parametrize("order", itertools.permutations(range(4)))
def test_the_choice_does_not_depend_on_the_order(order):
    sets = [
        scored(0.1, plane=0, feasible=False),
        scored(0.2, plane=1, touches=(), clear=True),
        scored(0.3, plane=2, clear=True),
        scored(0.4, clear=True),
    ]
    assert order[choose([sets[i] for i in order], WEIGHTS)] == 2
