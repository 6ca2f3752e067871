"""Confidence is a share of what was counted: monotone, calibrated on its own data, and read with care."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import FileError
from clench.planner.confidence import LEVEL, ConfidenceTable, shipped_table

OUTCOMES = st.lists(st.tuples(st.floats(0.0, 1.0), st.booleans()), min_size=1, max_size=400)


@given(OUTCOMES)
@settings(max_examples=100, deadline=None)
def test_levels_count_every_grasp_once_and_never_fall(found):
    table = ConfidenceTable.of([s for s, _ in found], [h for _, h in found])
    assert table.tried.sum() == len(found)
    assert table.held.sum() == sum(held for _, held in found)
    assert (np.diff(table.held / table.tried) > -1e-12).all()
    said = [table.confidence(score) for score in np.linspace(-0.5, 1.5, 50)]
    assert (np.array(said) > 0.0).all()
    assert (np.array(said) < 1.0).all()


def test_a_table_finds_a_known_share():
    rng = np.random.default_rng(3)
    scores = rng.uniform(0.0, 1.0, 20_000)
    table = ConfidenceTable.of(scores.tolist(), (rng.random(20_000) < scores**2).tolist())
    for score in (0.2, 0.5, 0.8):
        assert table.confidence(score) == pytest.approx(score**2, abs=0.07)
    assert len(table.score) > 20_000 / LEVEL / 40


def test_the_shipped_table_is_read_and_every_grasp_has_its_confidence(plan):
    table = shipped_table()
    assert table.tried.sum() >= 100
    for grasp in plan:
        assert grasp.confidence == table.confidence(grasp.score)
        assert grasp.to_dict()["confidence"] == grasp.confidence


@pytest.mark.parametrize(
    "content",
    [
        "[]",
        '{"schema": "clench.confidence/1", "levels": []}',
        '{"schema": "clench.confidence/2", "levels": [{"score": 0.1, "tried": 1, "held": 1}]}',
        '{"schema": "clench.confidence/1", "levels": [{"score": 0.1, "tried": 1, "held": 2}]}',
        '{"schema": "clench.confidence/1", "levels": [{"score": 0.1, "tried": 1}]}',
        '{"schema": "clench.confidence/1", "levels": [{"score": "x", "tried": 1, "held": 1}]}',
    ],
)
def test_what_is_no_table_is_refused(tmp_path, content):
    file = tmp_path / "c.json"
    file.write_text(content)
    with pytest.raises(FileError, match="levels"):
        ConfidenceTable.load(file)
