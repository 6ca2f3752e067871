"""Guides and pages: every snippet runs, in order, in one folder; every command of a guide has the exit code it says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from clench.apps.cli.main import main
from clench.core.pose import Pose

DOCS = Path(__file__).parents[1] / "docs"
GUIDES = ["make-data.md", "use-a-robot.md", "use-mujoco.md"]


def run_commands(block: str, where: str) -> int:
    """Run the lines of a block that call clench; return how many there are."""
    lines = [line for line in block.splitlines() if line.startswith("clench ")]
    for line in lines:
        said = re.search(r"# exit code (\d+)", line)
        code = main(shlex.split(line, comments=True)[1:])
        assert code == (int(said[1]) if said else 0), f"{where}: {line}"
    return len(lines)


@pytest.mark.parametrize("name", GUIDES)
def test_guide_runs_as_it_stands(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (DOCS / name).read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": name}
    commands = snippets = 0
    for language, block in re.findall(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if language == "bash":
            commands += run_commands(block, name)
        else:
            assert language == "python", f"{name}: a block of {language}"
            exec(compile(block, name, "exec"), names)
            snippets += 1
    assert commands >= 3
    assert snippets >= 3


@pytest.mark.parametrize("name", ["batch.md", "exporting.md", "hold.md", "motions.md", "pose-error.md"])
def test_the_snippets_of_a_page_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", (DOCS / name).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert blocks
    monkeypatch.chdir(tmp_path)
    kept: list[Any] = []
    # What the reader has of their own.
    names: dict[str, Any] = {"__name__": name, "camera_pose": Pose.identity(), "keep": kept.append}
    for block in blocks:
        names["pose_iterator"] = iter(names.get("poses", ()))
        exec(compile(block, name, "exec"), names)
    if name == "batch.md":
        assert sum(len(angles) for angles in kept) == names["batch"].counts()["grasp"] > 0
    if name == "hold.md":
        assert names["report"].hold.held


def test_the_guide_to_an_own_hand_is_as_short() -> None:
    assert len((DOCS / "own-hand.md").read_text(encoding="utf-8").splitlines()) <= 150
