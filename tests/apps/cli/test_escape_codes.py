"""Names from files do not command the terminal: escape codes in them are written out, in every output for people."""

from dataclasses import replace
from pathlib import Path

import pytest

import clench
from clench.apps.cli.main import main
from clench.apps.cli.output import printing
from clench.core.showing.visible_text import visible
from clench.execution.execution_report import ExecutionReport
from fuzz.originals import MJCF, link_stl
from handmade import make_solution

#: Red, a title for the window, and a mark that turns the direction of writing.
CODES = "\x1b[31m\x1b]0;x\x07\x9b2J\u202e"
#: The same as far as XML can hold it.
XML_CODES = "\x9b2J\u202e"


def odd(text: str) -> set[str]:
    return {c for c in text if not c.isprintable() and c != "\n"}


def odd_model(folder: Path) -> Path:
    path = folder / f"{CODES}hand.xml"
    text = MJCF
    for name in ("pincer", "palm", "index_1", "index_2", "thumb_1"):
        text = text.replace(f'"{name}"', f'"{name}{XML_CODES}"')
    path.write_text(text, encoding="utf-8")
    (folder / "link.stl").write_bytes(link_stl())
    return path


def odd_object(folder: Path) -> Path:
    path = folder / f"{CODES}.obj"
    path.write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    return path


def test_what_is_seen():
    assert visible("a [b] é 日本 \\") == "a [b] é 日本 \\"
    assert visible(CODES) == "\\x1b[31m\\x1b]0;x\\x07\\x9b2J\\u202e"
    assert visible("one\ntwo") == "one\\ntwo"


def test_hand(tmp_path, capsys):
    assert main(["hand", str(odd_model(tmp_path)), "--figure", str(tmp_path / f"{CODES}.png")]) == 0
    out = capsys.readouterr().out
    assert "\\x9b2J" in out
    assert odd(out) == set()


def test_solve(tmp_path, capsys):
    given = ["--hand", str(odd_model(tmp_path)), "--object", str(odd_object(tmp_path)), "--explain", "--forces"]
    main(["solve", *given, "--pose-error", "0.001", "1", "--out", str(tmp_path / CODES), "--planes", "1"])
    heard = capsys.readouterr()
    assert "\\x9b2J" in heard.out
    assert odd(heard.out + heard.err) == set()


def test_record(tmp_path, capsys):
    path = tmp_path / f"{CODES}.sqlite"
    cause = {"code": CODES, "text": CODES}
    finger = next(iter(make_solution().fingers.values()))
    fingers = {CODES: replace(finger, name=CODES, cause=cause)}
    solution = make_solution(hand=CODES, object=CODES, reason={"code": "x", "text": CODES}, fingers=fingers)
    with clench.Record(path) as record:
        record.append(replace(solution, certificate={"text": CODES}))
    assert main(["record", str(path)]) == main(["record", str(path), "--id", "1"]) == 0
    heard = capsys.readouterr()
    assert heard.out.count("\\x1b[31m") >= 5
    assert odd(heard.out + heard.err) == set()


@pytest.mark.parametrize("command", ["hand", "record", "execute", "export", "import"])
def test_sentences_about_files(tmp_path, capsys, command):
    path = tmp_path / f"{CODES}.yaml"
    path.write_text(f"a: {CODES!r}")
    more = {"import": ["--hand", "patent15", "--out", str(tmp_path)], "export": ["--out", str(path)]}
    assert main([command, str(path), *more.get(command, [])]) == 2
    assert odd(capsys.readouterr().err) == set()


def test_report_of_an_execution(capsys):
    printing.print_report(ExecutionReport(actuator=CODES, success=False, reason=CODES, notes=(CODES,)))
    printing.print_weights({CODES: 1.0}, CODES)
    printing.print_files([Path(CODES)])
    batch = {"hand": CODES, "object": CODES, "poses": 1, "seconds": 1.0, "status": {CODES: 1}, "certified": 0}
    printing.print_batch(batch)
    assert odd(capsys.readouterr().out) == set()
