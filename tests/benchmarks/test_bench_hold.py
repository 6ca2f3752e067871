"""The benchmark of holding: its statistics against closed forms and counting, a small run, its errors."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from benchmarks.holding.proportions import roc_auc, wilson
from clench.apps.cli.main import main


@pytest.mark.parametrize(("yes", "count"), [(0, 10), (3, 10), (10, 10), (281, 400)])
def test_interval_of_a_proportion(yes: int, count: int) -> None:
    expected = binomtest(yes, count).proportion_ci(method="wilson")
    np.testing.assert_allclose(wilson(yes, count), (expected.low, expected.high), atol=1e-12)


def test_nothing_counted_says_nothing() -> None:
    assert wilson(0, 0) == (0.0, 1.0)


def test_area_under_the_curve_counts_pairs() -> None:
    rng = np.random.default_rng(3)
    scores, yes = rng.integers(0, 5, 40).astype(float), rng.random(40) < 0.4
    pairs = [(a > b) + 0.5 * (a == b) for a in scores[yes] for b in scores[~yes]]
    assert roc_auc(scores, yes) == pytest.approx(np.mean(pairs))
    assert roc_auc([1.0, 2.0], [False, True]) == 1.0
    assert roc_auc([1.0, 2.0], [True, False]) == 0.0
    assert roc_auc([1.0, 2.0], [True, True]) is None


def run(capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, object]:
    assert main(["bench", "hold", "--object", "ball", "--json", *options]) == 0
    document: dict[str, object] = json.loads(capsys.readouterr().out)
    return document


def test_the_best_of_a_few_hold_and_the_table_says_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = ("--table", str(tmp_path / "table.md"), "--trials", str(tmp_path / "trials.json"))
    options = ("--proposals", "64", "--best", "1", "--others", "1", *files)
    found = run(capsys, *options)
    case = {key.removeprefix("robonaut2.ball."): value for key, value in found.items() if key.startswith("robonaut2.")}
    assert (case["tried"], case["held"], case["held_5mm_5deg"]) == (1, 1, 1)
    assert case["held_interval"] == "21-100 %"
    assert case["proposed"] == 64
    assert 0 < int(str(case["force_closed"])) <= int(str(case["closed"])) <= 64
    assert (case["grasps"], case["score_trials"]) == (3, 2)
    assert float(str(case["closing_motion_max_mm"])) < 0.5
    assert float(str(case["touch_spread_max_ms"])) <= 5.0
    assert float(str(case["penetration_max_um"])) <= 10.0
    assert case["self_penetration_max_um"] == 0.0
    assert (case["outcome_held"], case["power_tried"], case["power_held"]) == (1, 1, 1)
    kept = json.loads((tmp_path / "trials.json").read_text())
    assert kept["schema"] == "clench.hold-trials/2"
    assert (kept["trials"][0]["outcome"], kept["trials"][0]["grasp_kind"]) == ("held", "power")
    lines = (tmp_path / "table.md").read_text().splitlines()
    assert lines[2].startswith("| robonaut2 | ball | 1 | 1 | 21-100 % |")
    assert len({line.count("|") for line in lines}) == 1
    assert run(capsys, *options) == found


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--proposals", "0"], "--proposals: expected at least 1, got 0"),
        (["--best", "0"], "--best: expected at least 1"),
        (["--others", "-1"], "--others: expected at least 0"),
        (["--mass", "-1"], "hold: mass: expected a finite number of at least 0.001 kg, got -1.0"),
        (["--object", "cup"], "cup"),
        (["--table", "nowhere/t.md"], "no folder 'nowhere'"),
    ],
)
def test_bad_options(capsys: pytest.CaptureFixture[str], options: list[str], message: str) -> None:
    assert main(["bench", "hold", *options]) == 2
    assert message in capsys.readouterr().err
