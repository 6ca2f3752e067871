"""Every example runs as it stands, without a screen, and is short enough to read."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def test_examples_are_numbered_from_nought() -> None:
    assert [path.name[:3] for path in EXAMPLES] == [f"{i:02}_" for i in range(len(EXAMPLES))]
    assert EXAMPLES


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_example_is_short_and_says_what_it_shows(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    assert text.startswith('"""')


def test_the_first_one_runs_by_itself(tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, EXAMPLES[0], tmp_path / "out"], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("\n") >= 2
    assert "Traceback" not in run.stderr


#: Half a minute or more each.
LONG = {"14_pictures"}
CASES = [pytest.param(p, id=p.stem, marks=[pytest.mark.long] * (p.stem in LONG)) for p in EXAMPLES[1:]]


@pytest.mark.parametrize("path", CASES)
def test_example_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(path), str(tmp_path / "out")])
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out.count("\n") >= 2
