"""The benchmark of confidence: what it writes is read as it was, and objects are judged by tables without them."""

import json

import numpy as np
import pytest

import clench
from benchmarks.bench_commands import main
from benchmarks.holding.confidence_bench import ConfidenceBench, Outcome, brier, document, summarise
from clench.execution.simulation.hold import Hold
from clench.planner.confidence import ConfidenceTable


def test_a_table_survives_its_file(tmp_path):
    found = [Outcome("h", str(k % 5), k / 200, k % 3 > 0) for k in range(200)]
    file = tmp_path / "c.json"
    file.write_text(json.dumps(document(found, ConfidenceBench(1, 1, 0, Hold()))))
    read, made = ConfidenceTable.load(file), ConfidenceTable.of([o.score for o in found], [o.held for o in found])
    np.testing.assert_array_equal(read.held, made.held)
    np.testing.assert_array_equal(read.score, made.score)


def test_the_brier_score_is_that_of_objects_left_out():
    # Object a always holds and b never does: either one says the wrong thing about the other.
    found = [Outcome("h", name, 0.1, name == "a") for name in "ab" for _ in range(50)]
    assert brier(found) > 0.9
    mixed = [Outcome("h", str(k % 4), 0.1, k % 8 < 4) for k in range(400)]
    assert brier(mixed) == pytest.approx(0.25, abs=0.01)
    assert summarise([]) == {"tried": 0, "held": 0}


def test_the_benchmark_tries_grasps_of_all_scores(tmp_path, capsys):
    out = tmp_path / "c.json"
    arguments = ["confidence", "--object", "ball", "--proposals", "16", "--grasps", "2", "--out", str(out), "--json"]
    assert main(arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["tried"] == 2
    assert ConfidenceTable.load(out).tried.sum() == 2
    assert clench.__version__ == json.loads(out.read_text())["clench_version"]
