"""The time that a command says it computed for has no loading of kernels in it."""

import json
import subprocess
import sys

import pytest

import clench
from clench.apps.cli.kernel_loading import load_kernels

#: Runs a command, and prints how many kernels were loaded when the solve began.
PROGRAM = """
import sys, clench
from clench.apps.cli.main import main
from clench.kernels.batch_solving import solve_poses
real = clench.solve

def solve(*arguments):
    before = list(solve_poses.signatures)
    solution = real(*arguments)
    print(len(before), len(solve_poses.signatures), file=sys.stderr)
    return solution

clench.solve = solve
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize(("order", "loaded"), [("proximal-first", "1 1"), ("together", "0 0")])
def test_the_kernel_of_a_solve_is_loaded_before_it_begins(tmp_path, order, loaded):
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    pose = clench.approach_poses(hand, mug, 1, 0)[0]
    tmp_path.joinpath("command.json").write_text(json.dumps({"hand_pose": pose.to_dict(), "preshape": "open"}))
    call = ["solve", "--hand", "robonaut2", "--object", "mug", "--command", "command.json", "--order", order, "--json"]
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *call], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode in (0, 1)
    assert run.stderr.splitlines() == [loaded]


def test_a_kernel_that_a_command_does_not_need_is_not_loaded(monkeypatch):
    monkeypatch.setattr("clench.kernels.warming.compile_ahead", lambda kernels: pytest.fail("it was loaded"))
    for changes in ({"order": clench.ClosingOrder.TOGETHER}, {"rounds": 2}, {"check_sets": True}):
        load_kernels(clench.GraspCommand(hand_pose=clench.Pose.identity(), **changes))
