"""Memory stays flat however many solves there are, and on however many objects."""

import subprocess
import sys
from pathlib import Path

import pytest

SOLVES = """
import gc, sys
import clench

def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

hand = clench.Hand.load("patent15")
objects = [clench.GraspObject.load("mug", scale=1.0 + 0.002 * k) for k in range(40)]
command = clench.GraspCommand(hand_pose=clench.approach_poses(hand, objects[0], 1, seed=0)[0])
clench.set_object_cache(int(sys.argv[1]))

def go_through(rounds):
    for obj in rounds * objects:
        clench.solve(hand, obj, command).contacts

go_through(int(sys.argv[2]))
before = resident()
go_through(int(sys.argv[3]))
print(resident() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="needs /proc to read the memory in use")
@pytest.mark.parametrize(("cache", "first", "then"), [(512_000_000, 10, 50), (0, 2, 5)], ids=["kept", "packed anew"])
def test_solves_on_forty_objects_leave_nothing_behind(cache, first, then):
    call = [sys.executable, "-c", SOLVES, str(cache), str(first), str(then)]
    grown = int(subprocess.run(call, check=True, capture_output=True, text=True).stdout)
    # 2,000 solves; 20,000 on the built-in Robonaut 2 hand grew by half a megabyte after the first 2,000.
    assert grown < 4e6
