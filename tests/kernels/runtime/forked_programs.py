"""Programs in processes of their own, forked from one that has loaded Numba's compiler, which saves a second each.

All of them have the hash seed of the first. Where a test needs another one, it starts Python anew.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

#: Forks for every line: a program, its words, variables of its environment, and a file for its output.
SERVER = """
import json, os, sys, traceback
import numba
from numba.core import config
from clench.kernels.runtime import compiling

numba.njit(lambda x: x + 1.0)(1.0)
for line in sys.stdin:
    program, words, variables, output = json.loads(line)
    child = os.fork()
    if child == 0:
        os.dup2(os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 1)
        os.environ.update(variables)
        config.reload_config()
        sys.argv, sys.path[:0] = ["-c", *words], [variables["PYTHONPATH"]]
        code = 0
        try:
            exec(program, {"__name__": "__main__"})
        except BaseException:
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        os._exit(code)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class ForkedPrograms:
    """A process that forks for each program; without `fork`, on Windows, each is a new process."""

    def __init__(self) -> None:
        command = [sys.executable, "-c", SERVER]
        self._server = None
        if hasattr(os, "fork"):
            self._server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def run(self, program: str, *words: str, folder: Path) -> str:
        """Return what a program prints, whose modules and cache of kernels are in a folder."""
        variables = {"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
        if self._server is None:
            return run_anew(program, *words, folder=folder)
        output = folder / "output.txt"
        self._server.stdin.write(json.dumps([program, words, variables, str(output)]) + "\n")
        self._server.stdin.flush()
        assert self._server.stdout.readline() == "0\n"
        return output.read_text()

    def __enter__(self) -> ForkedPrograms:
        return self

    def __exit__(self, *_: object) -> None:
        if self._server is not None:
            self._server.communicate()


def run_anew(program: str, *words: str, folder: Path) -> str:
    """Return what a program prints in a new process; its modules and its cache of kernels are in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, "-c", program, *words]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout
