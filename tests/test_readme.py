"""README and docs say what is true: the code runs, links lead somewhere, commands and keys exist and are all there."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

import clench
from clench.apps.cli.command_table import COMMANDS
from clench.execution.hardware.driver import MEMBERS
from clench.models.command_file import KEYS, command_from_dict
from clench.models.hand.findings import FindingCode
from clench.models.hand.hand_file import read_hand_file
from clench.planner.options import PlanArguments
from clench.planner.rejections import Rejection
from clench.scoring import criterion_registry
from clench.scoring.calibration import preset_names
from clench.scoring.criterion_registry import criterion_names, find_criterion
from clench.solver.causes import CauseCode
from handmade import make_solution

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_the_ten_lines_run_and_their_number_is_right() -> None:
    code, planning = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    names: dict[str, Any] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["report"].success
    said = re.search(r'"index_proximal": ([\d.]+)', code)
    assert said is not None
    assert names["solution"].joint_angles["index_proximal"] == pytest.approx(float(said[1]), abs=0.005)
    exec(compile(planning, "README.md", "exec"), names)
    assert len(names["plan"]) == 5


def test_the_page_about_planning_runs_and_names_all_options_and_reasons(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = page("planning.md")
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(code, "planning.md", "exec"), names)
    assert names["plan"].proposed
    options = set(PlanArguments.__annotations__) - {"torsion"}
    assert options <= set(re.findall(r"`(\w+)=", text))
    for reason in Rejection:
        assert reason.value in text


def test_the_driver_on_the_page_works_and_its_members_are_all() -> None:
    text = page("controllers.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "controllers.md", "exec"), names)
    assert names["report"].success, names["report"].reason
    assert names["report"].sent.commands > 10
    assert tuple(re.findall(r"^\| `(\w+)[:(]", text, re.MULTILINE)) == MEMBERS
    for kind in (clench.HandState, clench.JointPath, clench.DriverLimits):
        table = text[text.index(f"| `{kind.__name__}` |") :].split("\n\n")[0]
        for field in fields(kind):
            assert f"`{field.name}" in table


def test_the_scene_on_the_page_is_grasped_as_often_as_it_says() -> None:
    text = page("surroundings.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "surroundings.md", "exec"), names)
    assert len(names["scene"].bodies) == 3
    assert names["batch"].counts()["grasp"] >= 8
    (around, free) = map(int, re.findall(r"(\d+) of 100\s+poses give a grasp; without the table, (\d+) do", text)[0])
    mug = clench.GraspObject.load("mug")
    for obj, said in ((mug.with_body(clench.table()), around), (mug, free)):
        poses = clench.approach_poses(names["hand"], obj, 100, seed=0)
        assert clench.solve_batch(names["hand"], obj, poses).counts()["grasp"] == said


@pytest.mark.parametrize("path", PAGES, ids=[p.name for p in PAGES])
def test_links_lead_to_files(path: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", path.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (path.parent / target).exists(), target


def test_the_table_lists_every_command() -> None:
    assert set(re.findall(r"^\| `clench (\w+)", page("command-line.md"), re.MULTILINE)) == set(COMMANDS)
    assert "ten more commands](docs/command-line.md)" in README
    assert len(COMMANDS) == 4 + 10


def test_the_table_of_layers_names_every_folder_and_files_that_exist() -> None:
    table = README[README.index("| folder |") :].split("\n\n")[0]
    source = ROOT / "src" / "clench"
    named = {}
    for row in table.splitlines()[2:]:
        folder, _, files = row.strip("| ").split(" | ")
        named[folder.strip("`")] = re.findall(r"`(\w+\.py)`", files)
    assert [
        f"{folder}/{file}" for folder in named for file in named[folder] if not (source / folder / file).exists()
    ] == []
    assert all(named.values())
    assert {path.parent.name for path in source.glob("*/__init__.py")} == {folder.split("/")[0] for folder in named}


def test_the_two_commands_are_there() -> None:
    assert "pip install uv && uv run --no-dev clench demo " in README
    assert "pip install uv && uv run pytest " in README


def test_the_source_of_the_method_is_named() -> None:
    assert "9,067,319" in README
    assert "legal status" in README
    assert "Apache-2.0" in README


def test_every_key_of_a_command_file_is_documented() -> None:
    documented = set(re.findall(r"`(\w+)`", page("command-file.md")))
    assert set(KEYS) <= documented


def test_the_command_file_shown_is_read() -> None:
    import json

    (shown,) = re.findall(r"\n\n(    \{.*?\})\n\n", page("command-file.md"), re.DOTALL)
    command = command_from_dict(json.loads(shown))
    solution = clench.solve(clench.Hand.load("robonaut2"), clench.GraspObject.load("ball"), command)
    assert set(solution.fingers) == {"index", "middle", "thumb"}


def test_every_key_of_a_solution_is_documented() -> None:
    document = make_solution().to_dict()
    finger = next(f for f in document["fingers"].values() if f["candidates"])
    contact = document["contacts"][0]
    documented = set(re.findall(r"`(\w+)", page("solution-format.md")))
    for keys in (document, finger, finger["candidates"][0], contact):
        assert set(keys) <= documented


def test_every_finding_about_a_hand_is_documented() -> None:
    assert {code.value for code in FindingCode} == set(
        re.findall(r"^\| `(\w+)` \|", page("hand-report.md"), re.MULTILINE)
    )


def test_every_cause_of_a_finger_that_does_not_touch_is_documented() -> None:
    assert {code.value for code in CauseCode} <= set(
        re.findall(r"^\| `(\w+)` \|", page("solution-format.md"), re.MULTILINE)
    )


def test_the_own_hand_page_leads_to_a_grasp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the page shows: a model, its findings, a hand file, a solve."""
    text = page("own-hand.md")
    (model,) = re.findall(r"```xml\n(.*?)```", text, re.DOTALL)
    (hand_file,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (tmp_path / "pincer.urdf").write_text(model)
    monkeypatch.chdir(tmp_path)
    for finding in clench.check_hand(clench.Hand.load("pincer.urdf")):
        assert f"({finding.code}): {finding.text}" in " ".join(text.split())
    (tmp_path / "pincer.hand.toml").write_text(hand_file)
    assert [f.code for f in clench.check_hand(clench.Hand.load("pincer.urdf"))] == ["collision_from_visuals"]
    names: dict[str, Any] = {}
    exec(compile(code, "own-hand.md", "exec"), names)
    assert names["solution"].status == "grasp"
    assert names["solution"].certified


def test_the_objects_page_runs_and_names_every_field_and_kind() -> None:
    text = page("objects.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "objects.md", "exec"), names)
    assert names["scene"].pose == names["alone"].pose == names["poses"][0].pose
    documented = set(re.findall(r"`(\w+)`", text))
    assert {field.name for field in fields(clench.StablePose)} <= documented
    assert {kind.value for kind in clench.GraspKind} == set(re.findall(r"^\| `(\w+)` \| .*(?:finger|palm)", text, re.M))


def test_every_criterion_and_preset_is_documented() -> None:
    text = page("calibration.md")
    for name in criterion_names():
        c = find_criterion(name, "test")
        row = rf"^\| `{name}` \| .+ \| {c.unit} \| {'more' if c.larger_is_better else 'less'} \| {c.scale:g} \|$"
        assert re.search(row, text, re.MULTILINE), name
    assert set(preset_names()) <= set(re.findall(r"`(\w+)`", text))


def test_the_calibration_file_shown_is_read(tmp_path: Path) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", page("calibration.md"), re.DOTALL)
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    calibration = clench.load_calibration(tmp_path / "c.toml")
    assert calibration.weights
    assert calibration.limits


def test_the_criterion_shown_is_scored(monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", page("calibration.md"), re.DOTALL)
    monkeypatch.setattr(criterion_registry, "_registry", dict(criterion_registry._registry))
    names: dict[str, Any] = {}
    exec(compile(code, "calibration.md", "exec"), names)
    solution = clench.solve(clench.Hand.load("robonaut2"), clench.GraspObject.load("mug"), names["command"])
    assert all("symmetric" in c.scores for f in solution.fingers.values() for c in f.candidates)
    assert list(solution.choice["criteria"]) == ["symmetric"]


def test_the_hand_file_shown_is_read(tmp_path: Path) -> None:
    blocks = re.findall(r"(?:^    .*\n|^\n(?=    ))+", page("hand-file.md"), re.MULTILINE)
    text = "".join(blocks).replace("\n    ", "\n").removeprefix("    ").strip()
    (tmp_path / "x.hand.toml").write_text(text, encoding="utf-8")
    read = read_hand_file(tmp_path / "x.hand.toml")
    assert read.palm == "link"
    assert set(tomllib.loads(text)) == {
        *("palm", "collision_source", "allowed_pairs", "fingers", "joints", "links", "tendons"),
    }
    assert read.joints["Y"].follows == "X"
    assert read.tendons is not None


def test_the_forces_page_holds_a_ball_and_names_every_key() -> None:
    text = page("forces.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "forces.md", "exec"), names)
    assert names["squeeze"].feasible
    assert names["squeeze"].text in code
    full = names["full"]
    documented = set(re.findall(r"`(\w+)`", text))
    for part in (full.quality, full.quality["actuation"], full.squeeze):
        assert set(part) <= documented


def test_the_preshapes_page_tells_the_choice_and_names_every_key() -> None:
    text = page("preshapes.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "preshapes.md", "exec"), names)
    said = names["solution"].choice["preshapes"]
    assert f'["chosen"]  # "{said["chosen"]}"' in code
    documented = set(re.findall(r"`(\w+)`", text))
    assert set(said) | set(said["compared"]["open"]) <= documented
