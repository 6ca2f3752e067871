"""The sentences name the criterion that decided, the runner-up and the lead; fronts are those of the definition."""

from typing import ClassVar

import numpy as np
import pytest
from candidate_cases import HAND, candidate, touch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clench.scoring import criterion_registry
from clench.scoring.calibration import Calibration
from clench.scoring.choice import choose
from clench.scoring.criterion_types import ScoringContext
from clench.scoring.explaining import explain_choice, pareto_front

CONTEXT = ScoringContext(HAND, np.zeros(2))
CALIBRATION = Calibration(weights={"range_of_motion": 1.0, "limit_distance": 0.5})


def explained(groups, calibration=CALIBRATION):
    return explain_choice(choose(groups, calibration, CONTEXT), groups)


@settings(deadline=None)
@given(arrays(float, st.tuples(st.integers(1, 9), st.integers(1, 3)), elements=st.integers(0, 3).map(float)))
def test_the_front_is_what_nothing_beats(rows):
    def beaten(i):
        return any((other >= rows[i]).all() and (other > rows[i]).any() for other in rows)

    assert pareto_front(rows) == [i for i in range(len(rows)) if not beaten(i)]


def test_the_sentence_names_what_decided_and_by_how_much():
    """0.2 rad less motion is worth 0.2; 0.1 of the range more is worth 0.5 * 0.1 / 0.5 = 0.1."""
    document = explained([[candidate((0.5, 0.0)), candidate((0.3, 0.0), plane=2)]])
    finger = document["fingers"]["index"]
    assert finger["runner_up"] == 0
    assert finger["lead"] == pytest.approx(0.3)
    assert finger["text"] == (
        "plane 2 leads the full width by 0.3; range_of_motion decided it: 0.3 against 0.5 rad, worth 0.2."
    )
    assert document["text"] == (
        "The chosen candidates lead the next best (the full width for index) by 0.3; "
        "range_of_motion decided it: 0.3 against 0.5 rad, worth 0.2."
    )
    assert document["runner_up"]["candidates"] == {"index": 0}
    assert document["criteria"]["limit_distance"]["weight"] == 0.5
    assert document["criteria"]["limit_distance"]["better"] == "more"


def test_a_candidate_that_wins_by_what_it_fulfils_says_so():
    finger = explained([[candidate((0.1, 0.0), feasible=False), candidate((0.5, 0.0), plane=0)]])["fingers"]["index"]
    assert finger["text"] == "plane 0 comes before the full width because it alone may be taken."
    finger = explained([[candidate((0.1, 0.0), touches=()), candidate((0.5, 0.0), plane=0)]])["fingers"]["index"]
    assert finger["text"].endswith("because it alone touches the object.")


def test_one_candidate_and_equal_candidates():
    """Two pairs of joint angles of the same length score the same."""
    assert explained([[candidate()]])["fingers"]["index"]["text"] == "the full width is the only candidate."
    assert "No finger has two candidates" in explained([[candidate()]])["text"]
    motion = Calibration(weights={"range_of_motion": 1.0})
    same = explained([[candidate((0.25, 0.5)), candidate((0.5, 0.25), plane=1)]], motion)
    assert "score the same" in same["fingers"]["index"]["text"]
    assert "scores the same" in same["text"]
    copies = explained([[candidate(), candidate(plane=1)]])
    assert copies["fingers"]["index"]["text"] == "the full width is the only candidate, all others have its angles."
    assert copies["fingers"]["index"]["runner_up"] is None


def test_postures_are_named_where_there_are_several():
    text = explained([[candidate((0.5, 0.0)), candidate((0.3, 0.0), posture=1)]])["fingers"]["index"]["text"]
    assert text.startswith("the full width of posture 1 leads the full width of posture 0")


def test_the_front_of_a_finger_is_among_candidates_that_may_be_taken():
    sets = [
        candidate((0.3, 1.2)),
        candidate((0.5, 0.0)),
        candidate((0.6, 0.0)),
        candidate((0.0, 0.0), feasible=False),
        candidate((0.1, 0.1), touches=(touch(gap=1.0),)),
    ]
    assert explained([sets])["fingers"]["index"]["pareto"] == [1]
    weights = {"range_of_motion": 1.0, "touching_links": 1.0}
    sets[0] = candidate((0.9, 0.0), touches=(touch(), touch(link=2)))
    assert explained([sets], Calibration(weights=weights))["fingers"]["index"]["pareto"] == [0, 1]


def test_a_criterion_of_the_hand_that_overrules_a_finger_is_said(monkeypatch):
    class Far:
        name: ClassVar[str] = "far"
        unit: ClassVar[str] = "rad"
        source: ClassVar[str] = "test"
        scale: ClassVar[float] = 1.0
        larger_is_better: ClassVar[bool] = True

        def score_hand(self, chosen, context):
            return float(chosen[0].travel[0])

    monkeypatch.setattr(criterion_registry, "_registry", {**criterion_registry._registry, "far": Far()})
    groups = [[candidate((0.1, 0.0)), candidate((0.5, 0.0), plane=0)]]
    document = explained(groups, Calibration(weights={"range_of_motion": 1.0, "far": 3.0}))
    assert "by 0.8; far decided it: 0.5 against 0.1 rad, worth 1.2." in document["text"]
    assert document["hand_scores"] == {"far": 0.5}
    assert document["runner_up"]["hand_scores"] == {"far": 0.1}
    assert document["fingers"]["index"]["text"] == (
        "plane 0 is 0.4 behind the full width by itself; with the candidates of the other fingers it is the best."
    )
