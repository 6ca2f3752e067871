"""Errors beside --json: one document on standard output, one sentence on standard error."""

from __future__ import annotations

import json

import pytest

from clench.apps.cli.main import main

SOLVE = ["solve", "--hand", "robonaut2", "--object", "ball"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["solv"], "Command 'solv' is not in clench. Did you mean 'solve'?"),
        (["hand", "robonaut3"], "Hand 'robonaut3' is not in the built-in hands"),
        (["execute", "absent.json"], "absent.json: no such file."),
        (["record", "absent.db"], "absent.db: no such record."),
        (["batch", "--hand", "robonaut2", "--object", "ball", "--count", "0"], "--count: expected at least 1, got 0."),
        (["bench", "nothing"], "Benchmark 'nothing' is not in clench bench."),
        (
            [*SOLVE, "--oder", "together"],
            "clench solve: Unrecognized options: --oder, together. Did you mean '--order'? Options: ",
        ),
        ([*SOLVE, "--planes", "many"], "clench solve: Error parsing --planes:"),
        (
            [*SOLVE, "--order", "sideways"],
            "clench solve: Invalid choice 'sideways' for argument '--order'. Expected one of proximal-first, ",
        ),
        (["solve"], "clench solve: Missing from clench solve: --hand STR --object STR."),
        (["hand"], "clench hand: Missing from clench hand: STR."),
    ],
)
@pytest.mark.parametrize("letters_alone", [False, True])
@pytest.mark.parametrize("as_json", [False, True])
def test_an_error_is_a_sentence_and_beside_json_a_document(
    arguments: list[str],
    sentence: str,
    letters_alone: bool,
    as_json: bool,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Boxes are drawn with lines or with letters alone, as standard output allows.
    monkeypatch.setattr("tyro._fmtlib._FORCE_UTF8_BOXES", not letters_alone)
    assert main([*arguments, *["--json"] * as_json]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"clench: error: {sentence}")
    assert captured.err.count("\n") == 1
    if as_json:
        document = json.loads(captured.out)
        assert list(document) == ["error"]
        assert captured.err == f"clench: error: {document['error']}\n"
    else:
        assert captured.out == ""


@pytest.mark.parametrize(("error", "code"), [(RuntimeError("a\nb"), 70), (KeyboardInterrupt(), 130)])
def test_every_end_is_a_document(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> int:
        raise error

    monkeypatch.setattr("clench.apps.cli.main.parse_call", lambda *_: fail)
    assert main(["record", "x", "--json"]) == code
    captured = capsys.readouterr()
    assert captured.err == f"clench: error: {json.loads(captured.out)['error']}\n"


def test_help_beside_json_is_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "--json", "--help"]) == 0
    assert "--object" in capsys.readouterr().out
