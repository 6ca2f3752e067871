"""`clench batch`: poses from a file or by seed, answers in a file of arrays, one sentence for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main

BASE = ["batch", "--hand", "patent15", "--object", "ball", "--planes", "2"]


def test_approach_poses_by_seed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "grasps.npz"
    assert main([*BASE, "--count", "3", "--seed", "1", "--out", str(out)]) == 0
    assert "patent15 on ball: 3 poses" in capsys.readouterr().out
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    poses = clench.approach_poses(hand, obj, 3, 1)
    with np.load(out) as data:
        np.testing.assert_array_equal(data["hand_poses"], [p.wxyz_xyz for p in poses])
        for pose, angles in zip(poses, data["joint_angles"], strict=True):
            alone = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, planes=2))
            assert list(alone.joint_angles.values()) == angles.tolist()


def test_poses_from_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    far = np.tile(np.eye(4), (2, 1, 1))
    far[:, 0, 3] = 5.0
    np.save(tmp_path / "poses.npy", far)
    assert main([*BASE, "--poses", str(tmp_path / "poses.npy"), "--planes-only", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "clench.batch/1"
    assert (document["poses"], document["status"]["no_contact"]) == (2, 2)
    assert document["certified"] == document["one_by_one"] == 0


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "no such file; expected a NumPy file"),
        (b"hello", "not a NumPy file"),
        (np.zeros((2, 3)), "got shape (2, 3)."),
        (np.full((1, 7), np.nan), "[0]: expected finite numbers."),
        (np.array(["a"]), "expected an array of real numbers, got one of str32."),
        (np.array([[True] * 7]), "expected an array of real numbers, got one of bool."),
        (np.array([[1.0 + 1j] + [0.0] * 6]), "expected an array of real numbers, got one of complex128."),
        (np.empty((0, 7)), "expected at least one pose, got none."),
    ],
)
def test_bad_files(content: object, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "poses.npy"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        np.save(path, content)
    assert main([*BASE, "--poses", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"clench: error: {path}")
    assert sentence in error
    assert error.count("\n") == 1


def test_bad_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*BASE, "--out", "grasps.txt"]) == 2
    assert "--out: expected a file that ends in .npz, got 'grasps.txt'." in capsys.readouterr().err
    assert main([*BASE, "--count", "0"]) == 2
    assert "--count: expected at least 1, got 0." in capsys.readouterr().err
