"""The command line about preshapes: tables, documents, pictures, and one sentence for a wrong name."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main
from clench.apps.figures.maps import hand_map
from clench.solver.preshapes.preshapes import opposition_zones

HELD = {"position": [-0.05, -0.1, 0.06], "wxyz": [0.5, 0.5, 0.5, 0.5]}


def command_file(folder: Path, **keys: object) -> str:
    path = folder / "c.json"
    path.write_text(json.dumps({"hand_pose": HELD, "planes": 1, **keys}))
    return str(path)


def solve_mug(folder: Path, *more: str, **keys: object) -> int:
    return main(["solve", "--hand", "robonaut2", "--object", "mug", "--command", command_file(folder, **keys), *more])


def test_a_hand_lists_its_preshapes(capsys) -> None:
    assert main(["hand", "robonaut2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    found = opposition_zones(clench.Hand.load("robonaut2"))
    assert document["preshapes"] == [shape.to_dict() for shape in found]
    low, high = document["preshapes"][1]["aperture_range"]
    assert low <= document["preshapes"][1]["aperture"] <= high
    assert main(["hand", "robonaut2"]) == 0
    printed = capsys.readouterr().out
    assert all(f" {shape.name} " in printed for shape in found)
    shape = found[2]
    row = next(line for line in printed.splitlines() if f" {shape.name} " in line)
    assert f"{1e3 * shape.aperture.min():.0f} to {1e3 * shape.aperture.max():.0f}" in row
    assert f"{shape.quality.max():.2f}" in row


def test_the_picture_of_a_hand_has_them(tmp_path) -> None:
    from PIL import Image

    hand = clench.Hand.load("robonaut2")
    shapes = opposition_zones(hand)[:9]
    plain = Image.open(hand_map.draw_hand_map(hand, tmp_path / "plain.png"))
    both = Image.open(hand_map.draw_hand_map(hand, tmp_path / "both.png", preshapes=shapes))
    assert both.width == plain.width
    assert both.height == plain.height + hand_map.sheet_height(9)
    assert hand_map.sheet_height(0) == 0
    below = np.asarray(both.convert("RGB")).astype(int)[plain.height :]
    row = len(below) // 2
    for column in range(7):
        tile = below[40:row, 20 + 240 * column : 240 + 240 * column]
        assert len(np.unique(tile.reshape(-1, 3), axis=0)) > 50
        orange = (abs(tile - [0xD5, 0x5E, 0x00]).sum(axis=2) < 60).sum()
        assert orange > 30
    # The second row has two pictures.
    assert (below[row + 40 :, 20 + 240 * 2 :] == 255).all()


def test_a_solve_prints_what_was_compared(tmp_path, capsys) -> None:
    assert solve_mug(tmp_path) == 0
    printed = capsys.readouterr().out
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    pose = clench.Pose.from_dict(HELD, "hand_pose")
    said = clench.solve(hand, mug, clench.GraspCommand(hand_pose=pose, planes=1)).choice["preshapes"]
    assert said["text"] in printed
    words = [line.replace("│", " ").split() for line in printed.splitlines()]
    rows = {
        name: row
        for name in said["compared"]
        for row in words
        if name in row[:2] and {"grasp", "partial"} & set(row[1:3])
    }
    assert set(said["compared"]) == set(rows)
    assert rows[said["chosen"]][0] == "*"
    assert rows[said["runner_up"]][0] == "2"
    assert all(f"{each['epsilon_bound']:.3f}" in rows[name] for name, each in said["compared"].items())
    assert solve_mug(tmp_path, preshape="open") == 0
    assert "preshapes" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("preshape", "options", "sentence"),
    [
        ("open", (), r"force closure: the grasp resists every wrench at friction 0\.6; epsilon is at least 0\.\d+\n"),
        ("grip-75mm", (), r"no force closure found at friction 0\.6: some pulls may move the object;"),
        ("open", ("--html", "page.html"), r"force closure: .* at friction 0\.6; epsilon is 0\.197\n"),
    ],
)
def test_a_solve_says_whether_the_grasp_resists_every_wrench(
    tmp_path, capsys, monkeypatch, preshape, options, sentence
) -> None:
    monkeypatch.chdir(tmp_path)
    assert solve_mug(tmp_path, *options, preshape=preshape) == 0
    assert re.search(sentence, capsys.readouterr().out)


def test_an_answer_without_a_grasp_says_nothing_of_closure(tmp_path, capsys) -> None:
    far = {"hand_pose": {"position": [0.0, 0.0, 9.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}, "preshape": "open"}
    (tmp_path / "far.json").write_text(json.dumps(far))
    assert main(["solve", "--hand", "robonaut2", "--object", "mug", "--command", str(tmp_path / "far.json")]) == 1
    assert "closure" not in capsys.readouterr().out


def test_files_and_documents_agree(tmp_path, capsys) -> None:
    assert solve_mug(tmp_path, "--json", "--out", str(tmp_path / "out")) == 0
    document = json.loads(capsys.readouterr().out)
    chosen = document["choice"]["preshapes"]
    assert solve_mug(tmp_path, "--json", preshape=chosen["chosen"]) == 0
    assert json.loads(capsys.readouterr().out)["joint_angles"] == document["joint_angles"]
    assert solve_mug(tmp_path, "--json", preshape=chosen["angles"]) == 0
    assert json.loads(capsys.readouterr().out)["joint_angles"] == document["joint_angles"]
    saved = clench.GraspSolution.load(tmp_path / "out" / "solution.json")
    assert saved.choice["preshapes"] == chosen


@pytest.mark.parametrize(
    ("preshape", "sentence"),
    [
        ("grip-60mm", "Preshape 'grip-60mm' is not in hand 'robonaut2'. Did you mean 'grip-"),
        ("", "preshape: expected a name, got ''."),
        (
            3,
            "preshape: expected an object of names with a number in rad each, 'open', or the name of a preshape, ",
        ),
    ],
)
def test_a_wrong_preshape_gets_one_sentence(tmp_path, capsys, preshape, sentence) -> None:
    assert solve_mug(tmp_path, preshape=preshape) == 2
    told = capsys.readouterr()
    assert told.err.startswith(f"clench: error: {tmp_path / 'c.json'}: {sentence}")
    assert told.err.count("\n") == 1
    assert not told.out
