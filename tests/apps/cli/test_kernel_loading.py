"""The time that a command says it computed for has no loading of kernels in it."""

import json
import subprocess
import sys

import pytest

import clench

#: Runs a command, and prints how many kernels were loaded when the solve began.
PROGRAM = """
import sys, clench
from clench.apps.cli.main import main
from clench.kernels.closing.solve_poses import solve_poses
real = clench.solve

def solve(*arguments):
    before = list(solve_poses.signatures)
    solution = real(*arguments)
    print(len(before), len(solve_poses.signatures), file=sys.stderr)
    return solution

clench.solve = solve
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize("order", ["proximal-first", "together"])
def test_the_kernel_of_a_solve_is_loaded_before_it_begins(tmp_path, order):
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    pose = clench.approach_poses(hand, mug, 1, 0)[0]
    tmp_path.joinpath("command.json").write_text(json.dumps({"hand_pose": pose.to_dict(), "preshape": "open"}))
    call = ["solve", "--hand", "robonaut2", "--object", "mug", "--command", "command.json", "--order", order, "--json"]
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *call], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode in (0, 1)
    assert run.stderr.splitlines() == ["1 1"]
