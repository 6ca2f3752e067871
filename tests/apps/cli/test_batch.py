"""`clench batch`: poses from a file or by seed, answers in a file of arrays, one sentence for bad input."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main
from clench.solver.batch.batch_solver import BatchSolver

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
            alone = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, planes=2, preshape="open"))
            assert list(alone.joint_angles.values()) == angles.tolist()


def test_poses_from_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    far = np.tile(np.eye(4), (2, 1, 1))
    far[:, 0, 3] = 5.0
    np.save(tmp_path / "poses.npy", far)
    assert main([*BASE, "--poses", str(tmp_path / "poses.npy"), "--planes-only", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "clench.batch/1"
    assert (document["poses"], document["status"]["no_contact"]) == (2, 2)
    assert document["certified"] == 0


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
    assert "grasps.txt: expected a file that ends in .npz." in capsys.readouterr().err
    assert main([*BASE, "--count", "0"]) == 2
    assert "--count: expected at least 1, got 0." in capsys.readouterr().err


def test_a_killed_batch_goes_on(tmp_path: Path) -> None:
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    poses = [pose.wxyz_xyz for pose in clench.approach_poses(hand, obj, 20, 0)]
    np.save(tmp_path / "poses.npy", np.tile(poses, (3, 1)))
    program = "import sys; from clench.apps.cli.main import main; sys.exit(main(sys.argv[1:]))"
    call = [sys.executable, "-c", program, *BASE, "--poses", str(tmp_path / "poses.npy"), "--chunk", "1"]
    whole, killed = tmp_path / "whole.npz", tmp_path / "killed.npz"
    assert main([*call[3:], "--out", str(whole)]) == 0
    found = 0
    for _ in range(2):
        process = subprocess.Popen([*call, "--out", str(killed)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        parts = found
        while parts < found + 3 and process.poll() is None:
            parts = len(list(tmp_path.glob("killed.npz.parts/0*.npz")))
        process.kill()
        assert process.wait() == -signal.SIGKILL
        assert not killed.exists()
        readable = list(tmp_path.glob("killed.npz.parts/0*.npz"))
        for part in readable:
            with np.load(part) as data:
                assert data["joint_angles"].shape == (1, len(hand.joints))
        assert len(readable) > found
        found = len(readable)
    assert main([*call[3:], "--out", str(killed)]) == 0
    assert killed.read_bytes() == whole.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["killed.npz", "poses.npy", "whole.npz"]


def test_an_interrupted_batch_says_where_its_parts_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, done = BatchSolver.solve, []

    def ended(self: BatchSolver, *args: Any) -> Any:
        if done:
            raise KeyboardInterrupt
        done.append(args)
        return solve(self, *args)

    monkeypatch.setattr(BatchSolver, "solve", ended)
    out = tmp_path / "grasps.npz"
    assert main([*BASE, "--count", "3", "--chunk", "2", "--out", str(out)]) == 130
    assert f"what is solved is in '{out}.parts'; the same call goes on from there." in capsys.readouterr().err
    assert len(list((tmp_path / "grasps.npz.parts").glob("*.npz"))) == 1
