"""What is freed after work on a large mesh goes back to the system."""

from __future__ import annotations

import platform
import subprocess
import sys

import numpy as np
import pytest

from clench.core.memory import AT_ONCE, in_parts

#: Arrays as work on a mesh makes them: large ones come and go, small ones between them stay.
TRIAL = """
import sys
import numpy as np
from clench.core.memory import LARGE, expect

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


@pytest.mark.parametrize("rows", [0, 1, AT_ONCE - 1, AT_ONCE, AT_ONCE + 1, 3 * AT_ONCE + 7])
def test_parts_are_all_rows_once_and_in_order(rows: int) -> None:
    parts = [np.arange(rows)[some] for some in in_parts(rows)]
    assert np.array_equal(np.concatenate([np.empty(0), *parts]), np.arange(rows))
    assert max(map(len, parts), default=0) <= AT_ONCE
    assert min(map(len, parts), default=1) > 0
