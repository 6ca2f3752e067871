"""Examples are read from scores and from solves of a record; what is wrong is named by its key."""

from __future__ import annotations

import json
import sqlite3
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from clench.apps.cli.main import main
from clench.core.exceptions import FileError, UnknownNameError
from clench.scoring.calibration import Calibration, load_calibration
from clench.solver.analysis import record as record_module
from clench.solver.analysis.examples import SCHEMA, read_examples, recorded_outcomes, solve_scores
from clench.solver.analysis.record import Record
from handmade import make_candidate, make_solution


def write(folder: Path, **content: Any) -> Path:
    path = folder / "examples.json"
    path.write_text(json.dumps({"schema": SCHEMA, **content}))
    return path


def scores(motion: float, links: float = 1.0) -> dict[str, Any]:
    return {"scores": {"range_of_motion": motion, "touching_links": links}}


@pytest.fixture
def record(tmp_path: Path) -> Path:
    path = tmp_path / "r.sqlite"
    with Record(path) as made:
        made.append(make_solution(choice={"final_hand_scores": {"epsilon": 0.2}}))
        made.append(make_solution())
    return path


def test_scores_become_signed_and_scaled_numbers(tmp_path: Path) -> None:
    pairs = [{"better": scores(1.0, 2.0), "worse": {"scores": {"range_of_motion": 3.0}}}]
    found = read_examples(write(tmp_path, pairs=pairs, outcomes=[{"of": scores(0.5), "held": False}]))
    numbers = found.in_numbers(Calibration(scales={"range_of_motion": 2.0}))
    assert numbers.names == ("range_of_motion",)  # the other one is not known of every side
    assert numbers.better.tolist() == [[-0.5]]
    assert numbers.worse.tolist() == [[-1.5]]
    assert numbers.outcomes.tolist() == [[-0.25]]
    assert numbers.held.tolist() == [False]


def test_solves_of_a_record(tmp_path: Path, record: Path) -> None:
    index = {"solve": 1, "finger": "index", "candidate": 2}
    found = read_examples(write(tmp_path, record="r.sqlite", pairs=[{"better": {"solve": 1}, "worse": index}]))
    ((better, worse),) = found.pairs
    assert better == {"range_of_motion": 0.3, "touching_links": 1.0, "epsilon": 0.2}
    assert worse == {"range_of_motion": 0.3, "touching_links": 1.0}


def test_the_scores_of_a_solve_are_sums_over_its_fingers() -> None:
    solution = make_solution()
    index = solution.fingers["index"]
    other = replace(index, name="middle", candidates=(make_candidate(scores={"range_of_motion": 0.5}),), chosen=0)
    both = replace(solution, fingers={"index": index, "middle": other})
    assert solve_scores(both) == {"range_of_motion": pytest.approx(0.8)}


def test_outcomes_of_a_record(record: Path) -> None:
    with Record(record) as opened:
        opened.note_outcome(1, held=True)
        opened.note_outcome(2, held=False)
        opened.note_outcome(1, held=False)
        assert opened.outcomes() == [(1, True), (2, False), (1, False)]
        with pytest.raises(UnknownNameError, match="Solve '7' is not in"):
            opened.note_outcome(7, held=True)
    assert [held for _, held in recorded_outcomes(record).outcomes] == [True, False, False]


def test_a_record_of_the_first_version_is_carried_over(tmp_path: Path) -> None:
    path = tmp_path / "old.sqlite"
    with Record(path) as made:
        made.append(make_solution())
    connection = sqlite3.connect(path)
    connection.execute("DROP TABLE outcomes")
    connection.execute("PRAGMA user_version = 1")
    connection.commit()
    connection.close()
    with Record(path) as opened:
        opened.note_outcome(1, held=True)
        assert opened.outcomes() == [(1, True)]
        assert len(opened) == 1
    connection = sqlite3.connect(path)
    assert connection.execute("PRAGMA user_version").fetchone() == (record_module.SCHEMA_VERSION,)
    connection.close()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"schema": "x"}, "schema: expected 'clench.examples/1', got 'x'"),
        ({"pair": []}, "pair: unknown key; expected one of schema, record, pairs, outcomes"),
        ({"pairs": [{"better": scores(1.0)}]}, r"pairs\[0\]\.worse: missing"),
        ({"pairs": [{"better": {}, "worse": scores(1.0)}]}, r"pairs\[0\]\.better: expected 'scores' by criterion"),
        ({"outcomes": [{"of": {"solve": 1}, "held": True}]}, r"outcomes\[0\]\.of: names a solve, but the file has no"),
        ({"outcomes": [{"of": scores(1.0), "held": "yes"}]}, r"outcomes\[0\]\.held: expected bool, got str"),
        ({"record": "none.sqlite"}, "none.sqlite: no such record"),
        (
            {"record": "r.sqlite", "outcomes": [{"of": {"solve": 1, "finger": "ring", "candidate": 0}, "held": True}]},
            "solve 1 has no finger 'ring'; it has index, thumb",
        ),
        (
            {"record": "r.sqlite", "outcomes": [{"of": {"solve": 1, "finger": "index", "candidate": 3}, "held": True}]},
            r"outcomes\[0\]\.of: candidate: expected 0 to 2, got 3",
        ),
        ({"record": "r.sqlite", "outcomes": [{"of": {"solve": 1, "candidate": 0}, "held": True}]}, "expected 'scores'"),
        (
            {"outcomes": [{"of": {"scores": {"rang": 1.0}}, "held": True}]},
            r"outcomes\[0\]\.of: Criterion 'rang' is not in scores\.",
        ),
        (
            {"outcomes": [{"of": {"scores": {"range_of_motion": 1e300}}, "held": True}]},
            r"outcomes\[0\]\.of: scores.range_of_motion: expected a finite number, between 1e-12 and 1e\+12 in size",
        ),
    ],
)
def test_malformed_examples(tmp_path: Path, record: Path, content: dict[str, Any], message: str) -> None:
    with pytest.raises(FileError, match=message):
        read_examples(write(tmp_path, **content))


def test_numbers_that_are_not_finite(tmp_path: Path) -> None:
    path = tmp_path / "e.json"
    path.write_text('{"schema": "clench.examples/1", "outcomes": [{"of": {"scores": {"a": 1e999}}, "held": true}]}')
    with pytest.raises(FileError):
        read_examples(path)


def preferring_motion(tmp_path: Path) -> Path:
    pairs = [{"better": scores(1.0 + 0.1 * k), "worse": scores(2.0 + 0.1 * k)} for k in range(6)]
    return write(tmp_path, pairs=pairs)


def test_the_command_fits_and_writes_a_calibration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "fitted.toml"
    assert main(["calibrate", str(preferring_motion(tmp_path)), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "range_of_motion" in printed
    assert "tells 100% of those right that were left out" in " ".join(printed.split())
    assert "'balanced' tells 100% of the pairs right" in printed
    assert load_calibration(out).weights == {"range_of_motion": 1.0, "touching_links": 0.0}
    assert out.read_text().startswith("# Fitted to 6 pairs and 0 outcomes")
    assert tomllib.loads(out.read_text())


def test_the_command_prints_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", str(preferring_motion(tmp_path)), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["held_out_accuracy"] == 1.0
    assert document["weights"]["range_of_motion"] == 1.0
    assert document["pairs"] == 6


def test_outcomes_noted_by_the_command_line_are_fitted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    db = tmp_path / "r.sqlite"
    with Record(db) as made:
        for k in range(8):
            index = make_solution().fingers["index"]
            few = make_candidate(scores={"range_of_motion": 1.0, "touching_links": float(1 + k % 2)})
            made.append(make_solution(fingers={"index": replace(index, candidates=(few,), chosen=0)}))
    for k in range(8):
        assert main(["record", str(db), "--id", str(k + 1), "--outcome", "held" if k % 2 else "dropped"]) == 0
    capsys.readouterr()
    assert main(["calibrate", "--record", str(db), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["weights"] == {"range_of_motion": 0.0, "touching_links": 1.0}
    assert document["outcomes"] == 8
    assert document["held_out_accuracy"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["calibrate"], "expected an examples file, or --record with noted outcomes"),
        (["calibrate", "none.json"], "none.json: no such file"),
        (["calibrate", "--record", "none.sqlite"], "none.sqlite: no such record"),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_fit_that_fails_names_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, pairs=[{"better": scores(1.0), "worse": scores(2.0)}])
    assert main(["calibrate", str(path)]) == 2
    assert f"{path}: expected at least 4 pairs and outcomes, got 1." in capsys.readouterr().err


def test_an_outcome_needs_a_solve(record: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["record", str(record), "--outcome", "held"]) == 2
    assert "give its --id" in capsys.readouterr().err
