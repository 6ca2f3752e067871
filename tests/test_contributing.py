"""CONTRIBUTING.md names files that exist, and the workflow runs what it says."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

from clench.apps.cli.inputs.choices import Order
from clench.models.command import ClosingOrder

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    """Return the text of a section."""
    return re.split(r"^## ", PAGE.split(f"## {title}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]


def files(text: str) -> set[str]:
    """Return the files and folders that a text names."""
    return {path for path in re.findall(r"`([\w./-]+)`", text) if "/" in path}


def test_every_file_exists() -> None:
    named = files(PAGE) - {"../shared/data"}
    assert len(named) > 50
    assert [path for path in sorted(named) if not (ROOT / path).exists()] == []


def test_every_file_that_knows_the_axis_of_a_joint_is_listed() -> None:
    reads = re.compile(
        r"\.anchor\b|joints\[[^]]*\]\.axis\b|joint\.axis\b|\bj\.axis\b|(?:full_width|sweep|frames|s)\.axis\b"
    )
    layers = ("models", "kernels", "mechanics", "closing", "scoring")
    found = {
        path.relative_to(ROOT).as_posix()
        for layer in layers
        for path in (ROOT / "src" / "clench" / layer).rglob("*.py")
        if reads.search(path.read_text(encoding="utf-8"))
    }
    table = "\n".join(line for line in section("Add a joint type").splitlines() if line.startswith("|"))
    assert len(found) > 15
    assert files(table) == found


def test_every_file_that_tells_orders_apart_is_listed() -> None:
    # Files that go through all orders, or hand them on, do not change with a new one.
    named = re.compile(r"ClosingOrder\.[A-Z]|proximal-first\", \"together")
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "src").rglob("*.py")
        if named.search(path.read_text(encoding="utf-8"))
    }
    listed = files(section("Add a closing order"))
    assert {"src/clench/models/command.py", "src/clench/apps/cli/inputs/choices.py"} < found
    assert found - listed <= {"src/clench/execution/simulation/piece_hold.py"}
    assert set(Order.__args__) == {order.value for order in ClosingOrder}


def test_the_costs_of_all_dependencies_are_stated() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    rows = section("Dependencies")
    names = [re.split(r"[<>=]", each)[0] for each in project["dependencies"]]
    assert "ruckig" not in names
    assert [name for name in names if not re.search(rf"^\|[^|]*\b{name}\b", rows, re.MULTILINE)] == []


def test_the_workflow_runs_the_checks_on_three_systems() -> None:
    (job,) = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8"))["jobs"].values()
    assert [name.split("-")[0] for name in job["strategy"]["matrix"]["os"]] == ["ubuntu", "macos", "windows"]
    assert job["runs-on"] == "${{ matrix.os }}"
    (step,) = [each for each in job["steps"] if ".ci/run" in each.get("run", "")]
    assert step["shell"] == "bash"
    assert (ROOT / ".ci" / "run").is_file()
