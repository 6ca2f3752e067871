"""Confidence is a share of what was counted: monotone, calibrated on its own data, and read with care."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clench
from clench.apps.bench.confidence_bench import ConfidenceBench, Outcome, brier, document, summarise
from clench.base.errors import FileError
from clench.execution.hold import Hold
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


def test_a_table_survives_its_file(tmp_path):
    found = [Outcome("h", str(k % 5), k / 200, k % 3 > 0) for k in range(200)]
    file = tmp_path / "c.json"
    file.write_text(json.dumps(document(found, ConfidenceBench(1, 1, 0, Hold()))))
    read, made = ConfidenceTable.load(file), ConfidenceTable.of([o.score for o in found], [o.held for o in found])
    np.testing.assert_array_equal(read.held, made.held)
    np.testing.assert_array_equal(read.score, made.score)


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


def test_the_brier_score_is_that_of_objects_left_out():
    # Object a always holds and b never does: either one says the wrong thing about the other.
    found = [Outcome("h", name, 0.1, name == "a") for name in "ab" for _ in range(50)]
    assert brier(found) > 0.9
    mixed = [Outcome("h", str(k % 4), 0.1, k % 8 < 4) for k in range(400)]
    assert brier(mixed) == pytest.approx(0.25, abs=0.01)
    assert summarise([]) == {"tried": 0, "held": 0}


def test_the_benchmark_tries_grasps_of_all_scores(tmp_path, capsys):
    from clench.apps.bench.main import main

    out = tmp_path / "c.json"
    arguments = ["confidence", "--objects", "ball", "--proposals", "16", "--grasps", "2", "--out", str(out), "--json"]
    assert main(arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["tried"] == 2
    assert ConfidenceTable.load(out).tried.sum() == 2
    assert clench.__version__ == json.loads(out.read_text())["clench_version"]
