"""Errors beside --json: one document on standard output, one sentence on standard error."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import clench
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
            "clench solve: '--oder' is no option of this command. Did you mean '--order'? See clench solve --help.",
        ),
        ([*SOLVE, "--planes", "many"], "clench solve: --planes: expected a whole number, got 'many'."),
        (
            [*SOLVE, "--order", "sideways"],
            "clench solve: --order: expected one of proximal-first, together, fingertip, got 'sideways'.",
        ),
        (["solve"], "clench solve: expected --hand and --object, which are missing."),
        (["hand"], "clench hand: expected MODEL, which is missing."),
        ([*SOLVE, "--seed", "1", "--seed", "2"], "clench solve: --seed is given more than once; give it once."),
    ],
)
@pytest.mark.parametrize("as_json", [False, True])
def test_an_error_is_a_sentence_and_beside_json_a_document(
    arguments: list[str],
    sentence: str,
    as_json: bool,
    capsys: pytest.CaptureFixture[str],
) -> None:
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


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["execute", "FILE"], "not JSON: expected a solution, as `clench solve --out` writes it, got {}."),
        (
            ["export", "FILE", "--out", "g.yaml"],
            "not JSON: expected a solution, a list of solutions or a plan, got {}.",
        ),
        ([*SOLVE, "--command", "FILE"], "not JSON: expected a command file, got {}."),
        (["calibrate", "FILE"], "not JSON: expected an examples file, got {}."),
    ],
)
@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"v 0 0 0\nv 1 0 0\n", "text that begins with 'v 0 0 0'"),
        (b"\x89PNG\r\n", "bytes that are no text"),
        (b" \n", "an empty file"),
    ],
)
def test_a_file_of_another_kind_is_told_with_what_was_expected(
    arguments: list[str],
    sentence: str,
    content: bytes,
    kind: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("range.obj").write_bytes(content)
    assert main([each.replace("FILE", "range.obj") for each in arguments]) == 2
    assert capsys.readouterr().err == f"clench: error: range.obj: {sentence.format(kind)}\n"


def test_documents_of_another_form_name_the_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "trajectory.json"
    file.write_text('{"schema": "clench.trajectory/1", "hand": "robonaut2"}')
    assert main(["calibrate", str(file)]) == 2
    assert capsys.readouterr().err.endswith("hand: unknown key; expected one of schema, record, pairs, outcomes.\n")
    assert main(["import", str(file), "--hand", "patent15", "--out", str(tmp_path / "c.json")]) == 2
    assert capsys.readouterr().err.endswith("trajectory.json: grasp_pose: missing.\n")


def test_a_record_lists_one_solve_at_least(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "r.sqlite"
    clench.Record(file).close()
    assert main(["record", str(file), "--limit", "-1"]) == 2
    assert capsys.readouterr().err == "clench: error: --limit: expected at least 1, got -1.\n"


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
