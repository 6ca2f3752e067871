"""Closing on a CUDA device: by the simulator, to the bit of the CPU; and what is said where there is no device."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.kernels.closing import cuda_closing


def test_the_simulator_gives_the_answers_of_the_cpu() -> None:
    # Whether there is a simulator is decided when numba is imported.
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("cuda_trial.py")],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert len(lines) == 4
    for _, _, count, _, outcome in lines:
        assert int(count) > 5
        assert outcome == "same"


def test_without_a_device_a_warning_says_why_and_the_cpu_solves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cuda_closing, "why_no_device", lambda: "no driver.")
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    poses = clench.approach_poses(hand, ball, 2, seed=0)
    with pytest.warns(UserWarning, match=r"^Device 'cuda' cannot be used: no driver\. Solving on the CPU\.$"):
        batch = clench.solve_batch(hand, ball, poses, device="cuda")
    assert np.array_equal(batch.joint_angles, clench.solve_batch(hand, ball, poses).joint_angles)


def test_an_unknown_device_is_refused() -> None:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    with pytest.raises(clench.ClenchError, match="device: expected one of cpu, cuda, got 'gpu'"):
        clench.solve_batch(hand, ball, [clench.Pose.identity()], device="gpu")
