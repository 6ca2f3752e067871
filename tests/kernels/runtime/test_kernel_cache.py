"""A kernel from disk runs without a prepared compiler, and can still become part of another kernel."""

import subprocess
import sys
from pathlib import Path

from kernels.runtime.forked_programs import ForkedPrograms

#: Solves, and prints whether Numba prepared its compiler, compiled its own functions, or loaded what these come from.
SOLVE = """
import sys
from pathlib import Path
import clench
from clench.apps.cli.commands.demo import MUG_POSE
hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
solution = clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE))
solution.to_dict()
from numba.core.runtime.nrt import rtsys
needless = ("numba.np.arraymath", "numba.np.arrayobj", "numba.cpython.unicode")
print(solution.status, [name for name in needless if name in sys.modules], rtsys._init)
"""

#: Calls a kernel from Python and from a function that is compiled here; prints what came from disk.
CALL = """
import numba
from clench.kernels.sections.coupled import cosine_and_sine
from clench.kernels.runtime.kernel_cache import LoadedLibrary
first = cosine_and_sine(0.5)
(result,) = cosine_and_sine.overloads.values()
caller = numba.njit(lambda angle: cosine_and_sine(angle))
print(first == caller(0.5), isinstance(result.library, LoadedLibrary))
"""


def run(program: str) -> str:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout


def test_a_solve_with_kernels_from_disk_prepares_no_compiler() -> None:
    run(SOLVE)  # compiles what is not on disk
    assert run(SOLVE) == "grasp [] False\n"


def test_a_kernel_from_disk_becomes_part_of_one_that_is_compiled() -> None:
    run(CALL)
    assert run(CALL) == "True True\n"


def test_a_damaged_file_of_machine_code_is_compiled_anew(tmp_path: Path) -> None:
    program = "from clench.kernels.sections.coupled import cosine_and_sine; print(cosine_and_sine(0.5))"
    with ForkedPrograms() as programs:
        found = programs.run(program, folder=tmp_path)
        assert len(found) > 10
        files = list(tmp_path.rglob("coupled.cosine_and_sine-*.nbc"))
        assert files
        for size in (0, 100, 300):
            for path in files:
                path.write_bytes(path.read_bytes()[:size])
            assert programs.run(program, folder=tmp_path) == found
            assert all(path.stat().st_size > 300 for path in files), "the whole file is written again"
