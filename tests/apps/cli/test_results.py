"""Commands that write look at their targets before they load or compute anything, and leave nothing behind."""

import sqlite3
from pathlib import Path

import pytest

import clench
from clench.apps.cli.main import main

SOLVE = ["solve", "--hand", "patent15", "--object", "ball"]
BATCH = ["batch", "--hand", "patent15", "--object", "ball"]
EXECUTE = ["execute", "solution.json"]

#: Targets: `old` is a file, `folder` a folder, `none` is missing.
CALLS = [
    ([*SOLVE, "--out", "old"], "old: cannot be made a folder"),
    ([*SOLVE, "--out", "old/figures"], "old/figures: cannot be made a folder"),
    ([*SOLVE, "--record", "folder"], "folder: cannot be written (it is a folder)."),
    ([*SOLVE, "--record", "none/record.sqlite"], "none/record.sqlite: cannot be written (no folder 'none')."),
    ([*SOLVE, "--record", "old"], "old: not a record of solves: the file is no SQLite database."),
    ([*SOLVE, "--record", "other.sqlite"], "other.sqlite: a SQLite file of another program"),
    ([*BATCH, "--out", "folder.npz"], "folder.npz: cannot be written (it is a folder)."),
    ([*BATCH, "--out", "none/a.npz"], "none/a.npz: cannot be written (no folder 'none')."),
    ([*BATCH, "--out", "blocked.npz"], "blocked.npz.parts: cannot be made a folder"),
    (["demo", "--out", "old"], "old: cannot be made a folder"),
    (["demo", "--out", "broken"], "broken/record.sqlite: not a record of solves"),
    (["hand", "patent15", "--figure", "folder"], "folder: cannot be written (it is a folder)."),
    (
        ["hand", "patent15", "--figure", "a.txt"],
        "a.txt: no figure has the ending '.txt'; expected .png, .pdf, .svg, .eps",
    ),
    (["export", "solution.json", "--out", "none/a.yaml"], "none/a.yaml: cannot be written (no folder 'none')."),
    (
        ["export", "solution.json", "--out", "a.foo"],
        "a.foo: the ending names no format; expected .yaml, .yml, .npy, .json",
    ),
    (["import", "grasps.yaml", "--hand", "patent15", "--out", "old"], "old: cannot be made a folder"),
    (["calibrate", "examples.json", "--out", "none/a.toml"], "none/a.toml: cannot be written (no folder 'none')."),
    ([*EXECUTE, "--out", "folder"], "folder: cannot be written (it is a folder)."),
    ([*EXECUTE, "--video", "none/a.gif"], "none/a.gif: cannot be written (no folder 'none')."),
    ([*EXECUTE, "--stills", "old"], "old: cannot be made a folder"),
    ([*EXECUTE, "--actuator", "signal", "--to", "file:a", "--record", "old"], "old: not a record of solves"),
    (["bench", "steadiness", "--plot", "none/a.png"], "none/a.png: cannot be written (no folder 'none')."),
    (["bench", "steadiness", "--plot", "a.txt"], "a.txt: no figure has the ending '.txt'; expected .png, .pdf"),
    (["bench", "hold", "--table", "folder"], "folder: cannot be written (it is a folder)."),
]


@pytest.mark.parametrize(("call", "sentence"), CALLS, ids=[" ".join(call) for call, _ in CALLS])
def test_a_bad_target_is_told_before_anything_is_done(call, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for folder in ("folder", "folder.npz", "broken"):
        Path(folder).mkdir()
    for file in ("old", "blocked.npz.parts", "broken/record.sqlite"):
        Path(file).write_text("This text is longer than the head of a database, and none. " * 4)
    with sqlite3.connect("other.sqlite") as other:
        other.execute("CREATE TABLE mine (id)")
    other.close()
    monkeypatch.setattr(clench.Hand, "load", lambda *args, **kwargs: pytest.fail("the hand was loaded first"))
    monkeypatch.setattr(clench.GraspSolution, "load", lambda *args: pytest.fail("the solution was loaded first"))
    monkeypatch.setattr(
        "clench.apps.cli.inputs.export_sources.read_grasps", lambda *args: pytest.fail("the solutions were read first")
    )
    monkeypatch.setattr(
        "clench.solver.analysis.examples.read_examples", lambda *args: pytest.fail("the examples were read first")
    )
    monkeypatch.setattr(
        "benchmarks.speed.epsilon_timing.bench_steadiness", lambda *args: pytest.fail("it was run first")
    )
    before = sorted(tmp_path.rglob("*"))
    assert main(call) == 2
    told = capsys.readouterr()
    assert told.err.startswith(f"clench: error: {sentence}")
    assert told.out == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_a_good_target_is_not_made_before_it_is_needed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    clench.Record.check("record.sqlite")
    assert main([*SOLVE, "--command", "none.json", "--out", "a/b", "--record", "record.sqlite"]) == 2
    assert list(tmp_path.iterdir()) == []
    with clench.Record("record.sqlite") as record:
        assert len(record) == 0
    clench.Record.check("record.sqlite")
