"""What is freed after work on a large mesh goes back to the system."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

#: Arrays as work on a mesh makes them: large ones come and go, small ones between them stay.
TRIAL = """
import sys
import numpy as np
from clench.base.memory import LARGE, expect

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

if sys.argv[1] == "large":
    expect(LARGE)
before, kept = resident(), []
for _ in range(2):
    large = []
    for _ in range(20):
        large.append(np.ones(1_000_000))
        kept.append(bytearray(100_000))
    del large
print(resident() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="how glibc keeps what is freed")
def test_large_blocks_are_given_back() -> None:
    def left(kind: str) -> int:
        done = subprocess.run([sys.executable, "-c", TRIAL, kind], capture_output=True, text=True, check=True)
        return int(done.stdout)

    assert left("large") < 10_000_000 < 50_000_000 < left("small")
