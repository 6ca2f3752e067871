"""Batches in files: their grasps come back as whole solutions, and only for what they were solved for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clench
from clench.core.exceptions import FileError
from clench.solver.batch.saved_question import SavedBatch


def test_grasps_of_a_file_are_solved_again(tmp_path: Path) -> None:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03", scale=1.1)
    command = clench.GraspCommand(clench.Pose.identity(), preshape={"index_yaw": 0.05})
    batch = clench.solve_batch(hand, ball, clench.approach_poses(hand, ball, 12, 1), command)
    batch.save(tmp_path / "b.npz")
    saved = SavedBatch(tmp_path / "b.npz")
    assert (saved.hand_model, saved.object_model, saved.object_scale) == ("robonaut2", "sphere:r=0.03", 1.1)
    solutions = list(saved.solutions(hand, ball))
    rows = np.flatnonzero(batch.status == "grasp")
    assert len(solutions) == len(rows) > 0
    for i, solution in zip(rows, solutions, strict=True):
        np.testing.assert_allclose(list(solution.joint_angles.values()), batch.joint_angles[i], atol=1e-9)
        assert solution.joint_angles["index_yaw"] == 0.05
        assert solution.object_scale == 1.1
    with pytest.raises(FileError, match=r"b\.npz: pose \d+: solved again .* it has other angles"):
        list(saved.solutions(hand, clench.GraspObject.load("sphere:r=0.03")))


def test_files_that_are_no_batches(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        SavedBatch(tmp_path / "absent.npz")
    (tmp_path / "b.npz").write_text("no")
    with pytest.raises(FileError, match="not a NumPy archive"):
        SavedBatch(tmp_path / "b.npz")
    np.savez(tmp_path / "b.npz", schema="clench.batch/1", status=np.array(["grasp"]))
    with pytest.raises(FileError, match=r"command: missing; the batch was saved without what it was asked"):
        SavedBatch(tmp_path / "b.npz")
    np.savez(tmp_path / "b.npz", x=np.zeros(3))
    with pytest.raises(FileError, match=r"schema: expected 'clench\.batch/1', got 'None'"):
        SavedBatch(tmp_path / "b.npz")
