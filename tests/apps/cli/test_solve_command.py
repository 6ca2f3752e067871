"""`clench solve --pose-error`: the table, the document, and bad input."""

import json

import pytest

from clench.apps.cli.main import main

SOLVE = ["solve", "--hand", "patent15", "--object", "sphere:r=0.03", "--planes", "1", "--pose-error"]


def test_a_table_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SOLVE, "0.001", "1"]) in (0, 1)
    shown = capsys.readouterr().out
    assert "the object off by ±1 mm and ±1°" in shown
    assert "answers at the corners: " in shown


def test_a_key_of_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SOLVE, "0.001", "1", "--json"]) in (0, 1)
    document = json.loads(capsys.readouterr().out)
    error = document["pose_error"]
    assert error["translation"] == 0.001
    assert error["rotation"] == pytest.approx(0.0174533, rel=1e-5)
    assert set(error["predicted"]) == set(error["measured"]) == set(document["joint_angles"])
    assert sum(error["statuses"].values()) == 64


def test_a_negative_error_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SOLVE, "-0.001", "1"]) == 2
    assert "pose error: expected a translation of 0 or more" in capsys.readouterr().err
